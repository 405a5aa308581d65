"""A formula as a sum of products: which of them are friction, and in which parameters they are linear."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import groupby, product

from linid.errors import ConfigError
from linid.physics.own_terms.node import Node

MOST_SUMMANDS = 64
SCALE = "scale"  # the parameter of what has no amplitude of its own


@dataclass(frozen=True)
class Summand:
    """A product. sign: 1 or -1; factors, divisors: what is multiplied and divided by; friction: whether it is a level
    of friction, a force without its factor sign(v) and turned, or a force on the mass."""

    sign: int
    factors: tuple[Node, ...]
    divisors: tuple[Node, ...] = ()
    friction: bool = False

    @property
    def node(self) -> Node:
        """The product as a tree."""
        out = self.factors[0] if self.factors else Node("number", value=1.0)
        for one in self.factors[1:]:
            out = Node("*", (out, one))
        for one in self.divisors:
            out = Node("/", (out, one))
        return Node("-x", (out,)) if self.sign < 0 else out


def summands_of(tree: Node, place: str) -> tuple[Summand, ...]:
    """The products whose sum a formula is; raises ConfigError for too many of them.

    place: what the error names first.
    """
    found = _expanded(tree, place)
    return tuple(_as_friction(one) for one in found)


def sum_of(summands: Sequence[Summand]) -> Node:
    """The tree of a sum; a first factor that neighbours share is multiplied once."""
    nodes = []
    for _, group in groupby(summands, key=lambda one: one.factors[:1]):
        some = list(group)
        if len(some) > 1 and some[0].factors:
            rest = sum_of([replace(one, factors=one.factors[1:]) for one in some])
            nodes.append(Node("*", (some[0].factors[0], rest)))
        else:
            nodes += [one.node for one in some]
    return reduce(lambda a, b: Node("+", (a, b)), _with_waves(nodes))


def _with_waves(nodes: Sequence[Node]) -> list[Node]:
    """The nodes of a sum, a sine and a cosine of the same angle that are neighbours added first: they are one wave."""
    out: list[Node] = []
    for node in nodes:
        one, last = node.of_wave, out[-1].of_wave if out else None
        if one and last and one[1] == last[1]:
            out[-1] = Node("+", (out[-1], node))
        else:
            out.append(node)
    return out


def _expanded(node: Node, place: str) -> list[Summand]:
    if node.kind == "-x":
        return [_turned(one) for one in _expanded(node.args[0], place)]
    if node.kind in ("+", "-"):
        second = _expanded(node.args[1], place)
        out = _expanded(node.args[0], place) + ([_turned(x) for x in second] if node.kind == "-" else second)
    elif node.kind == "*":
        sides = ([Summand(1, (one,))] if _is_fixed(one) else _expanded(one, place) for one in node.args)
        out = [Summand(a.sign * b.sign, a.factors + b.factors, a.divisors + b.divisors) for a, b in product(*sides)]
    elif node.kind == "/":
        above = _expanded(node.args[0], place)
        out = [Summand(a.sign, a.factors, (*a.divisors, node.args[1])) for a in above]
    else:
        out = [Summand(1, (node,))]
    if len(out) > MOST_SUMMANDS:
        raise ConfigError(place, f"is a sum of more than {MOST_SUMMANDS} products", "Simplify the formula.")
    return out


def _turned(one: Summand) -> Summand:
    return Summand(-one.sign, one.factors, one.divisors)


def _is_fixed(node: Node) -> bool:
    """Whether a factor has neither parameters nor a direction: nothing is told by expanding it."""
    return not any(_bare(inner) or _is_direction(inner) for inner in node.walk())


def _is_direction(node: Node) -> bool:
    return node.kind == "sign" and node.args[0] == Node("variable", name="v")


def _as_friction(one: Summand) -> Summand:
    """A product with the factor sign(v) as a level of friction, which opposes the motion; others as they are."""
    at = next((k for k, node in enumerate(one.factors) if _is_direction(node)), None)
    if at is None:
        return one
    return Summand(-one.sign, one.factors[:at] + one.factors[at + 1 :], one.divisors, friction=True)


def amplitudes_of(summands: tuple[Summand, ...], given: frozenset[str], place: str) -> tuple[str, ...]:
    """Names of the parameters in which the sum is linear, all together; coefficients of curves are theirs by number.

    given: parameters with a range of their own. Raises ConfigError for a parameter that is neither linear nor given,
    and for one that multiplies another.
    """
    occurrences = _count(name for one in summands for node in (*one.factors, *one.divisors) for name in _names(node))
    linear = {name for one in summands for node in one.factors for name in _bare(node)}
    linear = {name for name in linear if occurrences[name] == sum(name in _all_bare(one) for one in summands)}
    for one in summands:
        together = [node for node in one.factors if set(_bare(node)) & linear]
        free = [node for node in together if not set(_bare(node)) & given]
        if len(free) > 1:
            names = " and ".join(_label(node) for node in free[:2])
            raise ConfigError(
                place, f"multiplies {names} by each other", "Leave one out, or give one of them a range: p in [1, 3]."
            )
        if len(together) > 1:
            keep = free or together[:1]
            linear -= {name for node in together if node not in keep for name in _bare(node)}
    for name in occurrences:
        if name not in linear and name not in given:
            what = "a curve" if name.isdigit() else f"the parameter {name}"
            remedy = (
                "Let curves be factors of a sum's products." if name.isdigit() else f"Add its range: {name} in [1, 3]."
            )
            raise ConfigError(place, f"is not linear in {what}, which has no range", remedy)
    return tuple(name for name in occurrences if name in linear)


def has_amplitude(one: Summand, amplitudes: tuple[str, ...]) -> bool:
    """Whether a product has a factor that is an amplitude."""
    return any(set(_bare(node)) & set(amplitudes) for node in one.factors)


def _names(node: Node) -> Iterator[str]:
    """Parameters in a tree, each as often as it occurs; coefficients of curves by number."""
    for inner in node.walk():
        yield from _bare(inner)


def _bare(node: Node) -> tuple[str, ...]:
    """The parameters that a factor is by itself: one, or the coefficients of a curve."""
    if node.kind == "parameter":
        return (node.name,)
    return tuple(str(node.first + k) for k in range(node.coefficients))


def _all_bare(one: Summand) -> list[str]:
    return [name for node in one.factors for name in _bare(node)]


def _label(node: Node) -> str:
    return f"a {node.kind}" if node.coefficients else node.name


def _count(names: Iterator[str]) -> dict[str, int]:
    out: dict[str, int] = {}
    for name in names:
        out[name] = out.get(name, 0) + 1
    return out
