"""The small dictionary of formulas: shapes of an argument, times direction, motor force or velocity."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.arguments import Argument, arguments_of
from linid.diagnosis.proposed.basis import support
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.own_formula import gated, own_shape, summed
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.quantities import STRIBECK, over, quantity
from linid.diagnosis.proposed.shapes import Shape, Variable, less, shapes, wave_words
from linid.diagnosis.proposed.wave_columns import wave_columns

_FACTORS = ("direction", "motor_force", "velocity", "recording")  # of other arguments, where there are any
_SYMBOLS = {"position": "y", "travel": "travel", "since_reversal": "time since reversal", "rest_time": "rest"}
_SYMBOLS |= {"time": "t", "campaign_time": "T", "acceleration": "a", "velocity": "v", "motor_force": "F"}
_TURNS = (0.15, 0.3, 0.5, 1.0)  # m/s in which a wave's phase may turn round
_GROWTH = 0.1  # of the largest speed, over which a wave may grow
_GATE = 0.03  # of the largest speed, over which a gate opens


@dataclass(frozen=True)
class Formula:
    """A formula of the dictionary. columns(theta): (n, k) m/s^2 per unit amplitude; starts: (S, q) of theta; logs: (q,)
    whether it is searched by its logarithm; words(amplitudes (k,), theta): its text; own(theta (q,)): formula of an own
    term, amplitudes c_1, c_2 ..., empty where there is none."""

    name: str
    columns: Callable[[Array], Array]
    starts: Array
    logs: tuple[bool, ...]
    words: Callable[[Array, Array], str]
    own: Callable[[Array], str]


@dataclass(frozen=True)
class _Factor:
    """What a shape is multiplied by. text: of it; unit: of the amplitude, in parts of a force; values: (n,); resists:
    whether it is a level of friction, whose amplitudes are those of the force along the motion."""

    text: str
    unit: str
    values: Array
    resists: bool = False

    @property
    def code(self) -> str:
        """It in the words of own terms."""
        text = self.text.replace("²", "**2").replace("|F|", "abs(F)").replace("|v|", "abs(v)").replace(" · ", "*")
        return text.replace(STRIBECK, "stribeck")


def formulas(problem: Problem, family: Family) -> Iterator[Formula]:
    """All formulas that have the arguments of a family."""
    names = set(family.arguments)
    if "recording" in names:
        return
    arguments = {key: argument.plain for key, argument in arguments_of(problem).items()}
    level = problem.stribeck if family.scaled else np.ones(problem.stribeck.size)
    if names == {"direction"}:
        yield _one_way(problem, level)
        return
    main = next((name for name in _SYMBOLS if name in names and name not in _FACTORS), "")
    if not main:
        yield from _of_motion(problem, arguments, names, level)
        return
    variable = _variable(problem, arguments[main], _likely(problem, family, main))
    for factor in _factors(problem, names - {main}, level):
        if main == "acceleration" and factor.resists:  # friction knows no sign of it
            size = replace(arguments[main], symbol="abs(acceleration)", values=np.abs(arguments[main].values))
            variable = _variable(problem, size, ())
        for shape in shapes(variable, _is_base(factor, main)):
            yield _times(problem, factor, variable, shape)
    if names == {"position", "velocity"}:
        yield from _turning(problem, variable)
    if names == {"position", "direction"} and len(variable.wavenumbers) > 1:
        yield _forth_and_back(problem, variable)
    if names == {"time", "velocity"} and variable.wavenumbers:
        yield _gated(problem, variable)
    if names == {"position", "motor_force"}:
        yield _place_and_force(problem, variable)


def _of_motion(problem: Problem, arguments: Mapping[str, Argument], names: set[str], level: Array) -> Iterator[Formula]:
    """Formulas of velocity, motor force and direction alone. level: (n,) as of `_resisting`."""
    one = np.ones(problem.rows.t.size)
    friction = _resisting(_force(problem), one)
    pairs: list[tuple[str, _Factor, bool]] = []
    if "motor_force" not in names:
        pairs = [("speed", friction, True), ("velocity", _Factor("", _force(problem), one), True)]
    elif names == {"motor_force"}:
        pairs = [("motor_force", _Factor("", _force(problem), one), True), ("force_size", friction, False)]
    elif names == {"motor_force", "direction"}:
        pairs = [("force_size", _resisting(_force(problem), level), False)]
    elif "velocity" in names:
        pairs = [("speed", _Factor("F", "", problem.push), False)]
        damping = _Factor("v", over(_force(problem), _speed(problem)), problem.rows.v)
        pairs += [("force_size", damping, False)]
    for key, factor, base in pairs:
        if key in arguments:
            variable = _variable(problem, arguments[key], ())
            for shape in shapes(variable, base):
                yield _times(problem, factor, variable, shape)


def _resisting(unit: str, level: Array, size: str = "", values: Array | float = 1.0) -> _Factor:
    """Friction. level: (n,) of the Stribeck curve where it scales that, else 1; size: text of what else it grows with,
    of values (n,)."""
    curve = "" if np.all(level == 1.0) else STRIBECK
    return _Factor(" · ".join(part for part in (size, curve, "sign(v)") if part), unit, values * level, True)


def _factors(problem: Problem, others: set[str], level: Array) -> tuple[_Factor, ...]:
    """What a shape of one argument may be multiplied by to depend on the others too. level: (n,) as of `_resisting`."""
    push, force, speed = problem.push, _force(problem), _speed(problem)
    one = np.ones(push.size)
    if others == set():
        return (_Factor("", force, one),)
    if others == {"direction"}:
        return (_resisting(force, level),)
    if others == {"velocity"}:
        return (_Factor("v", over(force, speed), problem.rows.v),)
    if others == {"motor_force"}:
        squares = _Factor("F²", over("", force), push**2)
        return _Factor("F", "", push), squares, _Factor("|F|", "", np.abs(push))
    if others == {"motor_force", "direction"}:
        squares = _resisting(over("", force), level, "F²", push**2)
        return _resisting("", level, "|F|", np.abs(push)), squares
    if others == {"motor_force", "velocity"}:
        return (_Factor("F · |v|", over("", speed), push * np.abs(problem.rows.v)),)
    return ()


def _times(problem: Problem, factor: _Factor, x: Variable, shape: Shape) -> Formula:
    """A shape times a factor."""

    def columns(theta: Array) -> Array:
        values = shape.columns(theta) * factor.values[:, None]
        return -problem.resisted(values) if factor.resists else problem.pushed(values)

    def words(a: Array, theta: Array) -> str:
        text = shape.words(a, theta, factor.unit)
        whole = f"{text} · {factor.text}" if factor.text else text
        return whole.replace("|v|² · sign(v)", "v · |v|").replace("|v|³ · sign(v)", "v³")

    def own(theta: Array) -> str:
        return summed(own_shape(shape.name, x, theta), factor.code)

    return Formula(f"{shape.name} {factor.text}", columns, shape.starts, shape.logs, words, own)


def _one_way(problem: Problem, level: Array) -> Formula:
    """Friction in one direction of motion only. level: (n,) as of `_resisting`."""
    factor = _resisting(_force(problem), level)
    columns = -problem.resisted(((problem.friction < 0.0) * factor.values)[:, None])

    def words(a: Array, theta: Array) -> str:
        return f"{quantity(a[0], _force(problem))} · {factor.text.replace('sign(v)', '[v > 0]')}"

    def own(theta: Array) -> str:
        return f"c_1*(0.5 + 0.5*sign(v))*{factor.code}"

    return Formula("one way", lambda theta: columns, np.empty((1, 0)), (), words, own)


def _turning(problem: Problem, x: Variable) -> Iterator[Formula]:
    """A wave in position whose phase turns with velocity or with speed (it comes late, or is fed forward), and one that
    the speed also makes grow."""
    turns = [sign * 2.0 * math.pi / turn for turn in _TURNS for sign in (1.0, -1.0)]
    starts = np.array([(k, turn) for k in x.wavenumbers for turn in (*turns, 1e-3)]).reshape(-1, 2)
    if not starts.size:
        return
    size, unit = np.abs(problem.rows.v), _speed(problem)
    growing = np.column_stack([starts, np.full(len(starts), _GROWTH * float(np.quantile(size, 0.99)))])
    for text, speed in (("v", problem.rows.v), ("|v|", size)):

        def columns(theta: Array, speed: Array = speed) -> Array:
            angle = theta[0] * x.values + theta[1] * speed
            grown = 1.0 - np.exp(-size / theta[2]) if theta.size > 2 else np.ones(size.size)
            return problem.pushed(grown[:, None] * wave_columns(angle, (1.0,), theta[0] * x.spread))

        def words(a: Array, theta: Array, text: str = text) -> str:
            wave = wave_words(x, a, theta[:1], _force(problem))
            turn = f"{'+' if theta[1] >= 0 else '−'} 2π · {text}/{quantity(2 * math.pi / abs(theta[1]), unit)}"
            grown = f" · (1 − exp(−|v|/{quantity(theta[2], unit)}))" if theta.size > 2 else ""
            return f"{wave[:-1]} {turn}){grown}"

        def own(theta: Array, text: str = text) -> str:
            angle = f"({theta[0]:.10g}*y + {theta[1]:.10g}*{text.replace('|v|', 'abs(v)')})"
            grown = f"*(1 - exp(-abs(v)/{theta[2]:.10g}))" if theta.size > 2 else ""
            return summed((f"cos{angle}{grown}", f"sin{angle}{grown}"))

        yield Formula(f"wave turning with {text}", columns, starts, (True, False), words, own)
        yield Formula(f"wave turning with {text}, growing", columns, growing, (True, False, True), words, own)


def _forth_and_back(problem: Problem, x: Variable) -> Formula:
    """A wave in position on the way forth, and another one on the way back."""
    forth = (problem.rows.v > 0.0).astype(np.float64)

    def columns(theta: Array) -> Array:
        ways = np.repeat(np.stack([forth, 1.0 - forth], axis=1), 2, axis=1)
        return problem.pushed(ways * wave_columns(x.values, theta, x.spread))

    def words(a: Array, theta: Array) -> str:
        ways = [wave_words(x, a[2 * k : 2 * k + 2], theta[k : k + 1], _force(problem)) for k in range(2)]
        return f"{ways[0]} · [v > 0] + {ways[1]} · [v < 0]"

    starts = np.array([(one, other) for one in x.wavenumbers for other in x.wavenumbers if one != other])

    def own(theta: Array) -> str:
        ways = zip(theta, ("+", "-"), strict=True)
        return summed(tuple(f"(0.5 {sign} 0.5*sign(v))*{f}({k:.10g}*y)" for k, sign in ways for f in ("cos", "sin")))

    return Formula("a wave each way", columns, starts, (True, True), words, own)


def _gated(problem: Problem, x: Variable) -> Formula:
    """A wave in time above a speed."""
    speed = np.abs(problem.rows.v)
    top = float(np.quantile(speed, 0.99))

    def columns(theta: Array) -> Array:
        gate = 1.0 / (1.0 + np.exp(-np.clip((speed - theta[1]) / (_GATE * top), -50.0, 50.0)))
        return problem.pushed(gate[:, None] * wave_columns(x.values, theta[:1], x.spread))

    def words(a: Array, theta: Array) -> str:
        return f"{wave_words(x, a, theta[:1], _force(problem))} · [|v| > {quantity(theta[1], _speed(problem))}]"

    starts = np.array([(k, top * gate) for k in x.wavenumbers for gate in np.linspace(0.05, 0.85, 9)]).reshape(-1, 2)

    def own(theta: Array) -> str:
        gate = gated("abs(v)", float(theta[1]), _GATE * top)
        return summed(tuple(f"{gate}*{wave}({theta[0]:.10g}*t)" for wave in ("cos", "sin")))

    return Formula("wave above a speed", columns, starts, (True, False), words, own)


def _place_and_force(problem: Problem, x: Variable) -> Formula:
    """Friction at a place, above a motor force."""
    size = np.abs(problem.push)
    top = max(float(np.quantile(size, 0.98)), 1e-12)

    def columns(theta: Array) -> Array:
        bell = np.exp(-0.5 * np.minimum(((x.values - theta[0]) / theta[1]) ** 2, 1e4))
        gate = 1.0 / (1.0 + np.exp(-np.clip((size - theta[2]) / (_GATE * top), -50.0, 50.0)))
        return -problem.resisted((bell * gate)[:, None])

    def words(a: Array, theta: Array) -> str:
        bell = f"exp(−½ ({less(x, theta[0])}/{quantity(theta[1], x.unit)})²)"
        return f"{quantity(a[0], _force(problem))} · {bell} · [|F| > {quantity(theta[2], _force(problem))}] · sign(v)"

    places = x.low + x.range * np.linspace(0.04, 0.96, 24)
    starts = np.array([(p, x.range * w, top * g) for p in places for w in (0.03, 0.08) for g in (0.2, 0.5)])

    def own(theta: Array) -> str:
        bell = f"exp(-0.5*((y - {theta[0]:.10g})/{theta[1]:.10g})**2)"
        return f"c_1*{bell}*{gated('abs(F)', float(theta[2]), _GATE * top)}*sign(v)"

    return Formula("place above a force", columns, starts, (False, True, False), words, own)


def _variable(problem: Problem, argument: Argument, wavenumbers: tuple[float, ...]) -> Variable:
    """An argument as what a shape is a function of."""
    symbol = _SYMBOLS[argument.name]
    if argument.symbol.startswith("abs("):
        symbol = f"|{symbol}|"
    fitted = argument.values[~problem.held]
    low, high = support(fitted)
    unit = argument.unit.replace("^2", "²")
    values = np.where(np.isfinite(argument.values), argument.values, high)
    place, passing = argument.name == "position", argument.name in ("time", "campaign_time")
    low = 0.0 if passing else low
    ends = place, place or passing
    return Variable(symbol, unit, values, low, high, wavenumbers, *ends, argument.symbol, argument.spread)


def _likely(problem: Problem, family: Family, main: str) -> tuple[float, ...]:
    """Wavenumbers that the family has found, in rad per unit of its main argument, and those of the motor's field."""
    found = [k for side in family.sides if side.argument.name == main for k in side.wavenumbers]
    if main == "position" and problem.field is not None:
        found += [problem.field, 2.0 * problem.field]
    return tuple(found)


def _is_base(factor: _Factor, main: str) -> bool:
    """Whether the model has what is proportional to a shape's variable by itself: its mass."""
    return main == "acceleration" and not factor.resists


def _force(problem: Problem) -> str:
    return "N m" if problem.rotary else "N"


def _speed(problem: Problem) -> str:
    return "rad/s" if problem.rotary else "m/s"
