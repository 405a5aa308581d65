"""Inputs that once broke something, and a few hundred fresh ones: none may again."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz.inputs import Input, made
from tests.fuzz.judge import verdict

CORPUS = sorted(
    p for p in (Path(__file__).parent / "corpus").iterdir() if p.suffix in (".csv", ".mat", ".yaml", ".json")
)


@pytest.mark.parametrize("path", CORPUS, ids=lambda p: p.name)
def test_what_once_broke(path: Path, tmp_path: Path) -> None:
    assert verdict(Input(path.name.split("_")[0], path.suffix, path.read_bytes()), tmp_path) == ""


@pytest.mark.parametrize("kind", ["readers", "yaml", "models", "checkpoints"])
def test_fresh_inputs(kind: str, tmp_path: Path) -> None:
    wrong = {seed: said for seed in range(100) if (said := verdict(made(kind, seed), tmp_path))}
    assert not wrong
