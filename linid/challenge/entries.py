"""What the catalogue of hidden effects is made of: an axis' sizes, an effect, an entry, and how numbers are drawn."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from linid.challenge.hidden_axis import AXES, AxisKind

Scope = Literal["all", "driven", "chosen"]
Random = np.random.Generator
TURN = 2 * math.pi
BOTH = (1, -1)


@dataclass(frozen=True)
class AxisSizes:
    """Round numbers of an axis from which shapes and first amplitudes are drawn, SI: mass, coulomb force, thrust per
    ampere of q-current, typical and limiting q-current, stroke, reach (half the travel of driven recordings), radius
    of rotary axes."""

    mass: float
    coulomb: float
    thrust: float
    current: float
    limit: float
    stroke: float
    reach: float
    radius: float = 1.0


@dataclass(frozen=True)
class HiddenEffect:
    """One withheld effect. amplitude: what strength scales; shape: its other numbers, SI; recordings: names of those
    it acts in where it acts in chosen ones only (else empty); pushes: where there are several, (recording, size in
    amplitudes, start in s, length in s)."""

    name: str
    amplitude: float
    shape: dict[str, float] = field(default_factory=dict)
    recordings: tuple[str, ...] = ()
    pushes: tuple[tuple[str, float, float, float], ...] = ()


@dataclass(frozen=True)
class Entry:
    """row: its row in the kernel's table, None where it changes masses, field or sensors only; scope: in which
    recordings it acts; first: a small amplitude to start from; limit: largest magnitude that stays plausible; signs:
    signs its amplitude may have; most: greatest strength that may be asked of it; axes: on which it can be; shape:
    draws the other numbers, in the kernel's order."""

    row: int | None
    scope: Scope
    first: Callable[[AxisSizes], float]
    limit: Callable[[AxisSizes], float]
    shape: Callable[[Random, AxisSizes], dict[str, float]]
    signs: tuple[int, ...] = (1,)
    most: float = math.inf
    axes: tuple[AxisKind, ...] = AXES


def log_even(random: Random, low: float, high: float) -> float:
    """A number drawn evenly in its logarithm."""
    return float(np.exp(random.uniform(math.log(low), math.log(high))))


def even(random: Random, low: float, high: float) -> float:
    """A number drawn evenly."""
    return float(random.uniform(low, high))


def phase(random: Random) -> float:
    """A phase in rad."""
    return even(random, 0, TURN)


def constant(value: float) -> Callable[[AxisSizes], float]:
    """The same number for axes of all sizes."""
    return lambda s: value


def coulombs(number: float) -> Callable[[AxisSizes], float]:
    """So many times the Coulomb force of the axis."""
    return lambda s: number * s.coulomb


def waves(low: float, high: float) -> Callable[[Random, AxisSizes], dict[str, float]]:
    """The shape of what sways at one frequency between two, in Hz."""
    return lambda random, sizes: {"frequency": log_even(random, low, high), "phase": phase(random)}


def nothing(random: Random, scales: AxisSizes) -> dict[str, float]:
    """The shape of an effect that has none."""
    return {}
