"""Random recordings written in random dialects come back with every printed digit."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.recording import read_recording

STYLES = ("{n} ({u})", "{n} [{u}]", "{n} / {u}", "{n}{{{u}}}")
SCALES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "m": 1.0, "mm": 1e-3, "um": 1e-6, "A": 1.0, "mA": 1e-3}
SCALES |= {"V": 1.0, "mV": 1e-3, "kV": 1e3}
NAMES = ["Time", "Actual Position", "Phase Current U", "Phase Current V", "Phase Current W"]
VOLTAGES = ["Phase U Voltage", "Phase V Voltage", "Phase W Voltage"]
ALPHABET = "0123456789.,;\t\n -eE\"'naifTime()mPosA#_"
NOISE_LINES = ["Recorded on bench 2", "Operator: M. Moore", "Export 2024-05-06 07:08:09", ""]


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(20, 120),
    dialect=st.sampled_from([(";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", ".")]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "cp1252", "utf-16"]),
    newline=st.sampled_from(["\n", "\r\n", "\r"]),
    style=st.sampled_from(STYLES),
    units=st.tuples(
        st.sampled_from(["s", "ms", "us"]), st.sampled_from(["m", "mm", "um"]), st.sampled_from(["A", "mA"])
    ),
    volt=st.sampled_from([None, "V", "mV", "kV"]),
    decimals=st.integers(3, 9),
    preamble=st.lists(st.sampled_from(NOISE_LINES), max_size=3),
    two_lines=st.booleans(),
    trailing=st.booleans(),
    quoted=st.booleans(),
    end=st.sampled_from(["", "EOF", "\n\n"]),
)
@settings(max_examples=150, deadline=None)
def test_round_trip(
    seed: int,
    n: int,
    dialect: tuple[str, str],
    encoding: str,
    newline: str,
    style: str,
    units: tuple[str, str, str],
    volt: str | None,
    decimals: int,
    preamble: list[str],
    two_lines: bool,
    trailing: bool,
    quoted: bool,
    end: str,
) -> None:
    rng = np.random.default_rng(seed)
    separator, mark = dialect
    declared = [units[0], units[1], units[2], units[2], units[2]]
    step = {"s": 0.001, "ms": 1.0, "us": 1000.0}[units[0]]
    columns = [np.arange(n) * step, np.cumsum(rng.normal(1, 0.3, n)), *rng.normal(0, 3, (3, n))]
    names = list(NAMES)
    if volt is not None:
        names, declared = names + VOLTAGES, declared + [volt] * 3
        columns += [*rng.normal(0, 20, (3, n))]
    printed = [[f"{x:.{decimals}f}" for x in column] for column in columns]
    if two_lines:
        header = [separator.join(names), separator.join(f"[{u}]" for u in declared)]
    else:
        header = [separator.join(style.format(n=name, u=u) for name, u in zip(names, declared, strict=True))]

    def cell(text: str) -> str:
        text = text.replace(".", mark)
        return f'"{text}"' if quoted else text

    rows = [separator.join(map(cell, row)) + (separator if trailing else "") for row in zip(*printed, strict=True)]
    text = newline.join([*preamble, *header, *rows, *([end] if end else [])])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scope.csv"
        path.write_bytes(text.encode(encoding))
        recording = read_recording(path)
    truth = [np.array([float(x) for x in column]) * SCALES[u] for column, u in zip(printed, declared, strict=True)]
    np.testing.assert_allclose(recording.t, truth[0], rtol=1e-15, atol=1e-15)
    np.testing.assert_array_equal(recording.y, truth[1])
    np.testing.assert_array_equal(recording.phase_currents, truth[2:5])
    assert (recording.phase_voltages is None) == (volt is None)
    if volt is not None:
        np.testing.assert_array_equal(recording.phase_voltages, truth[5:])


@given(
    content=st.binary(max_size=400)
    | st.text(alphabet="0123456789.,;\t\n -eE\"'naifTime()mPosA#_", max_size=400).map(str.encode)
)
@settings(max_examples=300, deadline=None)
def test_any_content_is_read_or_refused_with_a_message(content: bytes) -> None:
    """Nothing but a LinidError ever comes out of a broken file."""
    from linid.errors import LinidError

    with tempfile.TemporaryDirectory() as folder:
        for name in ("a.csv", "a.mat"):
            path = Path(folder) / name
            path.write_bytes(content)
            try:
                recording = read_recording(path)
            except LinidError as error:
                assert str(path) in str(error)
            else:
                assert np.isfinite(recording.y).all() and (np.diff(recording.t) > 0).all()


LINES = st.lists(
    st.sampled_from(
        [
            "0,1.5,2",
            "1,1.5,2",
            "2,x,2",
            "3,,",
            "Time (ms),Position (mm),Iq (A)",
            "",
            "EOF",
            "4;5;6",
            "5,7",
            "6,1,2,3",
            "7,NaN,1",
            "[Data]",
            "Name,Position,Name,x",
            "trace_values,1,2",
            "SampleTime[ms],1,1",
            "8,1e400,2",
            '"9","1,5","2"',
            "1,2,3",
        ]
    ),
    max_size=30,
)


@given(LINES)
@settings(max_examples=300, deadline=None)
def test_shuffled_lines_are_read_or_refused(lines: list[str]) -> None:
    from linid.errors import LinidError

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.csv"
        path.write_text("\n".join(lines))
        try:
            recording = read_recording(path)
        except LinidError as error:
            assert str(path) in str(error)
        else:
            assert np.isfinite(recording.y).all() and (np.diff(recording.t) > 0).all()
