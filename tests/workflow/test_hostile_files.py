"""YAML, models and search states that nobody should write: refused in words, at once, in bounded memory."""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from linid.cli.main import cli
from linid.config import YamlFile, parse_yaml
from linid.errors import ConfigError, LinidError
from linid.identification.model_file import load_model
from linid.recording import read_campaign, read_recording

STAND = Path(__file__).parents[2] / "data" / "stand"
LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
YAMLS = {
    "an alias that holds itself": "recordings: &a [*a]\n",
    "an alias of a mapping in itself": "known: &a {mass: *a}\nrecordings: []\n",
    "billion laughs": LAUGHS,
    "a date that is none": "name: 2021-02-30\nrecordings: []\n",
    "a tagged date that is none": "name: !!timestamp 2021-02-30\nrecordings: []\n",
    "a number of 5000 digits": f"known: {{mass: {'9' * 5000}}}\nrecordings: [{{file: a.csv}}]\n",
    "a file name of 5000 characters": f"recordings: [{{file: {'a' * 5000}.csv}}]\n",
    "a python object": "name: !!python/object/apply:os.system ['true']\n",
    "a set": "recordings: !!set {a, b}\n",
    "binary": "name: !!binary aGVsbG8=\nrecordings: !!binary x\n",
    "nested lists": "recordings: " + "[" * 5000 + "\n",
    "nested mappings": "".join(" " * k + "a:\n" for k in range(200)),
    "a list as key": "? [a, b]\n: 1\n",
    "a mapping as key": "? {a: b}\n: 1\nrecordings: []\n",
    "merge of a text": "<<: x\nrecordings: []\n",
    "bytes": "\x00\x01",
    "infinite": "known: {mass: .inf}\nrecordings: [{file: a.csv}]\n",
    "a name that is a list": "name: [1]\nrecordings: [{file: a.csv}]\n",
    "two documents": "name: a\n---\nname: b\n",
    "a lone tag": "!!omap [a: 1]\n",
    "a very long key": f"{'k' * 100_000}: 1\n",
}


@pytest.mark.parametrize("name", YAMLS)
def test_yaml(tmp_path: Path, name: str) -> None:
    path = tmp_path / "campaign.yaml"
    path.write_text(YAMLS[name], encoding="utf-8")
    start = time.process_time()
    with pytest.raises(LinidError) as caught:
        read_campaign(path)
    assert caught.value.exit_code == 3 and len(str(caught.value)) < 3000 and "campaign.yaml" in caught.value.place
    assert time.process_time() - start < 5.0


def test_what_looks_like_a_date_is_text(tmp_path: Path) -> None:
    assert parse_yaml("a: 2021-02-03\nb: 2001-12-14t21:59:43.10-05:00\n", "x") == {
        "a": "2021-02-03",
        "b": "2001-12-14t21:59:43.10-05:00",
    }


def test_aliases_of_reasonable_size_are_kept() -> None:
    assert parse_yaml("a: &a {x: 1}\nb: {<<: *a, y: 2}\n", "x") == {"a": {"x": 1}, "b": {"x": 1, "y": 2}}


@pytest.mark.parametrize("reads", [YamlFile, load_model, read_recording], ids=["yaml", "model", "recording"])
def test_only_regular_files_are_read(tmp_path: Path, reads: Callable[[Path], Any]) -> None:
    fifo = tmp_path / "pipe"
    os.mkfifo(fifo)
    start = time.monotonic()
    for path in (
        fifo,
        Path("/dev/zero"),
        Path("/dev/urandom"),
        tmp_path,
        tmp_path / ("x" * 5000),
        tmp_path / "nothing",
    ):
        with pytest.raises(LinidError) as caught:
            reads(path)
        assert caught.value.exit_code in (3, 4) and len(caught.value.place) < 1000
    assert time.monotonic() - start < 5.0


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("model")
    shutil.copy(STAND / "freewheel_1.csv", folder)
    arguments = ["fit-friction", folder / "freewheel_1.csv", "--out", folder / "o", "--no-figures", "-q"]
    assert CliRunner().invoke(cli, [*map(str, arguments), "--set", "generations=2"]).exit_code in (0, 5)
    return folder


def changed(body: dict[str, Any], name: str, value: Any) -> dict[str, Any]:
    """A model with another value of one parameter."""
    rows = [{**row, "value": value} if row["name"] == name else row for row in body["estimates"]]
    return {**body, "estimates": rows}


MODELS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "substeps 2e9": lambda b: {**b, "substeps": 2_000_000_000},
    "substeps 0": lambda b: {**b, "substeps": 0},
    "substeps of infinity": lambda b: {**b, "substeps": 1e308},
    "mass 0": lambda b: changed(b, "mass", 0.0),
    "mass -1": lambda b: changed(b, "mass", -1.0),
    "mass 1e308": lambda b: changed(b, "mass", 1e308),
    "mass nothing": lambda b: changed(b, "mass", None),
    "negative friction": lambda b: changed(b, "coulomb_force", -3.0),
    "a text for a number": lambda b: changed(b, "mass", "heavy"),
    "an unknown kind": lambda b: {**b, "model": "magic"},
    "an unknown axis": lambda b: {**b, "axis": "round"},
    "an unknown effect": lambda b: {**b, "effects": ["magic"]},
    "effects of numbers": lambda b: {**b, "effects": [1, 2]},
    "no estimates": lambda b: {**b, "estimates": []},
    "estimates of nothing": lambda b: {**b, "estimates": None},
    "starts as a list": lambda b: {**b, "starts": [1]},
    "a wrong correlation": lambda b: {**b, "correlation": [[1.0]] * 3},
    "another schema": lambda b: {**b, "schema": 99},
    "a list": lambda b: [b],
    "nothing": lambda b: None,
}


@pytest.mark.parametrize("name", MODELS)
def test_models(model: Path, tmp_path: Path, name: str) -> None:
    body = json.loads((model / "o" / "parameters.json").read_text(encoding="utf-8"))
    path = tmp_path / "model.json"
    path.write_text(json.dumps(MODELS[name](body)), encoding="utf-8")
    result = CliRunner().invoke(
        cli, ["simulate", str(path), str(model / "freewheel_1.csv"), "--out", str(tmp_path / "s")]
    )
    assert result.exit_code == 3, result.output
    assert "model.json" in result.output and not (tmp_path / "s").exists()


@pytest.mark.parametrize(
    "text",
    ["", "{", "[" * 100_000, '{"kind": NaN}', '{"a": 1e999}', '{"a": ' + "9" * 5000 + "}", "\ufeff{}", "null", "\x00"],
    ids=["empty", "cut", "deep", "NaN", "1e999", "digits", "mark", "null", "NUL"],
)
def test_json_that_is_none(tmp_path: Path, text: str) -> None:
    path = tmp_path / "model.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"model\.json"):
        load_model(path)


@pytest.mark.parametrize(
    "text", ["", "[]", '{"identity": 1}', "{" * 100_000, '{"identity": "x", "schema": 1, "state": 3}']
)
def test_search_states(tmp_path: Path, text: str) -> None:
    from linid.workflow.run.checkpoint import Checkpoint

    path = tmp_path / "checkpoint.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match="Delete it"):
        Checkpoint(path, "x").load()
