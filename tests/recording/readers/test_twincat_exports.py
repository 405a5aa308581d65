"""Real TwinCAT exports of one recording in several settings: each read right, and to the same values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from linid.recording import ChannelMapping, read_recording
from linid.recording.readers.registry import read_table
from linid.recording.table import Table
from tests.shared_data import shared

STEM = "tc3_scope_3_4_3145_3"
FILES = ("-ContainEOF_true", "-DecimalMark_,", "-Seperator_1", "-Seperator_3", "-default", "_noOS")


def table(name: str) -> Table:
    """One export."""
    return read_table(shared("real", "twincat", f"{STEM}{name}.csv"), ChannelMapping())


def values(found: Table, symbol: str) -> list[tuple[np.ndarray, np.ndarray]]:  # type: ignore[type-arg]
    """Times and values of the channels of a symbol, in the file's order."""
    out = []
    for column in found.columns:
        if symbol in (column.name, *column.aliases) and not column.time:
            clock = next(c for c in found.columns if c.time and c.group == column.group)
            out.append((clock.values, column.values))
    return out


@pytest.mark.parametrize("name", FILES)
def test_every_group_has_its_own_clock(name: str) -> None:
    found = table(name)
    rates = {}
    for column in found.columns:
        if column.time:
            rates.setdefault(round(float(np.median(np.diff(column.values))), 6), column.values.size)
            assert column.unit == "ms" and np.isfinite(column.values).all()
    expected = {1.0: 1000} if name == "_noOS" else {0.2: 4996, 1.0: 1000, 5.0: 200}
    assert rates.keys() == expected.keys()
    assert all(abs(rates[rate] - count) <= 4 for rate, count in expected.items()), rates


@pytest.mark.parametrize("name", FILES)
def test_counters_count(name: str) -> None:
    """The variables are counters in ms: whole numbers that equal their time stamps, or end at 8 bits."""
    found = table(name)
    for symbol in ("MAIN.var_DINT", "MAIN.var_UDINT", "MAIN.var_LREAL", "MAIN.var_LINT"):
        ((t, x),) = values(found, symbol)
        np.testing.assert_array_equal(t, x)
    ((t, x),) = values(found, "MAIN.var_USINT")
    np.testing.assert_array_equal(t % 256, x)
    scaled = {float(x[10]) for _, x in values(found, "MAIN.var_REAL") if x.size > 900}
    assert scaled == ({10.0} if name == "-default" else {10.0, -9.0, -90.0}), scaled  # x, 1 - x and 10 - 10 x
    assert any("declares scaling" in note for note in found.notes)


@pytest.mark.parametrize("name", FILES[1:])
def test_settings_change_no_value(name: str) -> None:
    one, other = table(FILES[0]), table(name)
    scaled = () if name == "-default" else ("MAIN.var_INT",)  # which holds them as recorded, before the scaling
    for symbol in ("MAIN.var_BOOL", "MAIN.var_UINT", "MAIN.var_ULINT", "MAIN.var_SINT", *scaled):
        mine, theirs = values(one, symbol), values(other, symbol)
        assert len(mine) == len(theirs) > 0
        sets = [sorted((t.size, tuple(x)) for t, x in group) for group in (mine, theirs)]
        assert sets[0] == sets[1], symbol


def test_a_recording_from_each(tmp_path: Path) -> None:
    for name in FILES:
        mapping = {
            "position": {"column": "MAIN.var_DINT", "unit": "um"},
            "current_q": {"column": "MAIN.var_LREAL", "unit": "mA"},
        }
        recording = read_recording(
            shared("real", "twincat", f"{STEM}{name}.csv"), channels=ChannelMapping.model_validate(mapping)
        )
        np.testing.assert_allclose(recording.y, 1e-3 * recording.t, atol=1e-12)
        assert recording.drive_input is not None
        np.testing.assert_allclose(recording.drive_input, recording.t, atol=1e-9)


def head(separator: str, middle_first: bool) -> list[str]:
    """Three groups whose clocks differ; the longest one first, in the middle or last."""
    groups = [("fast", 1, 40), ("slow", 4, 10), ("mid", 2, 20)]
    order = groups if not middle_first else [groups[1], groups[0], groups[2]]
    rows = [["Name", "x"], ["Starttime of export", "1"], []]
    rows += [[cell for name, *_ in order for cell in ("Name", name)]]
    rows += [[cell for _ in order for cell in ("Data-Type", "REAL64")]]
    rows += [[cell for name, *_ in order for cell in ("SymbolName", f"MAIN.{name}")], []]
    for k in range(40):
        row = []
        for _, step, count in order:
            row += [str(k * step), f"{k * step + 0.25}"] if k < count else ["", ""]
        while row and not row[-1]:
            row.pop()
        rows.append(row)
    return [separator.join(row) for row in rows]


@pytest.mark.parametrize("separator", ["\t", ";", ",", " ", ":", "|"])
@pytest.mark.parametrize("middle_first", [False, True])
def test_groups_that_end_early_stay_in_their_columns(tmp_path: Path, separator: str, middle_first: bool) -> None:
    path = tmp_path / "scope.csv"
    path.write_text("\n".join(head(separator, middle_first)) + "\n", encoding="utf-8")
    found = read_table(path, ChannelMapping())
    sizes = {c.name: c.values.size for c in found.columns if not c.time}
    assert sizes == {"fast": 40, "slow": 10, "mid": 20}
    for column in found.columns:
        if not column.time:
            clock = next(c for c in found.columns if c.time and c.group == column.group)
            np.testing.assert_array_equal(column.values, clock.values + 0.25)
