"""Time stamps written as clock times or dates: 15:07:48.123, 2026-11-23T15:07:48.123, 23.11.2026 15:07:48,123."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from linid.arrays import Array

_CLOCK = r"\d{1,2}:\d{2}:\d{2}(?:[.,]\d{1,9}\d*)?"
_ISO = r"\d{4}[-/]\d{2}[-/]\d{2}"
_DOTTED = r"\d{1,2}\.\d{1,2}\.\d{4}"
STAMP = re.compile(rf"(?:(?:{_ISO}[T ]|{_DOTTED}[ T]){_CLOCK}(?:Z|[+-]\d{{2}}:?\d{{2}})?|{_CLOCK})")
_LONGEST = 60  # characters: the pattern need not try longer cells


def is_stamp(cell: str) -> bool:
    """Whether a cell is a clock time to the second at least, with or without a date whose order is beyond doubt."""
    return len(cell) <= _LONGEST and bool(STAMP.fullmatch(cell))


class StampClock:
    """Stamps of one column in s since midnight of the first one's day, the pieces of a file in order."""

    def __init__(self) -> None:
        self._origin: int | None = None  # ns of that midnight

    def seconds(self, cells: Sequence[str]) -> Array:
        """(n,) s, nan where a cell is no stamp of the first one's kind."""
        import pandas as pd

        text = pd.Series(cells, dtype=object).fillna("").astype(str).str.strip()
        known = text.map(is_stamp).to_numpy()
        out = np.full(len(text), np.nan)
        if not known.any():
            return out
        text = text[known].str.replace(",", ".", regex=False)
        if re.match(_DOTTED, text.iloc[0]):
            parts = text.str.extract(r"(\d+)\.(\d+)\.(\d{4})[ T](.*)")
            text = parts[2] + "-" + parts[1].str.zfill(2) + "-" + parts[0].str.zfill(2) + "T" + parts[3]
        text = text.str.replace("/", "-", regex=False)
        if "-" in text.iloc[0][1:]:
            dates = pd.to_datetime(text, format="ISO8601", utc=True, errors="coerce")
            good, ticks = dates.notna().to_numpy(), dates.astype("datetime64[ns, UTC]").astype("int64").to_numpy()
        else:
            times = pd.Series(pd.to_timedelta(text, errors="coerce"))
            good, ticks = times.notna().to_numpy(), times.astype("timedelta64[ns]").astype("int64").to_numpy()
        if self._origin is None and good.any():
            self._origin = int(ticks[good][0]) // 86_400_000_000_000 * 86_400_000_000_000
        out[np.flatnonzero(known)[good]] = (ticks[good] - (self._origin or 0)) * 1e-9
        return out
