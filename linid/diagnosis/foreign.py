"""A simulation of the user's own as the base: a model that reproduces it stands for it, for nobody can see inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.diagnose import diagnose
from linid.diagnosis.means import Means
from linid.errors import UsageError
from linid.identification.result import FitResult, ModelKind
from linid.identification.signals.motion import retaken
from linid.recording.recording import Recording
from linid.simulation.functional_unit import checked_motion


@dataclass(frozen=True)
class StandIn:
    """A model that stands for a simulation of the user's own.

    free_run: error of that simulation over its held-out recordings, as a share of the motion's deviation; missed: force
    in N (rotary: N m) RMS that the model misses of it there, floor: what noise of the position alone would.
    """

    model: FitResult
    free_run: float
    missed: float
    floor: float

    def words(self) -> tuple[str, ...]:
        """What is taken for granted with it."""
        effects = ", ".join(name.replace("_", " ") for name in self.model.effects) or "no effect"
        force = f"{self.missed:.3g} {'N m' if self.model.axis == 'rotary' else 'N'} RMS (noise: {self.floor:.3g})"
        return (
            f"the given simulation misses {100.0 * self.free_run:.3g} % of the motion in its free runs",
            f"in its place stands a model with {effects}, identified from its motion, of which it misses {force}",
        )


def stand_in(
    name: str, recordings: Sequence[Recording], kind: ModelKind, known: dict[str, float], means: Means
) -> StandIn:
    """The model, with the effects that it takes, of the motion that a simulation of the user's own has.

    Its positions are read as the machine's were, with the noise of that encoder. Raises UsageError where recordings
    have no simulation, DataError for one that is not finite.
    """
    missing = [r.name for r in recordings if r.simulated is None]
    if missing:
        raise UsageError(
            ", ".join(missing),
            "has no simulated position beside the measured one",
            "Map its column (`simulated: {column: ..., unit: ...}`), or name its file (`simulated: FILE`).",
        )
    generator = np.random.default_rng(means.seed)
    own = [replace(retaken(r, _simulated(r), generator), repeat_of="") for r in recordings]
    found = diagnose(name, own, kind, known=known, means=replace(means, memory=None))
    force = found.diagnosis.measures["force"]
    return StandIn(found.after, _free_run(recordings), force.after, force.floor)


def _simulated(recording: Recording) -> Array:
    assert recording.simulated is not None
    return checked_motion(recording, recording.simulated)


def _free_run(recordings: Sequence[Recording]) -> float:
    """RMS over the held-out recordings of the simulation's error, over the deviation of each one's position."""
    held = [r for r in recordings if r.split == "held_out"] or list(recordings)
    errors = [float(np.sqrt(np.mean((_simulated(r) - r.y) ** 2)) / max(float(np.std(r.y)), 1e-300)) for r in held]
    return float(np.sqrt(np.mean(np.square(errors))))
