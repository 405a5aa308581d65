"""Digit grouping and channels that look like others: refused with both readings, never guessed."""

from __future__ import annotations

import re
import time
from pathlib import Path

import numpy as np
import pytest

from linid.errors import DataError
from linid.recording import ChannelMapping, read_recording

from .expectations import error_of
from .exports import T, Y, write

ROWS = range(100)


@pytest.mark.parametrize(
    ("separator", "number", "mark"),
    [("\t", "{0},{1:03d}", ","), (";", "{0}.{1:03d}", "."), (",", '"{0},{1:03d}"', ",")],
    ids=["tab", "semicolon", "quoted"],
)
def test_grouping_without_proof_is_refused_with_both_readings(
    tmp_path: Path, separator: str, number: str, mark: str
) -> None:
    """Every value between 1 000 and 999 999: a factor of 1000 that nothing in the file tells."""
    text = [separator.join(["Time (ms)", "Position (um)"])]
    text += [separator.join([str(k), number.format(250 + k, 7 * k)]) for k in ROWS]
    path = write(tmp_path, text)
    error_of(path, f"250{mark}000", "250.000 or 250000", f"decimal: '{mark}'", "line 2")
    given = ChannelMapping.model_validate({"decimal": mark})
    np.testing.assert_allclose(read_recording(path, channels=given).y, [(250 + 1.007 * k) * 1e-6 for k in ROWS])


@pytest.mark.parametrize("proof", ["0,500", "312,5", "1234,500", "1500"])
def test_one_number_that_proves_the_decimal_mark_is_enough(tmp_path: Path, proof: str) -> None:
    text = ["Time (ms)\tPosition (um)\tIq (A)", *(f"{k}\t{250 + k},{7 * k:03d}\t1" for k in ROWS)]
    text[61] = text[61][:-1] + proof
    recording = read_recording(write(tmp_path, text))
    assert recording.y[60] == pytest.approx(310.42e-6)
    assert recording.drive_input is not None
    assert recording.drive_input[60] == pytest.approx(float(proof.replace(",", ".")))


def test_commas_between_fields_leave_the_point_to_decimals(tmp_path: Path) -> None:
    text = ["Time (ms),Position (mm)", *(f"{k},{250 + k}.{7 * k:03d}" for k in ROWS)]
    assert read_recording(write(tmp_path, text)).y[1] == pytest.approx(0.251007)


@pytest.mark.parametrize(
    "name",
    ["Electrical Angle (deg)", "Commutation Angle (deg)", "Position Controller Output (mm)", "Elec. position (rad)"],
)
def test_a_position_of_something_else_asks_for_the_mapping(tmp_path: Path, name: str) -> None:
    text = [f"Time (ms),{name},Iq (A)", *(f"{k},{y:.6f},0.1" for k, y in enumerate(Y))]
    error_of(write(tmp_path, text), "no position column recognised", "something else", "mapping")


def test_the_axis_position_is_found_beside_the_electrical_angle(tmp_path: Path) -> None:
    text = [
        "Time (ms),Electrical Angle (deg),Position (mm)",
        *(f"{k},{k % 360},{1e3 * y:.6f}" for k, y in enumerate(Y)),
    ]
    np.testing.assert_allclose(read_recording(write(tmp_path, text)).y, Y, atol=1e-9)


def test_channels_of_two_axes_are_not_paired(tmp_path: Path) -> None:
    text = ["Time (ms),Axis1.ActPos (mm),Axis2.Iq (A)", *(f"{k},{1e3 * y:.6f},0.1" for k, y in enumerate(Y))]
    path = write(tmp_path, text)
    error_of(path, "two axes", "Axis1.ActPos", "Axis2.Iq", "mapping")
    both = ChannelMapping.model_validate({"position": "Axis1.ActPos", "current_q": "Axis2.Iq"})
    assert read_recording(path, channels=both).drive_input is not None
    text[0] = text[0].replace("Axis2", "Axis1")
    np.testing.assert_allclose(read_recording(write(tmp_path, text)).y, Y, atol=1e-9)


def test_in_and_min_end_names_and_are_no_units(tmp_path: Path) -> None:
    for ending, said in (("in", "no unit declared"), ("min", "no position column")):  # an input, a minimum
        text = [f"time_s,pos_{ending}", *(f"{t:.4f},{y:.6f}" for t, y in zip(T, Y, strict=True))]
        error_of(write(tmp_path, text), said)


def test_rms_and_peak_amperes(tmp_path: Path) -> None:
    for unit, factor in (("Arms", np.sqrt(2.0)), ("A rms", np.sqrt(2.0)), ("Apk", 1.0), ("mArms", 1e-3 * np.sqrt(2.0))):
        text = [f"Time (ms),Position (mm),Iq ({unit})", *(f"{k},{1e3 * y:.6f},2.5" for k, y in enumerate(Y))]
        drive = read_recording(write(tmp_path, text)).drive_input
        assert drive is not None and drive[7] == pytest.approx(2.5 * factor)


def test_absurd_numbers_are_unreadable_cells(tmp_path: Path) -> None:
    """1e308 beside a blank cell once ended in the spline, currents of 1e300 in an overflow."""
    text = ["Time (ms),Position (mm),Iq (A)", *(f"{k},{1e3 * y:.6f},0.1" for k, y in enumerate(Y))]
    text[50], text[52] = "49,1e308,0.1", "51,,0.1"
    recording = read_recording(write(tmp_path, text))
    assert recording.y[49] == pytest.approx(Y[49], abs=1e-6) and np.isfinite(recording.y).all()
    text = ["Time (ms),Position (mm),Iq (A)", *(f"{k},{1e3 * y:.6f},1e300" for k, y in enumerate(Y))]
    error_of(write(tmp_path, text), "1e300", "unreadable")


GOOD = ["Time (ms),Position (mm)", *(f"{k},1" for k in range(60))]
FOURS = ";".join(["1234"] * 14)
HOSTILE = {
    "a blank cell among integers": ["t;" + ";".join("abcdefghijklm"), *[FOURS] * 50, FOURS.replace("1234", "", 1)],
    "runs of tabs": ["Time (ms)\tPosition (mm)", *["1" + "\t" * 16 + "2"] * 200, *["\t" * 5000] * 40],
    "a long cell": [*GOOD, "1" * 400_000 + "x,2", "1e" * 200_000 + ",2"],
    "grouped forever": ["Time (ms);Position (mm)", *[f"{k};1" for k in range(60)], "1" + ".000" * 100_000 + "x;2"],
    "a long header": ["Time (ms) " + "a (" * 100_000 + "," + "b / " * 100_000, *GOOD[1:]],
    "quotes": [GOOD[0], *['"' * 3000 + ",1"] * 60],
    "brackets": ["[" * 200_000, *GOOD],
    "blanks": ["Time (ms) Position (mm)", *["1" + " " * 4000 + "2 "] * 60, "1" + " " * 400_000 + "x"],
    "digits": ["9" * 500_000],
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_rows_take_linear_time(tmp_path: Path, name: str) -> None:
    """Each below 1 MB, read or refused at once; twice the content takes no more than about twice the time."""
    path = write(tmp_path, HOSTILE[name])
    start = time.process_time()
    try:
        read_recording(path)
    except DataError as error:
        assert re.search(r"scope\.csv", error.place)
    assert time.process_time() - start < 5.0
