"""An own term as an effect: parameters under its name, starting values and search ranges from the recordings."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache, partial
from itertools import product

import numpy as np

from linid.arrays import Array
from linid.errors import ConfigError
from linid.physics.effects.effect import ALL_KINDS, MOTORS, Effect, Outlook, Values
from linid.physics.own_terms import layout
from linid.physics.own_terms.own_term import OwnTerm, parse_term
from linid.physics.own_terms.values import formula_values
from linid.physics.parameter import Parameter

AMPLITUDE_PER_FORCE = 20.0  # largest force of a term, in scales of the forces on the axis
_STARTS = {1: 15, 2: 7, 3: 3}  # starting values per parameter that is not linear, by how many there are
_MANY = 2
_MOST_SEARCHED = 5  # parameters that are not linear with more than one starting value
_DECADE = 10.0  # between the ends of a range, from which on it is searched on a logarithmic scale
_SAMPLES = 512
_SMALLEST = 1e-9  # of the largest size: a multiplier that small is not to be seen at these starting values
_BREAKAWAY = 2.0  # largest level of friction, in parts of Coulomb's force
_PUSH = 3.0  # largest motor force, in scales of the forces on the axis


def own_effect(text: str, taken: Collection[str]) -> Effect:
    """The effect of an own term's text; raises ConfigError for a formula that is none and for names in `taken`."""
    term = parse_term(text)
    place = f"effect {term.name!r}"
    parameters = tuple(_parameter(term, name) for name in term.parameters)
    for name in (f"effect {term.name}", *(p.name for p in parameters)):
        if name in taken:
            plain = name.removeprefix("effect ")
            raise ConfigError(place, f"the name {plain!r} is taken by linid itself", "Call the term otherwise.")
    return Effect(
        name=term.text,
        slot="FORCE",
        physics=f"{term.name} = {term.formula}, a force in N.",
        parameters=parameters,
        amplitudes=tuple(f"{term.name}_{name}" for name in term.amplitudes),
        exposed_by=f"motion over a wide range of {_listed(sorted(term.variables) or ['y'])}",
        kinds=MOTORS if "F" in term.variables else ALL_KINDS,
        grid=partial(_grid, term),
        own=term,
    )


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _parameter(term: OwnTerm, name: str) -> Parameter:
    full, span = f"{term.name}_{name}", term.range_of(name)
    symbol = f"c_{name}" if name.isdigit() else name
    if name in term.amplitudes:
        low, high = span or (-1e15, 1e15)
        return Parameter(full, symbol, term.unit(name), low, high, 0.0, meaning=f"amplitude in {term.name}")
    low, high = span or (0.0, 1.0)
    log = low > 0.0 and high >= _DECADE * low
    middle = float(np.sqrt(low * high)) if log else 0.5 * (low + high)
    return Parameter(full, symbol, "SI", low, high, middle, log=log, meaning=f"parameter of {term.name}")


def _grid(term: OwnTerm, outlook: Outlook) -> tuple[Values, ...]:
    """Starting values of what is not linear: the middle of all ranges first."""
    names = [name for name in term.parameters if name not in term.amplitudes]
    count = _STARTS.get(len(names), _MANY)
    choices = []
    for k, name in enumerate(names):
        p = _parameter(term, name)
        shares = (np.arange(count) + 0.5) / count if k < _MOST_SEARCHED else np.array([0.5])
        shares = shares[np.argsort(np.abs(shares - 0.5), kind="stable")]
        values = p.lower * (p.upper / p.lower) ** shares if p.log else p.lower + (p.upper - p.lower) * shares
        choices.append([(p.name, float(x)) for x in values])
    return tuple(dict(one) for one in product(*choices))


def own_range(effect: Effect, amplitude: str, outlook: Outlook, force: float) -> tuple[float, float]:
    """Search range of an own term's amplitude in its SI unit: as given, or what makes it a force of the axis' size.

    force: scale of the forces on the axis in N; amplitude: full name. Source: linid's own form.
    """
    term: OwnTerm = effect.own
    name = amplitude.removeprefix(f"{term.name}_")
    given = term.range_of(name)
    return _usual_ranges(term.text, outlook, force)[name] if given is None else given


@lru_cache(maxsize=64)  # every fit with the term asks for all its amplitudes
def _usual_ranges(text: str, outlook: Outlook, force: float) -> dict[str, tuple[float, float]]:
    """Range of each amplitude of a term that makes it a force of the axis' size, SI."""
    term, points = parse_term(text), _points(outlook, force)
    starts = [{key.removeprefix(f"{term.name}_"): x for key, x in one.items()} for one in _grid(term, outlook)]
    ones = dict.fromkeys(term.amplitudes, 1.0)
    out = {}
    for name in term.amplitudes:
        sizes = []
        for start in starts:
            values = [np.abs(formula_values(one.node, points, start | ones)) for one in term.multiplier(name)]
            total = sum(values, np.zeros(1))
            usual = total[np.isfinite(total)]
            sizes.append(float(np.quantile(usual, 0.9)) if usual.size else 0.0)
        seen = [size for size in sizes if size > _SMALLEST * max(sizes)]
        largest = AMPLITUDE_PER_FORCE * force / (min(seen) if seen else 1.0)
        out[name] = (-largest, largest)
    return out


def _points(outlook: Outlook, force: float) -> dict[str, Array]:
    """Values (N,) of all variables, spread over what such recordings show, SI."""
    longest = max(outlook.durations)
    total = max(outlook.campaign_duration, longest)
    speed, push = max(outlook.top_speed, 1e-9), _PUSH * force
    rate = speed**2 / max(outlook.stroke, 1e-9)  # what it takes to that speed at least
    ends = {
        "t": (0.0, longest),
        "T": (0.0, total),
        "y": (outlook.stroke_low, outlook.stroke_high),
        "v": (-speed, speed),
        "F": (-push, push),
        "travel": (0.0, outlook.stroke),
        "since_reversal": (0.0, longest),
        "rest": (0.0, longest),
        "slid": (0.0, outlook.stroke),
        "acceleration": (-rate, rate),
        "stribeck": (1.0, _BREAKAWAY),
    }
    shares = np.random.default_rng(0).random((len(layout.VARIABLES), _SAMPLES))
    return {name: ends[name][0] + (ends[name][1] - ends[name][0]) * shares[k] for k, name in enumerate(ends)}
