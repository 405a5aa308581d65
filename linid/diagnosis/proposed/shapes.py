"""Shapes of one argument that engineers know: what they look like, where a search for their numbers starts, their text.

A shape's numbers beside its amplitudes are called theta (q,): lengths, places and wavenumbers in the argument's unit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.quantities import number, over, quantity
from linid.diagnosis.proposed.wave_columns import wave_columns

_SOFT = 0.01  # of the range: how far a step is smeared, so that its place can be searched
_WIDTHS = 0.003, 0.2  # of the range: least and largest width of a place
_LEAST_PERIODS = 0.7  # of a wave in the range: what bends less is none
_EXACT = 5  # digits of a period: with fewer, its phase far from zero would say nothing


@dataclass(frozen=True)
class Variable:
    """What a shape is a function of. symbol, unit: of texts; values: (n,) in that unit; low, high: their range;
    wavenumbers: rad per unit, of waves that are likely; ends: whether it is a place, with two ends and no zero; sways:
    whether there are waves in it; code: what own terms call it, empty where they cannot;
    spread: (n,) in the unit, deviation of the values that a row is the mean of."""

    symbol: str
    unit: str
    values: Array
    low: float
    high: float
    wavenumbers: tuple[float, ...] = ()
    ends: bool = False
    sways: bool = False
    code: str = ""
    spread: Array | float = 0.0

    @property
    def range(self) -> float:
        """high - low."""
        return max(self.high - self.low, 1e-12)


@dataclass(frozen=True)
class Shape:
    """One shape. columns(theta): (n, k); starts: (S, q) of theta; logs: (q,) whether it is searched by its logarithm;
    words(amplitudes (k,), theta): text of the shape with its amplitudes in front, `unit` holds their place's unit."""

    name: str
    columns: Callable[[Array], Array]
    starts: Array
    logs: tuple[bool, ...]
    words: Callable[[Array, Array, str], str]


def shapes(x: Variable, base: bool) -> Iterator[Shape]:
    """All shapes of a variable. base: whether the model itself has the constant and what is proportional to it."""
    if x.ends:
        yield _linear(x)
    powers = [p for p in (0.5, 1.0, 2.0, 3.0) if not (base and p == 1.0)]
    if not x.ends and x.low >= 0.0:
        yield from (_power(x, p) for p in powers)
        yield _saturating(x)
        yield _critical(x)
        yield _logarithm(x)
        yield _decay(x, 0.0, 1.0)
    if x.low < 0.0 and not x.ends:  # of both signs
        yield _odd(x, 2.0)
        yield _odd(x, 3.0)
        yield _beyond(x)
        yield _switch(x)
    if x.ends:
        yield _decay(x, x.low, 1.0)
        yield _decay(x, x.high, -1.0)
        yield _bump(x, True)
        yield _bend(x)
    yield _bump(x, False)
    yield _step(x)
    if x.sways:
        yield from _all_waves(x)


def _amplitude(value: float, unit: str) -> str:
    """An amplitude; a unit that starts with a stroke is one over what follows."""
    return quantity(value, unit) if not unit.startswith("/") else f"{number(value)} per {unit[1:]}"


def less(x: Variable, place: float) -> str:
    """A variable less a place, as text."""
    return f"({x.symbol} {'−' if place >= 0 else '+'} {quantity(abs(place), x.unit)})"


def softness(x: Variable) -> float:
    """Over how much of a variable, in its unit, a step is smeared."""
    return _SOFT * x.range


def slowest_wave(x: Variable) -> float:
    """The least wavenumber in rad per unit of a variable: what bends less is no wave."""
    return _LEAST_PERIODS * 2.0 * math.pi / x.range


def _no_theta() -> Array:
    return np.empty((1, 0))


def _power(x: Variable, power: float) -> Shape:
    def words(a: Array, theta: Array, unit: str) -> str:
        text = {0.5: f"√{x.symbol}", 1.0: x.symbol, 2.0: f"{x.symbol}²", 3.0: f"{x.symbol}³"}[power]
        return f"{_amplitude(a[0], over(unit, x.unit, power))} · {text}"

    return Shape(f"power {power:g}", lambda theta: np.abs(x.values[:, None]) ** power, _no_theta(), (), words)


def _odd(x: Variable, power: float) -> Shape:
    def words(a: Array, theta: Array, unit: str) -> str:
        text = {2.0: f"{x.symbol} · |{x.symbol}|", 3.0: f"{x.symbol}³"}[power]
        return f"{_amplitude(a[0], over(unit, x.unit, power))} · {text}"

    values = (np.sign(x.values) * np.abs(x.values) ** power)[:, None]
    return Shape(f"odd {power:g}", lambda theta: values, _no_theta(), (), words)


def _linear(x: Variable) -> Shape:
    def words(a: Array, theta: Array, unit: str) -> str:
        amplitude = _amplitude(a[0], over(unit, x.unit))
        return f"{amplitude} · {less(x, -a[1] / a[0] if a[0] else 0.0)}"

    columns = np.stack([x.values, np.ones(x.values.size)], axis=1)
    return Shape("linear", lambda theta: columns, _no_theta(), (), words)


def _saturating(x: Variable) -> Shape:
    def words(a: Array, theta: Array, unit: str) -> str:
        return f"{_amplitude(a[0], unit)} · {x.symbol}/({x.symbol} + {quantity(theta[0], x.unit)})"

    starts = x.high * np.array([[0.03], [0.1], [0.3], [1.0], [3.0]])
    return Shape("saturating", lambda theta: (x.values / (x.values + theta[0]))[:, None], starts, (True,), words)


def _logarithm(x: Variable) -> Shape:
    def words(a: Array, theta: Array, unit: str) -> str:
        return f"{_amplitude(a[0], unit)} · ln(1 + {x.symbol}/{quantity(theta[0], x.unit)})"

    starts = x.high * np.array([[0.003], [0.03], [0.3]])
    return Shape("logarithm", lambda theta: np.log1p(x.values / theta[0])[:, None], starts, (True,), words)


def _decay(x: Variable, start: float, sign: float) -> Shape:
    def columns(theta: Array) -> Array:
        return np.asarray(np.exp(-np.maximum(sign * (x.values - start), 0.0) / theta[0])[:, None])

    def words(a: Array, theta: Array, unit: str) -> str:
        distance = less(x, start) if start else x.symbol
        return f"{_amplitude(a[0], unit)} · exp({'−' if sign > 0 else ''}{distance}/{quantity(theta[0], x.unit)})"

    name = "decay" if sign > 0 else "rise"
    return Shape(name, columns, x.range * np.array([[0.01], [0.03], [0.1], [0.3], [1.0]]), (True,), words)


def _bump(x: Variable, pull: bool) -> Shape:
    """A Gauss bell at a place, or (pull) its derivative: a force towards the place or away from it."""

    def columns(theta: Array) -> Array:
        u = (x.values - theta[0]) / narrow(x, theta[1])
        bell = np.exp(-0.5 * np.minimum(u * u, 1e4))
        return np.asarray((u * bell if pull else bell)[:, None])

    def words(a: Array, theta: Array, unit: str) -> str:
        u = f"{less(x, theta[0])}/{quantity(narrow(x, theta[1]), x.unit)}"
        front = f"{u} · " if pull else ""
        return f"{_amplitude(a[0], unit)} · {front}exp(−½ ({u})²)"

    places = x.low + x.range * np.linspace(0.04, 0.96, 24)
    starts = np.array([(place, x.range * width) for place in places for width in (0.02, 0.05, 0.12)])
    return Shape("pull to a place" if pull else "bump", columns, starts, (False, True), words)


def narrow(x: Variable, width: float) -> float:
    """A width that a place has: neither that of the whole range nor less than a place can be told by."""
    return min(max(width, _WIDTHS[0] * x.range), _WIDTHS[1] * x.range)


def _bend(x: Variable) -> Shape:
    """What rises about a place and levels off on both sides."""

    def columns(theta: Array) -> Array:
        return np.asarray(np.tanh((x.values - theta[0]) / theta[1])[:, None])

    def words(a: Array, theta: Array, unit: str) -> str:
        return f"{_amplitude(a[0], unit)} · tanh({less(x, theta[0])}/{quantity(theta[1], x.unit)})"

    places = x.low + x.range * np.linspace(0.1, 0.9, 7)
    starts = np.array([(place, x.range * width) for place in places for width in (0.1, 0.3)])
    return Shape("bend", columns, starts, (False, True), words)


def _critical(x: Variable) -> Shape:
    """What grows up to a critical value and falls beyond it, as induced currents brake."""

    def columns(theta: Array) -> Array:
        u = x.values / theta[0]
        return np.asarray((2.0 * u / (1.0 + u * u))[:, None])

    def words(a: Array, theta: Array, unit: str) -> str:
        u = f"({x.symbol}/{quantity(theta[0], x.unit)})"
        return f"{_amplitude(a[0], unit)} · 2 {u}/(1 + {u}²)"

    return Shape("critical", columns, x.high * np.array([[0.1], [0.2], [0.4], [0.8]]), (True,), words)


def _switch(x: Variable) -> Shape:
    """A constant beyond a limit on either side."""

    def columns(theta: Array) -> Array:
        u = np.clip((np.abs(x.values) - theta[0]) / softness(x), -50.0, 50.0)
        return np.asarray((np.sign(x.values) / (1.0 + np.exp(-u)))[:, None])

    def words(a: Array, theta: Array, unit: str) -> str:
        s = x.symbol
        return f"{_amplitude(a[0], unit)} · [|{s}| > {quantity(theta[0], x.unit)}] · sign({s})"

    top = max(abs(x.low), abs(x.high))
    return Shape("switch", columns, top * np.linspace(0.05, 0.9, 12)[:, None], (True,), words)


def _step(x: Variable) -> Shape:
    def columns(theta: Array) -> Array:
        u = np.clip((x.values - theta[0]) / softness(x), -50.0, 50.0)
        return np.asarray((1.0 / (1.0 + np.exp(-u)))[:, None])

    def words(a: Array, theta: Array, unit: str) -> str:
        return f"{_amplitude(a[0], unit)} · [{x.symbol} > {quantity(theta[0], x.unit)}]"

    starts = (x.low + x.range * np.linspace(0.05, 0.95, 19))[:, None]
    return Shape("step", columns, starts, (False,), words)


def _beyond(x: Variable) -> Shape:
    """What is beyond a limit on either side."""

    def columns(theta: Array) -> Array:
        return np.asarray((np.sign(x.values) * np.maximum(np.abs(x.values) - theta[0], 0.0))[:, None])

    def words(a: Array, theta: Array, unit: str) -> str:
        limit, s = quantity(theta[0], x.unit), x.symbol
        return f"{_amplitude(a[0], over(unit, x.unit))} · max(|{s}| − {limit}, 0) · sign({s})"

    top = max(abs(x.low), abs(x.high))
    return Shape("beyond", columns, top * np.linspace(0.1, 0.9, 9)[:, None], (True,), words)


def _all_waves(x: Variable) -> Iterator[Shape]:
    """One wave, of a likely wavenumber or of one that a few hundred rows tell; and the two likeliest together."""
    slow = 2.0 * math.pi / x.range * np.array([0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0])
    yield waves(x, np.array([*x.wavenumbers, *slow])[:, None])
    if len(x.wavenumbers) > 1:
        yield waves(x, np.array(x.wavenumbers[:2])[None, :])


def waves(x: Variable, starts: Array) -> Shape:
    """A sum of waves. starts: (S, W) rad per unit."""
    slowest = slowest_wave(x)

    def columns(theta: Array) -> Array:
        return wave_columns(x.values, np.maximum(theta, slowest), x.spread)

    def words(a: Array, theta: Array, unit: str) -> str:
        return wave_words(x, a, np.maximum(theta, slowest), unit)

    return Shape(f"{starts.shape[1]} waves", columns, starts, (True,) * starts.shape[1], words)


def wave_words(x: Variable, a: Array, theta: Sequence[float] | Array, unit: str) -> str:
    """a[0] cos(k x) + a[1] sin(k x) + ... as sines with phases.

    a: (k,) in the unit that is said; theta: (q,) rad per unit of x.
    """
    parts = []
    for k, wavenumber in enumerate(theta):
        size, angle = math.hypot(a[2 * k], a[2 * k + 1]), math.atan2(a[2 * k], a[2 * k + 1])
        if x.unit == "s":
            inside = f"2π · {number(wavenumber / (2.0 * math.pi), _EXACT)} Hz · {x.symbol}"
        elif x.unit == "rad":
            inside = f"{number(wavenumber, _EXACT)} · {x.symbol}"
        else:
            inside = f"2π · {x.symbol}/{quantity(2.0 * math.pi / wavenumber, x.unit, _EXACT)}"
        phase = f"{'+' if angle >= 0 else '−'} {abs(angle):.2f}"
        parts.append(f"{_amplitude(size, unit)} · sin({inside} {phase})")
    return parts[0] if len(parts) == 1 else f"({' + '.join(parts)})"
