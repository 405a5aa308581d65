"""Whether an effect helps to predict: what motions do 0.1 s ahead is a witness that no fit of a diagnosis has heard."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from linid.arrays import Array
from linid.diagnosis.held_out_tests import SURE, Part
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.identification.objectives.ahead import Ahead
from linid.identification.optimise.time_step import choose_substeps
from linid.physics.effects.registry import find_effect
from linid.recording.recording import Recording

RISEN = 1.1  # of an error 0.1 s ahead: some sixty windows of a recording tell its RMS to about a tenth
_LOST = 1e3  # error in m (rotary: rad) of a prediction that diverges


def ahead_gain(judge: Judge, without: Fitted, full: Fitted, name: str) -> float:
    """How far an effect of a model lessens the log power of errors 0.1 s ahead, per recording that can tell.

    The balance of forces, by which effects are chosen and judged, counts a force at rows where the axis hardly moves as
    much as any other; a prediction counts what it does to the motion. Each recording has one voice: in a single one, a
    stop some samples too soon may outweigh all others. without: the model fitted again without the effect.
    """
    recordings = telling(judge.balance.recordings, full, name)
    substeps, jobs = choose_substeps(full.model, recordings, full.values), judge.balance.jobs
    before, after = (_powers(one, recordings, substeps, jobs) for one in (without, full))
    return float(np.mean(np.log(before / after)))


def idle(judge: Judge, full: Fitted, parts: Sequence[Part]) -> list[Part]:
    """The effects of a model that the prediction 0.1 s ahead speaks against."""
    return [p for p in parts if speaks_against(ahead_gain(judge, p.without, full, p.name), p.evidence.certainty)]


def speaks_against(gain: float, certainty: float) -> bool:
    """Whether the prediction says that an effect is none. gain: of the log power of its errors; certainty: of the
    gain in the balance of forces, in deviations.

    What is beyond doubt there may be one that moves nothing within 0.1 s, as a load that swings faster: only errors
    that clearly rise refute it. Anything else must help.
    """
    return gain < -2.0 * math.log(RISEN) if certainty >= SURE else gain <= 0.0


def telling(recordings: Sequence[Recording], full: Fitted, name: str) -> tuple[Recording, ...]:
    """The held-out recordings in which an effect of a model acts, or all in which it does where that is in none."""
    values = {**full.values, **full.preset}
    effect = find_effect(name)
    acting = tuple(r for r in recordings if not effect.per_recording or effect.acts_in(values, r.number))
    return tuple(r for r in acting if r.split == "held_out") or acting


def _powers(one: Fitted, recordings: Sequence[Recording], substeps: int, jobs: int) -> Array:
    """Mean squares (R,) m^2 of a model's errors 0.1 s ahead, by recording; rotary: rad^2.

    All models start from the states along the motion: those with hidden states of their own would else have to tell
    them from the samples before, and so know less of where they start than one without.
    """
    part = Ahead(one.model, tuple(recordings), substeps, jobs, project=False, skip_jumps=False, guided=False)
    windows = part.segments
    errors = (part.simulate_along(one.vector[None, :])[0] - part.measured)[windows.out_offsets[1:] - 1]
    squares = np.minimum(np.nan_to_num(errors, nan=_LOST, posinf=_LOST, neginf=-_LOST) ** 2, _LOST**2)
    return np.asarray(np.bincount(windows.recording, squares) / np.bincount(windows.recording))
