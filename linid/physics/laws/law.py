"""What a friction law is: its parameters, what it ties, and how its hidden state moves along a travel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from linid.arrays import Array
from linid.physics.parameter import Parameter

MOST_OWN = 4  # parameters of a law besides those of LuGre's
Own = tuple[float, float, float, float]  # their values, 0 where a law has fewer


@dataclass(frozen=True)
class Law:
    """A friction law beside LuGre's, whose parameters it shares but for those named here.

    name: canonical; title: in words; meaning: what it says of friction; own: parameters that LuGre has not; absent:
    names of LuGre's parameters that it has not; tie: sets the absent ones in flat vectors (C, VECTOR_SIZE) in place,
    given where each of LuGre's parameters stands; elements: springs that move on their own, 0 for a single bristle;
    kernel: name of the law whose compiled steps it takes; moved: compiled, for a single bristle: (w, travel, rest,
    breakaway, own) -> w in m after a travel in m, with rest = g/sigma_0 in m, breakaway = F_C/sigma_0 in m; passed: in
    its place, where integrals are known too: the same -> w in m, its mean over the travel, and its mean with a weight
    that grows from 0 to 1; rate:
    compiled, (w, way, rest, breakaway, own) -> dw/dy, its slope by w in 1/m and by the logarithm of rest; shape:
    compiled, of elements: (k, own) -> shares of the sliding force and of the stiffness; source: of the law.
    """

    name: str
    title: str
    meaning: str
    source: str
    own: tuple[Parameter, ...] = ()
    absent: tuple[str, ...] = ()
    tie: Callable[[Array], None] | None = None
    elements: int = 0
    kernel: str = ""
    moved: Any = None
    passed: Any = None
    rate: Any = None
    shape: Any = None

    @property
    def steps(self) -> str:
        """The name of the law whose compiled steps this one takes."""
        return self.kernel or self.name
