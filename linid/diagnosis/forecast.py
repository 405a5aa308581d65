"""What gap a new recording will show: prediction intervals from the scatter between the recordings at hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.gap import Trace
from linid.diagnosis.report_data import MEASURES, Change, RecordingChange

_LEAST = 3  # recordings of a kind
PIECES = 20  # per recording, each long against what correlates


def prediction_interval(values: Sequence[float]) -> tuple[float, float]:
    """95 % interval for one more draw of a log-normal quantity, nan with fewer than three positive values.

    Student's t with the variance of the new draw added (Whitmore 1986, Am. Stat. 40, 141).
    """
    from scipy.special import stdtrit

    logs = np.log([x for x in values if math.isfinite(x) and x > 0.0])
    n = logs.size
    if n < _LEAST:
        return math.nan, math.nan
    half = float(stdtrit(n - 1, 0.975)) * float(np.std(logs, ddof=1)) * math.sqrt(1.0 + 1.0 / n)
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


def together(changes: Sequence[RecordingChange], traces: Sequence[Trace], seed: int) -> dict[str, Change]:
    """The measures over all held-out recordings: RMS over them, after with its 95 % interval over such recordings.

    traces: of the model after, in the order of the changes. The interval resamples recordings, for what varies from
    one to the next; of fewer than three, pieces of them (free runs have none then: their errors hang together).
    """
    held = [(c, trace) for c, trace in zip(changes, traces, strict=True) if c.split == "held_out"]
    generator = np.random.default_rng(seed)
    out = {}
    for measure in MEASURES:
        rows = np.array([[getattr(c.changes[measure], k) for k in ("before", "after", "floor")] for c, _ in held])
        rows = np.nan_to_num(rows, nan=1e3)
        before, after, floor = np.sqrt(np.mean(rows**2, axis=0)).tolist()
        pieces = rows[:, 1] ** 2 if len(held) >= _LEAST else _pieces(measure, [trace for _, trace in held])
        low = high = math.nan
        if pieces.size:
            picks = generator.integers(0, pieces.size, (2000, pieces.size))
            low, high = np.quantile(np.sqrt(np.mean(pieces[picks], axis=1)), [0.025, 0.975]).tolist()
        out[measure] = Change(before, after, floor, low, high)
    return out


def _pieces(measure: str, traces: Sequence[Trace]) -> NDArray[np.float64]:
    """Mean square errors of consecutive pieces of the recordings, none where they hang together."""
    errors = []
    for trace in traces:
        if measure == "force":
            errors.append(trace.force_residual)
        elif measure == "ahead" and trace.ahead is not None:
            errors.append(trace.ahead.end_error)
        else:
            return np.zeros(0)
    return np.array([np.mean(piece**2) for error in errors for piece in np.array_split(error, PIECES) if piece.size])
