"""Units of the amplitudes of a formula, as far as powers of its variables decide them."""

from __future__ import annotations

from linid.physics.own_terms.node import Node

# Powers of m, s and N.
_VARIABLES = {
    "t": (0.0, 1.0, 0.0),
    "T": (0.0, 1.0, 0.0),
    "y": (1.0, 0.0, 0.0),
    "v": (1.0, -1.0, 0.0),
    "F": (0.0, 0.0, 1.0),
    "travel": (1.0, 0.0, 0.0),
    "since_reversal": (0.0, 1.0, 0.0),
    "rest": (0.0, 1.0, 0.0),
    "slid": (1.0, 0.0, 0.0),
    "acceleration": (1.0, -2.0, 0.0),
    "stribeck": (0.0, 0.0, 0.0),
}
_PLAIN = (0.0, 0.0, 0.0)
_SAME = ("-x", "abs", "+", "-", "min", "max")
Powers = tuple[float, float, float]


def amplitude_unit(factors: tuple[Node, ...], divisors: tuple[Node, ...]) -> str:
    """SI unit of what multiplies these factors and is divided by these divisors to give N; "SI" where a parameter with
    a unit of its own hides it."""
    total: Powers | None = (0.0, 0.0, 1.0)
    for node, sign in [*((one, -1.0) for one in factors), *((one, 1.0) for one in divisors)]:
        powers = _powers(node)
        total = None if total is None or powers is None else _sum(total, powers, sign)
    return "SI" if total is None else _written(total)


def _powers(node: Node) -> Powers | None:
    """Powers of m, s and N in the unit of a tree; None where they are not known."""
    if node.kind == "parameter":
        return None
    if node.kind == "variable":
        return _VARIABLES[node.name]
    args = [_powers(one) for one in node.args]
    if node.kind in ("*", "/"):
        first, second = args
        return None if first is None or second is None else _sum(first, second, 1.0 if node.kind == "*" else -1.0)
    if node.kind == "sqrt" or (node.kind == "**" and node.args[1].kind == "number"):
        power = 0.5 if node.kind == "sqrt" else node.args[1].value
        return None if args[0] is None else _sum(_PLAIN, args[0], power)
    if node.kind == "**":
        return _PLAIN if args[0] == _PLAIN else None
    if node.kind in _SAME:
        known = [x for x, one in zip(args, node.args, strict=True) if one.kind != "number"]
        return known[0] if known and all(x == known[0] for x in known) else (None if known else _PLAIN)
    return _PLAIN  # sines, curves and the like


def _sum(a: Powers, b: Powers, factor: float) -> Powers:
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


def _written(powers: Powers) -> str:
    named = list(zip(("N", "s", "m"), (powers[2], powers[1], powers[0]), strict=True))
    above = [_one(name, power) for name, power in named if power > 0.0]
    below = [_one(name, -power) for name, power in named if power < 0.0]
    under = f"({' '.join(below)})" if len(below) > 1 else "".join(below)
    return (" ".join(above) or "1") + (f"/{under}" if below else "")


def _one(name: str, power: float) -> str:
    return name if power == 1.0 else f"{name}^{power:g}"
