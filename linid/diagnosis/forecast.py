"""What gap a new recording will show: prediction intervals from the scatter between the recordings at hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from linid.diagnosis.report_data import MEASURES, Change, RecordingChange

_LEAST = 3  # recordings of a kind


def prediction_interval(values: Sequence[float]) -> tuple[float, float]:
    """95 % interval for one more draw of a log-normal quantity, nan with fewer than three positive values.

    Student's t with the variance of the new draw added (Whitmore 1986, Am. Stat. 40, 141).
    """
    from scipy.stats import t as student

    logs = np.log([x for x in values if math.isfinite(x) and x > 0.0])
    n = logs.size
    if n < _LEAST:
        return math.nan, math.nan
    half = float(student.ppf(0.975, n - 1)) * float(np.std(logs, ddof=1)) * math.sqrt(1.0 + 1.0 / n)
    middle = float(np.mean(logs))
    return math.exp(middle - half), math.exp(middle + half)


def with_forecasts(changes: Sequence[RecordingChange]) -> tuple[RecordingChange, ...]:
    """The changes, each measure with the interval in which a new recording of the same kind will fall."""
    intervals = {
        (kind, measure): prediction_interval([c.changes[measure].after for c in changes if c.kind == kind])
        for kind in {c.kind for c in changes}
        for measure in MEASURES
    }
    out = []
    for change in changes:
        measures = {}
        for name, one in change.changes.items():
            low, high = intervals[change.kind, name]
            measures[name] = replace(one, low=low, high=high)
        out.append(replace(change, changes=measures))
    return tuple(out)


def together(changes: Sequence[RecordingChange], seed: int) -> dict[str, Change]:
    """The measures over all held-out recordings: RMS over them, after with its 95 % interval over such recordings.

    The interval resamples recordings, for what varies from one to the next.
    """
    held = [c for c in changes if c.split == "held_out"]
    generator = np.random.default_rng(seed)
    picks = generator.integers(0, len(held), (2000, len(held)))
    out = {}
    for measure in MEASURES:
        rows = np.array([[getattr(c.changes[measure], k) for k in ("before", "after", "floor")] for c in held])
        rows = np.nan_to_num(rows, nan=1e3)
        before, after, floor = np.sqrt(np.mean(rows**2, axis=0)).tolist()
        drawn = np.sqrt(np.mean(rows[picks, 1] ** 2, axis=1))
        low, high = np.quantile(drawn, [0.025, 0.975]).tolist()
        out[measure] = Change(before, after, floor, low, high)
    return out
