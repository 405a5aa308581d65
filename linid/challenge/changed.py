"""An axis as it was commissioned and later, when some of its parameters have changed or an effect has come."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from linid.challenge.hidden_axis import HiddenAxis
from linid.challenge.make import HiddenCampaign, Kind, Plan, make_campaign, recorded
from linid.challenge.truth import Truth
from linid.errors import UsageError

# What may change, by the name that a diagnosis has for it: the factor, or its inverse, is drawn log-uniformly.
FACTORS: dict[str, tuple[float, float]] = {
    "friction_level_change": (1.1, 1.6),
    "force_constant_change": (1.04, 1.25),
    "viscous_friction_change": (1.4, 3.0),
    "payload_change": (1.04, 1.3),
    "breakaway_change": (1.15, 1.6),
}
# rad of the field, either way, by which it stands elsewhere: less is hardly more thrust, and a quarter turn is none.
TURN = "commutation_change"
_TURNS = (0.3, 0.8)
# Windings that are uneven by less, as a share of 120 degrees, leave no ripple by which a turned field could be told
# from another force constant.
_UNEVEN = 0.01
_LEAST_BREAKAWAY = 1.02  # of the Coulomb force
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


def make_changed(plan: Plan, index: int) -> HiddenCampaign:
    """Axis number `index` (from 0) of a plan as it is later, with its recordings of the commissioning.

    Raises UsageError where no change will do.
    """
    before = make_campaign(plan, index)
    block = np.random.default_rng([plan.seed, 11, index // len(SCENARIOS)]).permutation(len(SCENARIOS))
    scenario = SCENARIOS[block[index % len(SCENARIOS)]]
    for attempt in range(_ATTEMPTS):
        random = np.random.default_rng([plan.seed, 12, index, attempt])
        factors = _factors(before.description, random, {"one": 1, "two": 2}.get(scenario, 0))
        names = (str(random.choice(EFFECTS)),) if scenario == "effect" else ()
        wanted = tuple(_log_uniform(random, *_STRENGTH) for _ in names)
        axis = changed(before.description, factors)
        kind: Kind = "unchanged" if scenario == "nothing" else "changed"
        later = recorded(axis, kind, names, wanted, random, several=False)
        if later is not None:
            # Shares of the gap to the commissioned model are not those of the gap to the axis' own base.
            untold = Truth(None, {}, 0.0)
            return replace(later, truth=untold, commissioned=before.recordings, factors=factors)
    raise UsageError(f"axis {index + 1} of seed {plan.seed}", "does not move once it has changed", "Take another seed.")


def changed(axis: HiddenAxis, factors: dict[str, float]) -> HiddenAxis:
    """The axis with some parameters times a factor, or its field turned by some rad; breakaway goes with Coulomb
    friction."""
    factor = {name: factors.get(name, 1.0) for name in FACTORS}
    level, viscous = factor["friction_level_change"], factor["viscous_friction_change"]
    friction = axis.friction.model_copy(
        update={
            "coulomb_force_n": axis.friction.coulomb_force_n * level,
            "static_force_n": axis.friction.static_force_n * level * factor["breakaway_change"],
            "viscous_friction_n_s_per_m": axis.friction.viscous_friction_n_s_per_m * viscous,
        }
    )
    constant = axis.motor.force_constant_n_per_a * factor["force_constant_change"]
    offset = axis.motor.commutation_offset_rad + factors.get(TURN, 0.0) / _waves(axis)
    motor = axis.motor.model_copy(update={"force_constant_n_per_a": constant, "commutation_offset_rad": offset})
    mass = axis.mass_kg * factor["payload_change"]
    return axis.model_copy(update={"friction": friction, "motor": motor, "mass_kg": mass})


def _factors(axis: HiddenAxis, random: np.random.Generator, count: int) -> dict[str, float]:
    """So many parameters with the factors by which they change, the field's phase with its turn in rad."""
    uneven = abs(_waves(axis) * axis.motor.winding_displacement_rad * 3.0 / (2.0 * math.pi) - 1.0) > _UNEVEN
    known = [*FACTORS, TURN] if axis.kind == "phase" and uneven else list(FACTORS)
    stuck = axis.friction.static_force_n / axis.friction.coulomb_force_n
    out = {}
    for name in map(str, random.choice(known, count, replace=False)):
        size = _log_uniform(random, *(_TURNS if name == TURN else FACTORS[name]))
        up = random.random() < 0.5 or (name == "breakaway_change" and stuck / size < _LEAST_BREAKAWAY)
        out[name] = size if up else -size if name == TURN else 1.0 / size
    return out


def _waves(axis: HiddenAxis) -> int:
    """Turns of the field for one of the motor's angles: theta's count half."""
    return 1 if axis.motor.kind == "sine" else 2


def _log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    return math.exp(float(random.uniform(math.log(low), math.log(high))))
