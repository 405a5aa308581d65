"""What the data cannot tell: parameters without effect, with useless intervals, or inseparable from others."""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.problem import Cost
from linid.identification.result import Estimate
from linid.identification.space.search_space import SearchSpace
from linid.physics.effects.registry import EFFECTS
from linid.physics.wording import fitting_words
from linid.statistics import NORMAL_97_5

# A 95 % interval wider than this factor in each direction says less than an order of magnitude.
LOG_LIMIT = np.log(3.0) / NORMAL_97_5
# Half-width of the 95 % interval of an unscaled parameter in parts of its search range.
RANGE_LIMIT = 0.25 / NORMAL_97_5
PAIR_LIMIT = 0.95
LOOSE = 0.002  # standard deviation from which on a correlation is worth a note
_FIELD = {"force_constant", "winding_displacement", "winding_length", "nome", "commutation_offset"}

ADVICE = {
    "bristle_stiffness": "record a slow current ramp around breakaway (pre-sliding) or keep the stop in the free wheel",
    "bristle_damping": "record a slow current ramp around breakaway (pre-sliding) or keep the stop in the free wheel",
    "stribeck_velocity": "record slow reversals or a constant speed near 1 to 20 mm/s",
    "stribeck_exponent": "fix alpha at 2, or record several constant low speeds",
    "static_force": "record a slow current ramp until the axis breaks away",
    "coulomb_force": "record moves in both directions",
    "viscous_friction": "record faster moves or free wheels",
    "mass": "record free wheels with and without a known added mass",
    "force_constant": "feed one phase alone, so that the currents do not sum to zero",
    "winding_displacement": "feed one phase alone, so that the currents do not sum to zero",
    "winding_length": "feed one phase alone: the third field harmonic is invisible while the currents sum to zero",
    "nome": "feed one phase alone: the third field harmonic is invisible while the currents sum to zero",
    "electrical_wavenumber": "record moves over more pole pitches",
    "commutation_offset": "record moves over more pole pitches",
}


def advice(name: str, axis: str, kind: str) -> str:
    """The recording that would make parameter `name` identifiable, in the words of the axis and the motor model."""
    text = ADVICE.get(name, "record a motion that excites it")
    for effect in EFFECTS:
        if any(parameter.name == name for parameter in effect.parameters):
            text = f"record {effect.exposed_by}"
    return fitting_words(text, axis, kind)


def without_effect(space: SearchSpace, cost: Cost, point: Array) -> tuple[str, ...]:
    """Parameters whose perturbation by a tenth of their range changes no residual (checked before a fit). point: (p,)
    search coordinates.
    """
    p = point.size
    rows = [point]
    for column in range(p):
        moved = point.copy()
        moved[column] += 0.1 if moved[column] <= 0.5 else -0.1
        rows.append(moved)
    costs = cost(np.array(rows))
    return tuple(
        name for column, name in enumerate(space.names) if abs(costs[1 + column] - costs[0]) <= 1e-9 * costs[0]
    )


def is_useless(space: SearchSpace, column: int, search_std: float) -> bool:
    """Whether the interval of a search coordinate says nothing useful. search_std: in search coordinates."""
    searched = space.parameters[column]
    if searched.log:
        return bool(search_std * np.log(searched.upper / searched.lower) > LOG_LIMIT)
    return bool(search_std > RANGE_LIMIT)


def inseparable_pairs(
    estimates: tuple[Estimate, ...],
    names: tuple[str, ...],
    correlation: Array,
    balanced_currents: bool,
    axis: str,
    kind: str,
) -> tuple[tuple[str, str, float, str], ...]:
    """Pairs of parameters with a correlation beyond PAIR_LIMIT that costs precision, and what would separate them.

    correlation: (p, p). Pairs whose members are both known to LOOSE (relative; angles in rad) are left out: nobody need
    separate them.
    """
    loose = {e.name: e.std > LOOSE * (abs(e.value) if e.unit != "1" else 1.0) for e in estimates if e.name in names}
    pairs = []
    for a in range(len(names)):
        for b in range(a + 1, len(names)):
            rho = float(correlation[a, b])
            if abs(rho) < PAIR_LIMIT or not (loose[names[a]] or loose[names[b]]):
                continue
            why = advice(names[b], axis, kind)
            if balanced_currents and {names[a], names[b]} <= _FIELD:
                why = "the phase currents sum to zero: feed one phase alone"
            pairs.append((names[a], names[b], rho, why))
    return tuple(pairs)
