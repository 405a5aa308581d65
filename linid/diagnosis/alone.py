"""Effects that live in single recordings: a push in one of them, an unlogged mass in some."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from linid.identification.acceleration import Acceleration
from linid.identification.effect_guess import Regression, Trial
from linid.physics.effects.effect import Effect, Values
from linid.physics.effects.registry import EFFECTS, find_effect
from linid.physics.effects.shapes import MOST_MARKED
from linid.physics.model import Model
from linid.recording.recording import Recording

Array = NDArray[np.float64]

# The parameter that says which recordings an effect acts in.
PER_RECORDING = {effect.name: effect.mark for effect in EFFECTS if effect.per_recording}
MOST_BITS = MOST_MARKED
_CHUNK = 256
_LIKE = 0.5  # of the largest payload: what a recording must show to be counted in
_PAUSE = 0.05  # s, between a push and another one


class Alone:
    """Regression columns of one recording at a time, all others held by what the base parameters can do."""

    def __init__(self, regression: Regression, jobs: int) -> None:
        self.regression = regression
        self.jobs = jobs
        self.span = regression.span()
        self.rest = regression.rest()
        self.total = float(self.rest @ self.rest)

    def columns(self, effect: Effect, index: int, entries: Sequence[Values], amplitude: str, step: float) -> Array:
        """Weighted derivatives (n, entries) by the amplitude in recording number `index` of the regression."""
        regression = self.regression
        model = Model(regression.base.model.kind, (effect.name,))
        recording = regression.recordings[index]
        part = Acceleration(
            model, (recording,), self.jobs, stride=regression.stride, half_widths=(regression.half_widths[index],)
        )
        vectors = [model.vector(regression.values | entry | {amplitude: step}) for entry in entries]
        plain = part.model_acceleration(model.vector(regression.values)[None, :])
        weights = regression.weights[regression.classes == index]
        return np.asarray(((part.model_acceleration(np.array(vectors)) - plain) * weights / step).T)

    def scores(self, columns: Array, index: int) -> tuple[Array, Array]:
        """Moments with the residual (k,) and squared lengths (k,) of columns of one recording, base projected out."""
        mine = self.regression.classes == index
        moments = columns.T @ self.rest[mine]
        lengths = np.einsum("ij,ij->j", columns, columns) - np.sum((self.span[mine].T @ columns) ** 2, axis=0)
        return np.asarray(moments), np.asarray(np.maximum(lengths, 1e-300))


def best_disturbance(alone: Alone, grid: Sequence[Values], size: float, excess: Array) -> Trial:
    """The push that explains most, of all places and lengths in all recordings, and its lead over those elsewhere.

    excess: (R,) squared scale of the regression over the squared noise of each recording: pushes are compared by what
    they take away in units of noise, or a strong one would count no more than a faint one.
    """
    effect = find_effect("external_disturbance")
    found: list[tuple[float, float, int, Values]] = []  # taken away (in noise), force, index of recording, entry
    for index, recording in enumerate(alone.regression.recordings):
        number = float(recording.number)
        entries = [e for e in grid if e["disturbance_recording_1"] == number]
        for first in range(0, len(entries), _CHUNK):
            batch = entries[first : first + _CHUNK]
            columns = alone.columns(effect, index, batch, "disturbance_force_1", 0.02 * size)
            moments, lengths = alone.scores(columns, index)
            taken = moments**2 / lengths * float(excess[index])
            found += zip(taken.tolist(), (moments / lengths).tolist(), [index] * len(batch), batch, strict=True)
    if not found:
        return Trial({}, {}, -1.0)
    best, force, where, entry = max(found, key=lambda item: item[0])
    elsewhere = max((x for x, _, there, _ in found if there != where), default=0.0)
    # A long push of another shape than the grid's leaves something beside the best entry.
    beside = max((x for x, _, there, e in found if there == where and _apart(entry, e)), default=0.0)
    lead = best / max(elsewhere, 0.5 * beside, 1e-300)
    explained = best / float(excess[where]) / max(alone.total, 1e-300)
    return Trial(dict(entry), {"disturbance_force_1": float(np.clip(force, -size, size))}, explained, lead)


def _apart(one: Values, other: Values) -> bool:
    """Whether two pushes in the same recording leave time between them."""
    first, second = sorted((one, other), key=lambda e: e["disturbance_start_1"])
    return first["disturbance_start_1"] + first["disturbance_duration_1"] + _PAUSE < second["disturbance_start_1"]


def best_payload(alone: Alone, size: float) -> Trial:
    """The set of recordings and the mass that explain most: those that each show at least half the largest payload."""
    effect = find_effect("payload_change")
    found: list[tuple[int, float, float, Array]] = []
    for index, recording in enumerate(alone.regression.recordings):
        if not 1 <= recording.number <= MOST_BITS:
            continue
        entry = {"payload_recordings": 2.0 ** (recording.number - 1)}
        column = alone.columns(effect, index, [entry], "payload_mass", 0.02 * size)
        moments, lengths = alone.scores(column, index)
        if float(column[:, 0] @ column[:, 0]) > 0.0:
            found.append((index, float(moments[0] / lengths[0]), float(moments[0] ** 2 / lengths[0]), column[:, 0]))
    found.sort(key=lambda item: -item[2])
    best = Trial({"payload_recordings": 1.0}, {"payload_mass": 0.0}, -1.0)
    for leader in found[:3]:
        chosen = [item for item in found if item[1] / leader[1] > _LIKE]
        best = max(best, _joint(alone, [leader]), _joint(alone, chosen), key=lambda trial: trial.explained)
    mass = float(np.clip(best.amplitudes["payload_mass"], -size, size))
    return Trial(best.values, {"payload_mass": mass}, best.explained)


def _joint(alone: Alone, chosen: Sequence[tuple[int, float, float, Array]]) -> Trial:
    """One payload for several recordings."""
    column = np.zeros(alone.rest.size)
    for index, _, _, part in chosen:
        column[alone.regression.classes == index] = part
    moment = float(column @ alone.rest)
    length = max(float(column @ column) - float(np.sum((alone.span.T @ column) ** 2)), 1e-300)
    bits = float(sum(2.0 ** (alone.regression.recordings[index].number - 1) for index, *_ in chosen))
    explained = moment**2 / length / max(alone.total, 1e-300)
    return Trial({"payload_recordings": bits}, {"payload_mass": moment / length}, explained)


def acts_in(name: str, structural: Values, recording: Recording) -> bool:
    """Whether a per-recording effect acts in a recording."""
    return find_effect(name).acts_in(structural, recording.number)
