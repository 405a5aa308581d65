"""The result files of a fit, and those that other packages add."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from linid.errors import ConfigError
from linid.report.files import columns_csv_text, csv_text
from linid.report.result_files import BUILT_IN, GROUP, collect
from linid.workflow.run import results
from tests.report.samples import fit_result

MODULE = "tests.report.example_result_file"


def point(name: str) -> EntryPoint:
    return EntryPoint("line", f"{MODULE}:{name}", GROUP)


def test_a_file_of_another_package_is_written_beside_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = collect(BUILT_IN, [point("RESULT_FILE")])
    monkeypatch.setattr(results, "result_files", lambda: files)
    result = fit_result()
    results.write_fit(result, tmp_path)
    rows = list(csv.DictReader(io.StringIO((tmp_path / "friction_line.csv").read_text())))
    assert float(rows[0]["coulomb_m_per_s2"]) == result.value("coulomb_force") / result.value("mass")
    assert (tmp_path / "parameters.json").exists() and not (tmp_path / "profiles.csv").exists()


def test_a_file_with_nothing_to_tell_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = collect(BUILT_IN, [point("RESULT_FILE")])
    monkeypatch.setattr(results, "result_files", lambda: files)
    results.write_fit(replace(fit_result(), per_mass=True), tmp_path)
    assert not (tmp_path / "friction_line.csv").exists()


@pytest.mark.parametrize(
    ("name", "fact"), [("TAKEN", "is taken"), ("NONE", "names no"), ("MISSING", "cannot be loaded")]
)
def test_what_is_no_result_file_is_refused(name: str, fact: str) -> None:
    with pytest.raises(ConfigError, match=fact):
        collect(BUILT_IN, [point(name)])


@given(arrays(np.float64, st.tuples(st.integers(2, 5), st.integers(0, 20))), st.integers(3, 12))
def test_columns_of_numbers_are_written_as_any_table(table: np.ndarray, digits: int) -> None:
    header = [f"column_{k}" for k in range(table.shape[0])]
    assert columns_csv_text(header, list(table), digits) == csv_text(header, table.T.tolist(), digits)
