"""Screening: how much of the base model's residual each effect could explain, by regression along the motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.alone import PER_RECORDING, Alone, best_disturbance, best_payload
from linid.diagnosis.confirm import Fitted
from linid.diagnosis.side_by_side import Workers
from linid.identification.effect_guess import EffectColumns, Regression, Trial, amplitude_sizes, best_trial
from linid.identification.outlook import look_out
from linid.physics.effects.registry import EFFECTS
from linid.recording.recording import Recording


@dataclass(frozen=True)
class Screened:
    """An effect with the entry of its grid that explains most."""

    name: str
    trial: Trial


def to_fit(recordings: Sequence[Recording], effects: Iterable[str]) -> tuple[Recording, ...]:
    """The fitted recordings; all, for effects that live in single recordings and may show in held-out ones only."""
    if any(name in PER_RECORDING for name in effects):
        return tuple(recordings)
    return tuple(r for r in recordings if r.split == "fit")


class Screening:
    """All effects of the library tried on a campaign, at each step of the selection.

    base: the model without effects, whose outlook and effect columns all steps share; recordings: both splits. Effects
    that live in single recordings are tried on all, the others on the fitted ones; known: SI values that are given;
    workers: who fits the candidates (None: threads here).
    """

    def __init__(
        self, base: Fitted, recordings: Sequence[Recording], known: dict[str, float], jobs: int,
        workers: Workers | None = None,
    ) -> None:  # fmt: skip
        self.recordings = tuple(recordings)
        self.known = known
        self.jobs = jobs
        self.workers = workers
        self.fitted = [k for k, r in enumerate(recordings) if r.split == "fit"]
        chosen = self.to_fit(())
        self.columns = EffectColumns(base.model.kind, base.values, chosen, jobs)
        self.outlook = look_out(base.model, chosen, base.values)
        self.whole = look_out(base.model, recordings, base.values)

    def to_fit(self, effects: Iterable[str]) -> tuple[Recording, ...]:
        """The recordings to which a model with these effects is fitted."""
        return to_fit(self.recordings, effects)

    def screen(
        self, step: Fitted, scales: NDArray[np.float64], noise: NDArray[np.float64],
        watch: Callable[[int, int], None] | None = None, *, only: Sequence[str] = (),
    ) -> tuple[Screened, ...]:  # fmt: skip
        """All effects that make sense here and are not in `step` yet, those that explain most of its residual first.

        scales: (R,) m/s^2 in which the recordings' residuals are counted; noise: (R,) m/s^2; only: names of effects
        (empty: all).
        """
        jobs, whole = self.jobs, self.whole
        regression = Regression(
            step.space, step.genes, self.columns.recordings, jobs, scales[self.fitted], self.columns
        )
        everywhere = Regression(step.space, step.genes, self.recordings, jobs, scales)
        alone = Alone(everywhere, jobs)
        out = []
        for number, effect in enumerate(EFFECTS, 1):
            outlook = whole if effect.name in PER_RECORDING else self.outlook
            wanted = effect.name in only if only else effect.name not in step.model.effects
            if wanted and effect.applies(step.model.kind, outlook):
                if effect.name == "external_disturbance":
                    size = amplitude_sizes(everywhere, effect, whole)["disturbance_force_1"]
                    trial = best_disturbance(alone, effect.grid(whole), size, (scales / noise) ** 2)
                elif effect.name == "payload_change":
                    trial = best_payload(alone, amplitude_sizes(everywhere, effect, whole)["payload_mass"])
                else:
                    sizes = amplitude_sizes(regression, effect, outlook)
                    trial = best_trial(regression, effect, outlook, self.known, sizes)
                out.append(Screened(effect.name, trial))
            if watch is not None:
                watch(number, len(EFFECTS))
        return tuple(sorted(out, key=lambda s: -s.trial.explained))
