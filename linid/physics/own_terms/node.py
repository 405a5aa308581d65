"""One operation of a formula, and what it acts on."""

from __future__ import annotations

from dataclasses import dataclass

from linid.physics.own_terms import layout


@dataclass(frozen=True)
class Node:
    """One operation of a formula.

    kind: number, variable, parameter, -x, an operator or a function; args: what it acts on; value: of a number, in the
    formula's SI units; name: of a variable or parameter; numbers: those of a curve: low, high, n (and again for the
    second direction) or period, n, SI; first: number of its first coefficient, from 1.
    """

    kind: str
    args: tuple[Node, ...] = ()
    value: float = 0.0
    name: str = ""
    numbers: tuple[float, ...] = ()
    first: int = 0

    @property
    def coefficients(self) -> int:
        """How many coefficients a curve or surface has; 0 for everything else."""
        if self.kind == "spline2":
            return int(self.numbers[2] * self.numbers[5])
        return int(self.numbers[-1]) if self.kind in layout.SPLINES else 0

    @property
    def of_wave(self) -> tuple[str, Node, str] | None:
        """sin or cos, its angle and the parameter's name of a parameter times one of them; None for anything else."""
        if self.kind != "*" or self.args[0].kind != "parameter" or self.args[1].kind not in ("sin", "cos"):
            return None
        return self.args[1].kind, self.args[1].args[0], self.args[0].name

    def walk(self) -> list[Node]:
        """This node and all below it, in the order of the text."""
        return [self, *(inner for one in self.args for inner in one.walk())]
