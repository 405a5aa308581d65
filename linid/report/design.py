"""A motor by its dimensions on the console: its parameters, harmonics, the scope of the sine, the fit beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from linid.design.comparison import Comparison
    from linid.physics.field.geometry import MotorDesign
    from linid.physics.field.sine_scope import SineCost


def design_tables(
    made: MotorDesign | None, own: float | None, compared: Sequence[Comparison], modelled: bool
) -> tuple[Any, ...]:
    """Tables and sentences on a motor by its dimensions, on the cost of a sine at a k of one's own, and on the
    identified motor beside it.
    """
    from linid.physics.field.sine_scope import PAPER_FIT, limit_k, sine_cost

    tables: list[Any] = []
    if made is not None:
        tables += [_design_table(made), _harmonics_table(made), _shape_text(made), _integrated_text(made)]
        tables.append(_force_text(made))
    if own is not None and (made is None or own != made.k):
        tables.append(_cost_text(sine_cost(own)))
    if own is None:
        tables.append(
            f"A cosine comes nearest to the field of an infinite guideway at k = {limit_k():.5f}; the fit (25) says "
            f"{PAPER_FIT[0]}, for it was made on N up to 100 and its exponential dies out too fast."
        )
    if compared:
        tables.append(_comparison_table(compared))
        tables.append("Force constant and field shape by dimensions are those of the exact field (theta, matched).")
    if made is not None and not modelled:
        tables.append("No MODEL was written: give mass_kg and friction: in the geometry, or --friction MODEL.json.")
    if made is not None:
        tables.append("Halbach arrays and back-iron are outside this model.")
    return tuple(tables)


def _cost_text(cost: SineCost) -> str:
    from linid.physics.field.sine_scope import limit_k

    return (
        f"k = {cost.k:.4g} ({cost.k - limit_k():+.3f} from {limit_k():.5f}): {cost.advice}; a cosine of B_0 misses "
        f"{100.0 * cost.of_cosine:.2g} %."
    )


def _shape_text(made: MotorDesign) -> str:
    return (
        f"Two ratios k = sigma_y / pole pitch: {made.k:.4g} is that of the Gaussian next to one pair of magnets (13), "
        f"which misses the exact field by {100.0 * made.gaussian.rms_error:.2g} %; {made.matched_k:.4g} is that of the "
        "guideway whose third harmonic is the exact thrust's (theta, matched), and the one that a fit finds."
    )


def _integrated_text(made: MotorDesign) -> str:
    from linid.physics.theta import Theta0

    quarter = 0.5 * made.geometry.pole_pitch
    thrust, voltage = made.integrated(quarter)
    theta = made.theta
    angle = theta["electrical_wavenumber"] * quarter
    closed = theta["force_constant"] * float(Theta0(angle, theta["nome"], theta["winding_length"]))
    return (
        f"Between two magnets, in the guideway of Gaussians: {thrust:.5g} N/A integrated along the wires (2), "
        f"{voltage:.5g} V s/m from the flux through the turns (4), {closed:.5g} by theta (38): one number."
    )


def _force_text(made: MotorDesign) -> str:
    from linid.physics.field.sine_scope import advise
    from linid.physics.field.winding import ripple_share

    one, balanced = (ripple_share(made.exact, balanced=which) for which in (False, True))
    said = advise("of a winding's thrust in the exact field a sine misses", one, balanced)
    return f"A sine or theta: {said}."


def _design_table(made: MotorDesign) -> Any:
    from linid.report.tables import console_table

    g = made.gaussian
    table = console_table(f"Motor by its dimensions, {made.geometry.name}")
    for title in ("Quantity", "Symbol", "Value", "Unit", "Equation"):
        table.add_column(title, justify="right" if title == "Value" else "left", no_wrap=True)
    rows = [
        ("magnet's peak field", "B_0", f"{g.peak:.4g}", "T", "13"),
        ("width across", "sigma_x", f"{1e3 * g.sigma_x:.4g}", "mm", "13"),
        ("width along", "sigma_y", f"{1e3 * g.sigma_y:.4g}", "mm", "13"),
        ("error of the Gaussian, RMS", "", f"{100 * g.rms_error:.2g}", "% of peak", "13"),
        ("field shape, Gaussian of a pair", "k", f"{made.k:.4g}", "", "17"),
        ("nome, Gaussian of a pair", "q_0", f"{made.nome:.4g}", "", "35"),
        ("field shape, theta, matched", "k", f"{made.matched_k:.4g}", "", "17"),
        ("nome, theta, matched", "q_0", f"{made.matched['nome']:.4g}", "", "35"),
        ("sine force constant", "K_f", f"{made.sine['force_constant']:.4g}", "N/A", "30"),
        ("theta force constant", "K_f'", f"{made.theta['force_constant']:.4g}", "N/A", "38"),
        ("electrical wavenumber", "omega_g", f"{made.sine['electrical_wavenumber']:.4g}", "1/m", "32"),
        ("electrical wavenumber", "z_0", f"{made.theta['electrical_wavenumber']:.4g}", "1/m", "35"),
        ("winding displacement", "alpha_p", f"{made.sine['winding_displacement']:.4g}", "rad", "32"),
        ("winding displacement", "z_p", f"{made.theta['winding_displacement']:.4g}", "rad", "38"),
        ("winding length", "z_L", f"{made.theta['winding_length']:.4g}", "rad", "37"),
    ]
    for row in rows:
        table.add_row(*row)
    return table


def _harmonics_table(made: MotorDesign) -> Any:
    from linid.physics.field.winding import theta_harmonic
    from linid.report.tables import console_table

    table = console_table("Harmonics of the thrust over the current, N/A")
    for title in ("Order", "Exact field", "Theta (38)", "Theta, matched"):
        table.add_column(title, justify="right")
    for n in (1, 3, 5, 7):
        row = [
            theta["force_constant"] * theta_harmonic(n, theta["nome"], theta["winding_length"])
            for theta in (made.theta, made.matched)
        ]
        table.add_row(str(n), f"{made.exact[n]:.4g}", *(f"{x:.4g}" for x in row))
    return table


def _comparison_table(compared: Sequence[Comparison]) -> Any:
    from linid.report.tables import console_table

    table = console_table("Recording beside dimensions")
    for title in ("Quantity", "Dimensions", "Identified", "95 % interval", "Unit", "Agrees"):
        table.add_column(title, justify="left" if title in ("Quantity", "Unit", "Agrees") else "right", overflow="fold")
    for one in compared:
        agrees = "not told" if one.agrees is None else "yes" if one.agrees else "no"
        interval = "-" if one.agrees is None else f"{one.low:.5g} to {one.high:.5g}"
        table.add_row(one.name, f"{one.by_dimensions:.5g}", f"{one.identified:.5g}", interval, one.unit, agrees)
    return table
