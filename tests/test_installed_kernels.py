"""Kernels that came with the installation: used where they fit, and only there."""

from __future__ import annotations

from pathlib import Path

import pytest
from numba import njit
from numba.core.registry import cpu_target

from linid import installed_kernels
from linid.installed_kernels import SWITCH, installed_folder
from linid.simulation.compiled import KernelCache, fingerprint


def outer(x):  # type: ignore[no-untyped-def]
    return 3 * x


def kernel(folder: Path, installed: Path | None = None, key: str | None = None):  # type: ignore[no-untyped-def]
    """`outer` compiled, kept in a folder."""
    function = njit(outer)
    function._cache = KernelCache(outer, folder, key or fingerprint(outer), installed)
    return function


def test_what_was_installed_is_loaded_and_nothing_is_kept_anew(tmp_path: Path) -> None:
    installed, own = tmp_path / "installed", tmp_path / "own"
    assert kernel(installed)(2) == 6
    before = {file: file.read_bytes() for file in installed.iterdir()}
    there = kernel(own, installed)
    assert there._cache.begun and there(2) == 6
    assert sum(there.stats.cache_hits.values()) == 1 and not own.exists()
    assert there(2.5) == 7.5  # types that nobody compiled then
    assert sum(there.stats.cache_misses.values()) == 1 and list(own.glob("*.nbc"))
    assert {file: file.read_bytes() for file in installed.iterdir()} == before


def test_kernels_of_other_formulas_are_compiled(tmp_path: Path) -> None:
    installed, own = tmp_path / "installed", tmp_path / "own"
    kernel(installed, key="of other formulas")(2)
    one = kernel(own, installed)
    assert not one._cache.begun and one(2) == 6
    assert sum(one.stats.cache_misses.values()) == 1 and len(list(own.glob("*.nbc"))) == 1


def test_they_serve_the_processor_that_they_were_made_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    codegen = cpu_target.target_context.codegen()
    monkeypatch.setattr(installed_kernels, "_FOLDER", tmp_path)
    monkeypatch.delenv(SWITCH, raising=False)
    assert installed_folder(codegen) is None
    told = tmp_path / "processor.txt"
    told.write_text(repr(codegen.magic_tuple()))
    assert installed_folder(codegen) == tmp_path
    monkeypatch.setenv(SWITCH, "0")
    assert installed_folder(codegen) is None
    monkeypatch.delenv(SWITCH)
    told.write_text(repr((*codegen.magic_tuple()[:-1], "+one-more")))
    assert installed_folder(codegen) is None
