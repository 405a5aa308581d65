"""Short files of nothing but numbers need no pandas, and come out as pandas reads them, to the last bit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import linid.recording.body as body
from linid.recording.dialect import Dialect

CELLS = "0123456789.,eE+- "
ROOT = Path(__file__).resolve().parents[2]


def both(text: str, separator: str, decimal: str, fields: int) -> list[dict[int, np.ndarray] | None]:
    """What numpy alone makes of a text, and what comes of it without that way."""
    dialect, rows = Dialect(separator, decimal, fields, 0, (True,) * fields), text.count("\n") + 1
    plain = body._plain(text, rows, dialect)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(body, "_plain", lambda *arguments: None)
        return [plain, body._fast(text, rows, dialect, False, {})]


def equal(a: dict[int, np.ndarray] | None, b: dict[int, np.ndarray] | None) -> bool:
    """Bit for bit."""
    return (
        a is not None
        and b is not None
        and {k: x.tobytes() for k, x in a.items()} == {k: x.tobytes() for k, x in b.items()}
    )


@given(
    st.lists(st.tuples(*3 * [st.floats(allow_nan=False, allow_infinity=False)]), min_size=1, max_size=8),
    st.sampled_from([(";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", "."), (" ", "."), (" ", ",")]),
    st.sampled_from(["{!r}", "{:.4f}", "{:+.17e}", " {:.9g}"]),
)
@settings(deadline=None)
def test_numbers_are_those_of_pandas(rows: list[tuple[float, ...]], marks: tuple[str, str], style: str) -> None:
    separator, decimal = marks
    text = "\n".join(separator.join(style.format(x).replace(".", decimal) for x in row) for row in rows)
    plain, pandas = both(text, separator, decimal, 3)
    assert equal(plain, pandas) or (plain is None and pandas is None)
    assert plain is not None or any(abs(x) > body.LARGEST for row in rows for x in row)


@given(st.text(CELLS, max_size=12), st.text(CELLS, max_size=12), st.sampled_from([(";", "."), (";", ","), (",", ".")]))
@settings(deadline=None, max_examples=400)
def test_what_numpy_takes_pandas_takes_alike(one: str, other: str, marks: tuple[str, str]) -> None:
    """Never a number where pandas sees none."""
    separator, decimal = marks
    plain, pandas = both(f"1{separator}2\n{one}{separator}{other}", separator, decimal, 2)
    assert plain is None or equal(plain, pandas)


@pytest.mark.parametrize(
    "text", ["1;2\n3", "1;2\n\n3;4", "1;2\n;4", "1;nan", "1;1e999", "1;2;3", '"1";2', "1;\u0661", "1;2 3"]
)
def test_anything_unusual_is_left_to_others(text: str) -> None:
    plain, pandas = both(text, ";", ".", 2)
    assert plain is None and (pandas is None or text in ("1;2\n;4", '"1";2'))


def test_a_recording_is_read_without_pandas() -> None:
    path = ROOT / "data" / "stand" / "moves_1.csv"
    code = f"import sys, linid; linid.read({str(path)!r}); print('pandas' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "False"
