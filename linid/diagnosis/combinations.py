"""What is known of parameters together that recordings do not tell one by one: ratios and products with intervals."""

from __future__ import annotations

import math

from linid.identification.result import FitResult
from linid.physics.effects.registry import find_effect
from linid.statistics import NORMAL_97_5

_WIDE = 0.5  # of a value: a 95 % interval that is wider each way says little of the parameter itself
_NARROWER = 0.5  # of the wider parameter's relative deviation: what a combination must be to be worth a line


def base_combinations(result: FitResult, known_mass: bool) -> tuple[str, ...]:
    """Acceleration per input and friction per force constant, where no recording tells the mass; known_mass: whether
    one does."""
    names = {e.name: e for e in result.estimates}
    if known_mass or "force_constant" not in names:
        return ()
    rotary = result.axis == "rotary"
    constant, mass = names["force_constant"].value, names["mass"].value
    mass_word, unit = ("inertia", "rad/s^2") if rotary else ("mass", "m/s^2")
    lines = [
        f"force constant / {mass_word} = {_shown(constant / mass, _relative(result, {'force_constant': 1}))} "
        f"{unit} per {result.input_unit}"
    ]
    for name, words in (("coulomb_force", "Coulomb friction"), ("viscous_friction", "viscous friction")):
        relative = _relative(result, {name: 1, "force_constant": -1})
        speed = (" s/rad" if rotary else " s/m") if name == "viscous_friction" else ""
        ratio = _shown(names[name].value / constant, relative)
        lines.append(f"{words} / force constant = {ratio} {result.input_unit}{speed}")
    return tuple(lines)


def effect_combinations(result: FitResult, effect: str) -> tuple[str, ...]:
    """Products and ratios of an effect's parameter with another one that are known far better than it is itself."""
    own = {p.name for p in find_effect(effect).parameters}
    values = {e.name: e for e in result.estimates}
    lines, told = [], set()
    for name in (one for one in result.fitted if one in own):
        alone = _relative(result, {name: 1})
        if not alone > _WIDE / NORMAL_97_5:
            continue
        best: tuple[float, str, int] | None = None
        for other in result.fitted:
            if other == name or values[other].value == 0.0:
                continue
            for power in (1, -1):
                together = _relative(result, {name: 1, other: power})
                if together < _NARROWER * alone and (best is None or together < best[0]):
                    best = together, other, power
        if best is not None and frozenset((name, best[1])) not in told:  # nor a ratio the other way round
            together, other, power = best
            told.add(frozenset((name, other)))
            value = values[name].value * values[other].value ** power
            sign = "·" if power > 0 else "/"
            words = name.replace("_", " "), other.replace("_", " ")
            lines.append(f"{words[0]} {sign} {words[1]} = {_shown(value, together)} (SI), better than either alone")
    return tuple(lines)


def _relative(result: FitResult, powers: dict[str, int]) -> float:
    """Relative standard deviation of a product of powers of fitted parameters; what is not fitted has none."""
    values = {e.name: e.value for e in result.estimates}
    places = {name: k for k, name in enumerate(result.fitted)}
    stds = {e.name: e.std for e in result.estimates}
    total = 0.0
    known = [name for name in powers if name in places and values[name] != 0.0]
    for one in known:
        for other in known:
            rho = float(one == other)
            if result.correlation.size:
                rho = float(result.correlation[places[one], places[other]])
            term = powers[one] * powers[other] * rho * stds[one] * stds[other] / (values[one] * values[other])
            total += term
    return math.sqrt(max(total, 0.0)) if math.isfinite(total) else math.inf


def _shown(value: float, relative: float) -> str:
    """A value with its 95 % interval."""
    if not math.isfinite(relative):
        return f"{value:.3g} (interval unknown)"
    half = NORMAL_97_5 * relative * abs(value)
    return f"{value:.4g} [{value - half:.4g}, {value + half:.4g}]"
