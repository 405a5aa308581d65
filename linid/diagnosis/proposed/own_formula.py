"""Formulas of the dictionary as own terms of a model: `c_1 * ...`, with their other numbers put in."""

from __future__ import annotations

from linid.arrays import Array
from linid.diagnosis.proposed.shapes import Variable, narrow, slowest_wave, softness


def own_shape(name: str, x: Variable, theta: Array) -> tuple[str, ...]:
    """The columns of a shape as formulas in own terms' variables; theta: (q,) in units of x; empty where x has no
    name there."""
    s = x.code
    if not s:
        return ()
    if name.endswith("waves"):
        angles = [f"{max(float(k), slowest_wave(x)):.10g}*{s}" for k in theta]
        return tuple(f"{wave}({angle})" for angle in angles for wave in ("cos", "sin"))
    if name.startswith("power "):
        power = float(name.removeprefix("power "))
        size = s if s.startswith("abs(") else f"abs({s})"
        return (f"sqrt({size})" if power == 0.5 else size if power == 1.0 else f"{size}**{power:g}",)
    if name.startswith("odd "):
        return (f"{s}*abs({s})**{float(name.removeprefix('odd ')) - 1.0:g}",)
    if name == "linear":
        return s, "1"
    return (_shaped(name, x, [float(number) for number in theta]),)


def _shaped(name: str, x: Variable, theta: list[float]) -> str:
    """A shape of one column with numbers of its own."""
    s, first = x.code, f"{theta[0]:.10g}"
    if name in ("bump", "pull to a place"):
        u = f"(({s} - {first})/{narrow(x, theta[1]):.10g})"
        bell = f"exp(-0.5*{u}**2)"
        return f"{u}*{bell}" if name != "bump" else bell
    if name in ("step", "switch"):
        inside = s if name == "step" else f"abs({s})"
        gate = gated(inside, theta[0], softness(x))
        return gate if name == "step" else f"sign({s})*{gate}"
    simple = {
        "saturating": f"{s}/({s} + {first})",
        "logarithm": f"log(1 + {s}/{first})",
        "critical": f"2*({s}/{first})/(1 + ({s}/{first})**2)",
        "decay": f"exp(-max({s} - {x.low if x.ends else 0.0:.10g}, 0)/{first})",
        "rise": f"exp(-max({x.high:.10g} - {s}, 0)/{first})",
        "beyond": f"sign({s})*max(abs({s}) - {first}, 0)",
    }
    if name == "bend":
        return f"tanh(({s} - {first})/{theta[1]:.10g})"
    return simple[name]


def gated(inside: str, limit: float, soft: float) -> str:
    """A step of a formula at a limit, smeared; limit, soft: in its unit."""
    return f"(0.5 + 0.5*tanh(({inside} - {limit:.10g})/{2.0 * soft:.10g}))"


def summed(columns: tuple[str, ...], factor: str = "") -> str:
    """Columns with amplitudes c_1, c_2 ..., each times a factor; empty where there are none."""
    behind = f"*{factor}" if factor else ""
    return " + ".join(f"c_{k}*{column}{behind}" for k, column in enumerate(columns, 1))
