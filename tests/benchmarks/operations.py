"""Runs the kernel in plain Python, with numbers that count operations or with numbers of float32.

Nothing is compiled: what is counted are the operations of the formulas, whatever a compiler makes of them. Operations
among parameters alone are left out, as a compiler does them once, and so are comparisons, whose outcome the processor
predicts.
"""

from __future__ import annotations

import math
import operator
from collections import Counter
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from linid.physics import friction
from linid.simulation.course import Candidates, Scheme, Stretch
from linid.simulation.kernel import simulate_one
from linid.simulation.steering import UNSTEERED
from linid.simulation.terms import terms_of
from tests.plain import Plain

FUNCTIONS = ("exp", "sin", "cos", "sqrt")
KINDS = ("add", "multiply", "divide", "power", "sign", *FUNCTIONS)


class Account:
    """What has been done so far. cost: by kind of operation, from when its operands are there to its result."""

    def __init__(self, cost: dict[str, float]) -> None:
        self.done: Counter[str] = Counter()
        self.cost = cost

    def result(self, kind: str, function: Callable[..., float], *operands: Any) -> Traced:
        """Do one operation and book it."""
        self.done[kind] += 1
        ready = max(x.ready for x in operands if isinstance(x, Traced)) + self.cost[kind]
        return Traced(float(function(*map(float, operands))), ready, self)


class Traced:
    """A number that knows when it is ready at the earliest."""

    __slots__ = ("account", "ready", "value")
    __array_ufunc__ = None  # numpy's numbers leave the operation to this class

    def __init__(self, value: float, ready: float, account: Account) -> None:
        self.value, self.ready, self.account = value, ready, account

    def __float__(self) -> float:
        return self.value

    def __abs__(self) -> Traced:
        return self.account.result("sign", abs, self)

    def __neg__(self) -> Traced:
        return self.account.result("sign", operator.neg, self)


def _booked(kind: str, function: Callable[..., float], swapped: bool) -> Callable[[Traced, Any], Traced]:
    def method(one: Traced, other: Any) -> Traced:
        return one.account.result(kind, function, *((other, one) if swapped else (one, other)))

    return method


def _compared(function: Callable[..., bool]) -> Callable[[Traced, Any], bool]:
    return lambda one, other: function(one.value, float(other))


for _name, _kind in (("add", "add"), ("sub", "add"), ("mul", "multiply"), ("truediv", "divide"), ("pow", "power")):
    setattr(Traced, f"__{_name}__", _booked(_kind, getattr(operator, _name), False))
    setattr(Traced, f"__r{_name}__", _booked(_kind, getattr(operator, _name), True))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Traced, f"__{_name}__", _compared(getattr(operator, _name)))


def _function(kind: str, name: str) -> Callable[..., Any]:
    plain = getattr(math, name)

    def called(*operands: Any) -> Any:
        traced = next((x for x in operands if isinstance(x, Traced)), None)
        return plain(*operands) if traced is None else traced.account.result(kind, plain, *operands)

    return called


TRACED_MATH = SimpleNamespace(
    **{name: _function(name, name) for name in FUNCTIONS},
    copysign=_function("sign", "copysign"),
    isnan=lambda x: math.isnan(float(x)),
    **{name: getattr(math, name) for name in ("pi", "inf", "log")},
)
# Rounding to an integer is one instruction, which takes the adder's place.
TRACED_ARRAYS = SimpleNamespace(zeros=np.zeros, nan=np.nan, int64=int, floor=_function("add", "floor"))
COUNTED = ("gliding_step", "lugre_step", "stribeck_fall")


def plain_kernel(given: dict[str, Any]) -> tuple[Callable[..., int], Counter[str]]:
    """`simulate_one` without effects in plain Python, and a count of the calls that tell one kind of step from another.

    given: what the formulas find as `math` and `np`.
    """
    calls: Counter[str] = Counter()
    inner = Plain(given)
    counted = {name: _counted(inner.of(getattr(friction, name)), name, calls) for name in COUNTED}
    plain = Plain({**given, **counted})
    terms = plain.of(terms_of(bare=True))
    return partial(plain.of(simulate_one), terms), calls


def _counted(function: Callable[..., Any], name: str, calls: Counter[str]) -> Callable[..., Any]:
    def called(*arguments: Any) -> Any:
        calls[name] += 1
        return function(*arguments)

    return called


def simulate(kernel: Callable[..., int], segment: dict[str, Any], y_out: Any) -> int:
    """Run one segment of `tests.benchmarks.kernel.Case.separate`; returns the internal steps. y_out: (count,) m."""
    candidates = Candidates(segment["params"], segment["motor"], 0, 0)
    first = (*(segment[name] for name in ("params", "powered", "coefficients")), False, segment["zero"], segment["dt"])
    stretch = Stretch(*first, 0, len(y_out), segment["added_mass"], 0.0, 0.0)
    scheme = Scheme(False, np.empty((4, 0)), np.empty(0), segment["substeps"], segment["tolerance"], UNSTEERED)
    kept, forces, out = np.empty(0, dtype=np.int64), np.empty(0), (y_out, np.empty(0))
    return int(kernel(candidates, stretch, segment["start"], kept, scheme, forces, out))


def count(segments: list[dict[str, Any]], cost: dict[str, float]) -> dict[str, Any]:
    """Steps by kind, operations by kind, and the length of the dependency chain through all segments.

    cost: latency of each kind of operation (KINDS), in any unit; the chain has the same. A step is `followed` if the
    bristle is, else it glided; `rejected`: gliding steps done once more with the bristle; `predictors`: those of
    followed steps, of which each halving needs one more.
    """
    kernel, calls = plain_kernel({"math": TRACED_MATH, "np": TRACED_ARRAYS})
    account = Account(cost)

    def traced(values: Any) -> Any:
        out = np.empty(np.shape(values), dtype=object)
        out.ravel()[:] = [Traced(float(x), 0.0, account) for x in np.ravel(values)]
        return out

    steps, chain = 0, 0.0
    for segment in segments:
        y_out = np.empty(len(segment["coefficients"]) + 1, dtype=object)
        moving = {name: traced(segment[name]) for name in ("coefficients", "start")}
        steps += simulate(kernel, {**segment, **moving}, y_out)
        chain += y_out[-1].ready
    followed = calls["lugre_step"]
    return {
        "steps": steps,
        "followed": followed,
        "rejected": calls["gliding_step"] + followed - steps,
        "predictors": calls["stribeck_fall"],
        "operations": {kind: account.done[kind] for kind in KINDS},
        "chain": chain,
    }


def _float32(name: str) -> Callable[..., Any]:
    plain = getattr(math, name)
    return lambda *operands: np.float32(plain(*operands))


def in_float32(segment: dict[str, Any]) -> Any:
    """Positions (count,) in m of a segment simulated in float32 throughout."""
    functions = SimpleNamespace(
        **{name: _float32(name) for name in (*FUNCTIONS, "copysign")},
        **{name: getattr(math, name) for name in ("pi", "inf", "log", "isnan")},
    )
    arrays = SimpleNamespace(
        zeros=lambda shape: np.zeros(shape, dtype=np.float32), nan=np.float32(np.nan), int64=int, floor=np.floor
    )
    kernel = plain_kernel({"math": functions, "np": arrays})[0]
    single = {name: np.float32(segment[name]) for name in ("zero", "dt", "added_mass", "tolerance")}
    single |= {name: np.asarray(segment[name], dtype=np.float32) for name in ("params", "coefficients", "start")}
    y_out = np.empty(len(segment["coefficients"]) + 1, dtype=np.float32)
    simulate(kernel, {**segment, **single}, y_out)
    return y_out
