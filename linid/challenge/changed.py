"""An axis as it was commissioned and later, when some of its parameters have changed or an effect has come."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from linid.challenge.hidden_axis import AxisKind, HiddenAxis
from linid.challenge.make import HiddenCampaign, Plan, make_campaign, recorded
from linid.errors import UsageError

# Factor of a change, or its inverse, drawn log-uniformly.
FACTORS: dict[str, tuple[float, float]] = {
    "coulomb_force": (1.1, 1.6),
    "force_constant": (1.04, 1.25),
    "viscous_friction": (1.4, 3.0),
    "mass": (1.04, 1.3),
}
# Of ten campaigns: how many parameters change, or what else comes.
SCENARIOS = ("one", "one", "one", "one", "two", "two", "effect", "effect", "nothing", "nothing")
EFFECTS = (
    "cogging",
    "cable_force",
    "constant_force",
    "asymmetric_friction",
    "position_dependent_friction",
    "end_effect",
)
_STRENGTH = (0.1, 1.0)
_ATTEMPTS = 10


@dataclass(frozen=True)
class ChangedAxis:
    """The recordings of an axis as commissioned and of later; factors: by which its parameters have changed since."""

    scenario: str
    commissioned: HiddenCampaign
    later: HiddenCampaign
    factors: dict[str, float]

    @property
    def causes(self) -> tuple[str, ...]:
        """What has come since: changed parameters and effects, by name."""
        return (*self.factors, *(effect.name for effect in self.later.effects))


def make_changed(seed: int, index: int, axes: tuple[AxisKind, ...] = ("phase",)) -> ChangedAxis:
    """Axis number `index` (from 0) of a seed, recorded twice; axes: the kinds to draw from. Raises UsageError where no
    change will do."""
    commissioned = make_campaign(Plan(seed, kinds=("none",), axes=axes), index)
    block = np.random.default_rng([seed, 11, index // len(SCENARIOS)]).permutation(len(SCENARIOS))
    scenario = SCENARIOS[block[index % len(SCENARIOS)]]
    for attempt in range(_ATTEMPTS):
        random = np.random.default_rng([seed, 12, index, attempt])
        factors = _factors(random, {"one": 1, "two": 2}.get(scenario, 0))
        names = (str(random.choice(EFFECTS)),) if scenario == "effect" else ()
        wanted = tuple(_log_uniform(random, *_STRENGTH) for _ in names)
        axis = changed(commissioned.description, factors)
        later = recorded(axis, "single" if names else "none", names, wanted, random, several=False)
        if later is not None:
            return ChangedAxis(scenario, commissioned, later, factors)
    raise UsageError(f"axis {index + 1} of seed {seed}", "does not move once it has changed", "Take another seed.")


def changed(axis: HiddenAxis, factors: dict[str, float]) -> HiddenAxis:
    """The axis with some parameters times a factor; breakaway goes with Coulomb friction."""
    factor = {name: factors.get(name, 1.0) for name in FACTORS}
    friction = axis.friction.model_copy(
        update={
            "coulomb_force_n": axis.friction.coulomb_force_n * factor["coulomb_force"],
            "static_force_n": axis.friction.static_force_n * factor["coulomb_force"],
            "viscous_friction_n_s_per_m": axis.friction.viscous_friction_n_s_per_m * factor["viscous_friction"],
        }
    )
    constant = axis.motor.force_constant_n_per_a * factor["force_constant"]
    motor = axis.motor.model_copy(update={"force_constant_n_per_a": constant})
    return axis.model_copy(update={"friction": friction, "motor": motor, "mass_kg": axis.mass_kg * factor["mass"]})


def _factors(random: np.random.Generator, count: int) -> dict[str, float]:
    """So many parameters with the factors by which they change."""
    out = {}
    for name in map(str, random.choice(list(FACTORS), count, replace=False)):
        factor = _log_uniform(random, *FACTORS[name])
        out[name] = factor if random.random() < 0.5 else 1.0 / factor
    return out


def _log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    return math.exp(float(random.uniform(math.log(low), math.log(high))))
