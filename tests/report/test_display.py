"""Decimation keeps what the eye must see; units fit magnitudes; files are written whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from linid.report.display import display_unit, envelope, every, peak, rms
from linid.report.files import file_stems, write_atomic

SERIES = arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6) | st.just(np.nan))


@given(SERIES, st.integers(1, 30))
def test_envelope_keeps_extremes_and_ends(y: np.ndarray, bins: int) -> None:
    t = np.arange(len(y), dtype=float)
    te, ye = envelope(t, y, bins)
    assert len(te) <= max(2 * bins, 3 * bins + 2)
    assert te[0] == t[0] and te[-1] == t[-1] and np.all(np.diff(te) > 0)
    np.testing.assert_array_equal(ye, y[te.astype(int)])  # only true samples, at their own instants
    assert np.isnan(y).any() == np.isnan(ye).any()
    if np.isfinite(y).any():
        assert np.nanmin(ye) == np.nanmin(y) and np.nanmax(ye) == np.nanmax(y)


def test_envelope_keeps_a_single_spike_and_a_gap() -> None:
    t = np.arange(100_000) * 1e-3
    y = np.sin(t)
    y[54_321] = 9.0
    y[70_000:] = np.nan
    te, ye = envelope(t, y, 500)
    assert len(te) < 1600
    assert 9.0 in ye
    assert np.nanmax(te[np.isfinite(ye)]) <= 70.0 and np.isnan(ye[-1])


def test_short_lines_are_drawn_as_they_are() -> None:
    t = np.arange(2000.0)
    assert envelope(t, t)[0] is t


@pytest.mark.parametrize(
    ("quantity", "axis", "magnitude", "unit"),
    [
        ("position", "linear", 0.4, "mm"),
        ("position", "linear", 12e-6, "µm"),
        ("position", "linear", 5.0, "m"),
        ("position", "linear", 0.0, "mm"),
        ("position", "linear", float("nan"), "mm"),
        ("position", "rotary", 6.3, "rad"),
        ("position", "rotary", 2e-5, "µrad"),
        ("position", "rotary", 0.02, "mrad"),
        ("velocity", "linear", 1.2, "m/s"),
        ("velocity", "linear", 0.02, "mm/s"),
        ("velocity", "rotary", 50, "rad/s"),
        ("force", "linear", 3.0, "N"),
        ("force", "rotary", 0.01, "mN m"),
    ],
)
def test_display_units(quantity: str, axis: str, magnitude: float, unit: str) -> None:
    display = display_unit(quantity, axis, magnitude)  # type: ignore[arg-type]
    assert display.unit == unit
    prefix = {"µ": 1e6, "m": 1e3}.get(unit[0], 1.0) if unit not in ("m", "m/s") else 1.0
    assert display.factor == prefix


def test_small_helpers() -> None:
    assert peak(np.array([1.0, -3.0, np.nan, np.inf])) == 3.0
    assert peak(np.array([np.nan])) == 0.0
    assert rms(np.array([3.0, 4.0])) == pytest.approx(np.sqrt(12.5))
    assert np.isnan(rms(np.array([1.0, np.nan])))
    assert len(range(1501)[every(1501, 45)]) in range(40, 46)
    assert len(range(3)[every(3, 45)]) == 3


def test_file_stems_are_stable_distinct_and_portable() -> None:
    names = ["moves 1", "moves/1", "Moves_1", "../x", "", "ä"]
    stems = file_stems(names)
    assert stems == file_stems(names)
    assert len({stem.lower() for stem in stems}) == len(names)
    assert all(stem and "/" not in stem and " " not in stem and not stem.startswith(".") for stem in stems)


def test_atomic_write_leaves_the_old_file_when_it_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_atomic(tmp_path / "deep" / "a.txt", b"old")

    def refuse(*_: object) -> None:
        raise OSError("no space")

    monkeypatch.setattr("os.replace", refuse)
    with pytest.raises(OSError, match="no space"):
        write_atomic(path, b"new")
    assert path.read_bytes() == b"old" and list(path.parent.iterdir()) == [path]
