"""inspect_file tells what was understood; its starter mapping reads the file once the blanks are filled."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from shared_data import shared

from linid.errors import DataError
from linid.recording import ChannelMapping, inspect_file, read_recording, starter_mapping

from .exports import HEADER, T, Y, german, lines, write


def test_what_was_understood(tmp_path: Path) -> None:
    path = write(tmp_path, ["Export of today", *map(german, lines())], encoding="utf-8-sig")
    seen = inspect_file(path)
    assert (seen.layout, seen.encoding, seen.header_line, seen.first_data_line) == ("generic", "utf-8-sig", 2, 3)
    assert seen.dialect == "separator semicolon, decimal comma"
    assert seen.rate == pytest.approx(1000) and seen.jitter == pytest.approx(0, abs=1e-9) and seen.rows == 200
    assert seen.problem is None and seen.t_end == pytest.approx(T[-1])
    position = seen.columns[1]
    assert (position.channel, position.declared, position.si, position.factor) == ("position", "mm", "m", 1e-3)
    assert position.minimum == pytest.approx(Y.min(), abs=1e-6) and position.maximum == pytest.approx(Y.max(), abs=1e-6)
    assert position.text == "Actual Position (mm): mm x 0.001 -> m"


def test_starter_mapping_of_an_understood_file_reads_it(tmp_path: Path) -> None:
    path = write(tmp_path, lines())
    channels = yaml.safe_load(starter_mapping(inspect_file(path)))["channels"]
    again = read_recording(path, channels=ChannelMapping.model_validate(channels))
    np.testing.assert_array_equal(again.y, read_recording(path).y)


def test_starter_mapping_of_an_unknown_file_lists_candidates(tmp_path: Path) -> None:
    path = write(tmp_path, ['A;Lage;Lage 2;B: "x"'] + [f"{k};{k};{2 * k};{k % 5}" for k in range(60)])
    seen = inspect_file(path)
    assert seen.problem is not None and "ambiguous" in seen.problem
    text = starter_mapping(seen)
    channels = yaml.safe_load(text)["channels"]
    assert channels["position"] == {"column": "Lage", "unit": "TODO"}
    assert channels["time"]["column"] == "TODO" and "also possible: #3" in text and "#4" in text
    channels = {"position": {"column": "Lage", "unit": "mm"}, "period": "1 ms"}
    assert inspect_file(path, ChannelMapping.model_validate(channels)).problem is None


def test_missing_unit_is_reported_not_raised(tmp_path: Path) -> None:
    seen = inspect_file(write(tmp_path, ["Time (ms),Position", *(f"{k},{k}" for k in range(60))]))
    assert seen.problem is not None and "no unit declared" in seen.problem
    assert yaml.safe_load(starter_mapping(seen))["channels"]["position"] == {"column": "Position", "unit": "TODO"}


def test_angle_makes_it_rotary(tmp_path: Path) -> None:
    seen = inspect_file(write(tmp_path, ["Time (ms),Position (deg)", *(f"{k},{k}" for k in range(60))]))
    assert seen.problem is None and seen.columns[1].si == "rad"


def test_no_table_at_all_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DataError):
        inspect_file(write(tmp_path, [HEADER]))


def test_matlab_file_without_mapping() -> None:
    seen = inspect_file(shared("emps", "DATA_EMPS.mat"))
    assert seen.layout == "mat" and seen.problem is not None
    text = starter_mapping(seen)
    assert all(f'"{name}"' in text for name in ("qm", "qg", "vir", "t"))
    assert yaml.safe_load(text)["channels"]["time"]["column"] == "t"
