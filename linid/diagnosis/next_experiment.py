"""The recording to make next: of all feasible ones, that which would change the evidence most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.diagnosis.experiments import Experiment
from linid.diagnosis.joint import Fitted
from linid.identification.objectives.acceleration import Acceleration
from linid.parallel_tasks import in_parallel
from linid.physics.effects.registry import find_effect
from linid.recording.recording import Recording

_STRIDE = 5
_COORDINATE_STEP = 1e-4
_SHARE = 0.1  # of an amplitude, by which it is changed to see how well a recording would tell it


@dataclass(frozen=True)
class Prospect:
    """What a recording would tell. words: what to record; difference: RMS in m/s^2 by which two models differ there;
    evidence: chi squared per second that it adds for telling them apart once all parameters have been fitted again;
    gain: evidence that its whole length adds over that of the recordings at hand."""

    words: str
    difference: float
    evidence: float
    gain: float


class _Rows:
    """Acceleration of some recordings under a model, thinned, in units of their noise."""

    def __init__(self, recordings: Sequence[Recording], scales: Array) -> None:
        self.recordings = tuple(recordings)
        self.scales = scales

    def of(self, model: Fitted, vectors: Array, half_widths: tuple[int, ...] = ()) -> tuple[Array, tuple[int, ...]]:
        """(C, n) accelerations over the noise, and the half-widths used."""
        part = Acceleration(model.model, self.recordings, 1, stride=_STRIDE, half_widths=half_widths)
        rows = np.nan_to_num(part.model_acceleration(vectors))
        return rows / self.scales[part.classes], part.half_widths


def prospects(
    best: Fitted,
    rival: Fitted | None,
    at_hand: Sequence[Recording],
    scales: Array,
    feasible: Sequence[Experiment],
    jobs: int = 1,
) -> tuple[Prospect, ...]:
    """What each feasible recording would add, the best per second first.

    best: the fitted model; rival: a model that explains as much (None: how well the amplitudes of the last effect of
    `best` are told); at_hand: recordings fitted so far with their noise scales (R,) m/s^2; jobs: threads.
    """
    noise = float(np.median(scales))
    existing = _Rows(at_hand, scales)
    before, columns = _difference(best, rival, existing)
    alone = _left(before, columns)

    def prospect(experiment: Experiment, _: int) -> Prospect:
        new = _Rows((experiment.recording,), np.array([noise]))
        change, more = _difference(best, rival, new)
        gain = _left(np.concatenate([before, change]), np.vstack([columns, more])) - alone
        seconds = max(experiment.recording.duration, 1e-9)
        rms = noise * float(np.sqrt(np.mean(change**2)))
        return Prospect(experiment.words, rms, gain / seconds, gain / max(alone, 1e-300))

    found = [one for _, one in in_parallel(prospect, feasible, jobs)]
    return tuple(sorted(found, key=lambda p: -p.evidence))


def _difference(best: Fitted, rival: Fitted | None, rows: _Rows) -> tuple[Array, Array]:
    """Difference of two models (n,) and the columns (n, p) by which the first could make up for it."""
    space, point = best.space(rows.recordings)
    p = point.size
    steps = np.where(point + _COORDINATE_STEP > 1.0, -_COORDINATE_STEP, _COORDINATE_STEP)
    vectors = space.vectors(np.vstack([point, point + np.diag(steps)]))
    values, half_widths = rows.of(best, vectors)
    columns = ((values[1 : 1 + p] - values[0]) / steps[:, None]).T
    if rival is not None:
        return rows.of(rival, rival.vector[None, :], half_widths)[0][0] - values[0], columns
    amplitudes = set(find_effect(best.model.effects[-1]).amplitudes)
    moved = best.vector.copy()
    for name in amplitudes & set(best.values):
        moved[best.model.slot(name)] *= 1.0 + _SHARE
    kept = [k for k, name in enumerate(space.names) if name not in amplitudes]
    return rows.of(best, moved[None, :], half_widths)[0][0] - values[0], columns[:, kept]


def _left(difference: Array, columns: Array) -> float:
    """Chi squared (per sample that counts) of a difference that the columns cannot make up for."""
    lengths = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    basis, sizes, _ = np.linalg.svd(columns / lengths, full_matrices=False)
    basis = basis[:, sizes > 1e-8 * sizes[0]]
    rest = difference - basis @ (basis.T @ difference)
    return float(rest @ rest)
