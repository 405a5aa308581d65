"""Screening: how much of the base model's residual each effect could explain, by regression along the motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.alone import PER_RECORDING, Alone, best_disturbance, best_payload
from linid.diagnosis.confirm import Fitted
from linid.identification.effect_guess import Regression, Trial, amplitude_sizes, best_trial
from linid.identification.outlook import look_out
from linid.physics.effects.registry import EFFECTS
from linid.recording.recording import Recording


@dataclass(frozen=True)
class Screened:
    """An effect with the entry of its grid that explains most."""

    name: str
    trial: Trial


def screen(
    base: Fitted,
    recordings: Sequence[Recording],
    scales: NDArray[np.float64],
    known: dict[str, float],
    jobs: int,
    *,
    watch: Callable[[int, int], None] | None = None,
) -> tuple[Screened, ...]:
    """All effects that make sense here and are not in the base yet, those that explain most first.

    recordings: both splits. Effects that live in single recordings are tried on all, the others on the fitted ones.
    scales: (R,) m/s^2 in which their residuals are counted; known: SI values that are given.
    """
    fitted = [k for k, r in enumerate(recordings) if r.split == "fit"]
    regression = Regression(base.space, base.genes, [recordings[k] for k in fitted], jobs, scales[fitted])
    outlook = look_out(base.model, regression.recordings, base.values)
    everywhere = Regression(base.space, base.genes, recordings, jobs, scales)
    alone = Alone(everywhere, jobs)
    whole = look_out(base.model, recordings, base.values)
    out = []
    for number, effect in enumerate(EFFECTS, 1):
        single = effect.name in PER_RECORDING
        if effect.name not in base.model.effects and effect.applies(base.model.kind, whole if single else outlook):
            if effect.name == "external_disturbance":
                size = amplitude_sizes(everywhere, effect, whole)["disturbance_force"]
                trial = best_disturbance(alone, effect.grid(whole), size)
            elif effect.name == "payload_change":
                trial = best_payload(alone, amplitude_sizes(everywhere, effect, whole)["payload_mass"])
            else:
                trial = best_trial(regression, effect, outlook, known, amplitude_sizes(regression, effect, outlook))
            out.append(Screened(effect.name, trial))
        if watch is not None:
            watch(number, len(EFFECTS))
    return tuple(sorted(out, key=lambda s: -s.trial.explained))
