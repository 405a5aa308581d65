"""field: the motor model from the dimensions of its magnets and coils, and the scope of the sine model."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from linid.errors import UsageError
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import file_record, identity_of, open_run_folder, recorded, write_text

if TYPE_CHECKING:
    from linid.design.comparison import Comparison
    from linid.identification.result import FitResult
    from linid.physics.field.geometry import MotorDesign, MotorGeometry
    from linid.physics.field.sine_scope import SineCost
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "field"
SCHEMA = 1
_NUMBERS = (1, 2, 5, 10, 20, 50, 100, 1000, 10_000)
_KINDS: tuple[Literal["sine"], Literal["theta"]] = ("sine", "theta")


def field(
    request: Request,
    reporter: Reporter,
    *,
    geometry: MotorGeometry | None,
    k: float | None = None,
    model: Path | None = None,
    friction: Path | None = None,
) -> Outcome:
    """The field of a motor by its dimensions: parameters, curves and figures.

    geometry: None for the general part alone (what a sine costs over k); k: sigma_y / pole pitch to judge, instead of
    the geometry's or model's; model: a fitted sine or theta MODEL to be laid beside the dimensions; friction: MODEL
    whose friction and mass complete the designed model. Raises UsageError, ConfigError.
    """
    from linid.design.comparison import against_dimensions
    from linid.identification.model_file import load_model, model_to_text
    from linid.physics.field.geometry import design

    identified = None if model is None else _motor_model(model)
    if identified is not None and geometry is None and identified.model != "theta" and k is None:
        raise UsageError("--model", "is a sine model, which knows no k", "Give the dimensions too, or a theta model.")
    if k is not None and k <= 0.0:
        raise UsageError("--k", f"is {k:g}, must be above zero", "Give sigma_y / pole pitch, such as 0.4.")
    rest = {} if friction is None else _friction(load_model(friction), friction)
    if request.dry_run:
        return Outcome(COMMAND, None, summary={"command": COMMAND, "dry_run": True})
    folder = open_run_folder(COMMAND, request.out, overwrite=request.overwrite)
    described = {} if geometry is None else geometry.model_dump(mode="json", exclude_none=True)
    inputs = [file_record(path) for path in (*request.files, model, friction) if path is not None]
    text = "# linid field\n" + json.dumps(described, indent=1) + "\n"
    folder.begin(identity=identity_of(COMMAND, described, k), config=text, inputs=inputs, seed=None, jobs=1)
    with recorded(folder), reporter:
        reporter.step("field", 0, 3)
        made = None if geometry is None else design(geometry)
        own = k if k is not None else _own_k(made, identified)
        compared = against_dimensions(identified, made) if identified is not None and made is not None else ()
        reporter.step("field", 1, 3)
        data = _data(made, own, compared)
        write_text(folder.path / "field.json", json.dumps(data, indent=1, allow_nan=False) + "\n")
        write_text(folder.path / "best_k.csv", _csv(("N", "k_N"), _best_k()))
        models = []
        if made is not None:
            write_text(folder.path / "parameters.csv", _csv(("model", "name", "value", "unit"), _parameters(made)))
            write_text(folder.path / "guideway_field.csv", _csv(_GUIDEWAY, _guideway(made)))
            write_text(folder.path / "thrust.csv", _csv(_THRUST, _thrust(made)))
            rest = _given(made.geometry) | rest
            for kind in _KINDS if rest else ():
                path = folder.path / f"model_{kind}.json"
                models.append(str(write_text(path, model_to_text(_designed(made, kind, rest)))))
        reporter.step("field", 2, 3)
        if request.settings.figures:
            _figures(folder.path / "figures", request.settings.figure_formats, made, own, identified)
        reporter.step("field", 3, 3)
        folder.end("done", DONE)
    summary = {"command": COMMAND, "folder": str(folder.path), **data, "models": models, "exit_code": DONE}
    tables = _tables(made, own, compared, bool(models))
    return Outcome(COMMAND, folder.path, DONE, "" if own is None else f"k = {own:.4g}", tables, summary)


def _motor_model(path: Path) -> FitResult:
    from linid.identification.model_file import load_model
    from linid.physics.motors import MOTORS

    result = load_model(path)
    if not MOTORS[result.model].phases:
        raise UsageError(
            "--model", f"is a {result.model} model, which knows no field", "Give the MODEL.json of a sine or theta fit."
        )
    if result.axis != "linear":
        raise UsageError("--model", "is of a rotary axis", "The field is that of a linear guideway.")
    return result


def _friction(result: FitResult, path: Path) -> dict[str, float]:
    from linid.physics.friction import PARAMETERS

    if result.per_mass:
        raise UsageError(f"--friction {path}", "has forces per kilogram only", "Fit it with a known mass.")
    return {p.name: result.value(p.name) for p in PARAMETERS}


def _given(geometry: MotorGeometry) -> dict[str, float]:
    """Mass and friction as far as the geometry gives them."""
    values = {} if geometry.friction is None else geometry.friction.values
    return values | ({} if geometry.mass_kg is None else {"mass": geometry.mass_kg})


def _designed(made: MotorDesign, kind: Literal["sine", "theta"], rest: dict[str, float]) -> FitResult:
    from linid.design.model import designed_model

    return designed_model(made, kind, rest)


def _own_k(made: MotorDesign | None, identified: FitResult | None) -> float | None:
    if made is not None:
        return made.k
    if identified is None:
        return None
    return next(e.value for e in identified.derived if e.name == "field_shape")


def _best_k() -> Iterator[tuple[float, ...]]:
    from linid.physics.field.sine_scope import best_k

    return ((float(n), best_k(n)) for n in _NUMBERS)


_GUIDEWAY = ("y_m", "exact_t", "gaussian_t", "cosine_t")
_THRUST = ("y_m", "exact_n_per_a", "theta_n_per_a", "theta_matched_n_per_a", "sine_n_per_a")
_SAMPLES = 201


def _guideway(made: MotorDesign) -> Iterator[tuple[float, ...]]:
    """Field along two pole pitches in the middle of the guideway."""
    import numpy as np

    from linid.physics.field.guideway import magnet_harmonics, theta_guideway

    orders = range(1, 20, 2)
    pitch = made.geometry.pole_pitch
    amplitudes = magnet_harmonics(made.geometry.pair, pitch, 0.0, tuple(orders))[0]
    y = np.linspace(-pitch, pitch, _SAMPLES)
    exact = np.cos(np.pi / pitch * np.outer(y, orders)) @ amplitudes
    gaussian = made.gaussian.peak * theta_guideway(y / pitch, made.k)
    cosine = made.gaussian.peak * np.cos(np.pi * y / pitch)
    return (tuple(map(float, row)) for row in zip(y, exact, gaussian, cosine, strict=True))


def _thrust(made: MotorDesign) -> Iterator[tuple[float, ...]]:
    """Thrust over current of the middle winding along two pole pitches."""
    import numpy as np

    from linid.physics.theta import Theta0

    pitch = made.geometry.pole_pitch
    y = np.linspace(0.0, 2.0 * pitch, _SAMPLES)
    exact = sum(a * np.sin(n * np.pi * y / pitch) for n, a in made.exact.items())
    shapes = [
        theta["force_constant"] * Theta0(theta["guideway_density"] * y, theta["nome"], theta["winding_length"])
        for theta in (made.theta, made.matched)
    ]
    sine = made.exact[1] * np.sin(np.pi * y / pitch)
    return (tuple(map(float, row)) for row in zip(y, np.asarray(exact), *shapes, sine, strict=True))


def _parameters(made: MotorDesign) -> Iterator[tuple[str, str, float, str]]:
    from linid.physics.motors import MOTORS

    for name, kind, values in (
        ("sine", "sine", made.sine),
        ("theta", "theta", made.theta),
        ("theta, matched", "theta", made.matched),
    ):
        for parameter in MOTORS[kind].parameters:
            yield name, parameter.name, values[parameter.name], parameter.unit


def _csv(header: Sequence[str], rows: Iterator[tuple[Any, ...]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([f"{x:.12g}" if isinstance(x, float) else x for x in row] for row in rows)
    return stream.getvalue()


def _data(made: MotorDesign | None, own: float | None, compared: Sequence[Comparison]) -> dict[str, Any]:
    """The content of field.json, SI."""
    import math
    from dataclasses import asdict

    from linid.physics.field.sine_scope import PAPER_FIT, fit_of_best_k, limit_k, sine_cost
    from linid.physics.field.winding import ripple_share

    data: dict[str, Any] = {
        "schema": SCHEMA,
        "kind": "linid field",
        "sine_scope": {"limit_k": limit_k(), "fit": fit_of_best_k(range(1, 101)), "paper_fit": PAPER_FIT},
    }
    if own is not None:
        cost = sine_cost(own)
        data["sine_cost"] = {**asdict(cost), "advice": cost.advice}
    if made is not None:
        data["geometry"] = made.geometry.model_dump(mode="json", exclude_none=True)
        data["gaussian"] = asdict(made.gaussian)
        data |= {"k": made.k, "nome": made.nome, "magnitude": made.magnitude, "sine": made.sine, "theta": made.theta}
        data["theta_matched"] = made.matched
        data["best_sine_constant"] = made.best_sine_constant
        data["exact_thrust_harmonics"] = {str(n): a for n, a in made.exact.items()}
        data["sine_force_error"] = {
            "one_winding": ripple_share(made.exact, balanced=False),
            "balanced_currents": ripple_share(made.exact, balanced=True),
        }
    if compared:
        data["identified"] = [
            {key: None if isinstance(x, float) and not math.isfinite(x) else x for key, x in asdict(one).items()}
            for one in compared
        ]
    return data


def _figures(
    folder: Path, formats: Sequence[str], made: MotorDesign | None, own: float | None, identified: FitResult | None
) -> None:
    from linid.report.figures import magnet_field, sine_scope
    from linid.report.style import save

    drawn = {
        "guideway": magnet_field.guideway_figure(),
        "sine_scope": sine_scope.scope_figure(),
        "sine_cost": sine_scope.cost_figure(own),
        "theta3": magnet_field.theta3_figure(),
        "field_shapes": magnet_field.shapes_figure(own=own),
    }
    if made is not None:
        values = None if identified is None else {e.name: e.value for e in identified.estimates}
        drawn["magnet_pair"] = magnet_field.pair_figure(made)
        drawn["thrust"] = magnet_field.thrust_figure(made, values, "" if identified is None else identified.model)
    for stem, figure in drawn.items():
        save(figure, folder / stem, formats)


def _tables(
    made: MotorDesign | None, own: float | None, compared: Sequence[Comparison], modelled: bool
) -> tuple[Any, ...]:
    from linid.physics.field.sine_scope import PAPER_FIT, limit_k, sine_cost

    tables: list[Any] = []
    if made is not None:
        tables += [_design_table(made), _harmonics_table(made)]
    if own is not None:
        tables.append(_cost_text(sine_cost(own)))
    if made is not None:
        tables.append(_force_text(made))
    if own is None:
        tables.append(
            f"A cosine comes nearest to the field of an infinite guideway at k = {limit_k():.5f}; the fit (25) says "
            f"{PAPER_FIT[0]}, for it was made on N up to 100 and its exponential dies out too fast."
        )
    if compared:
        tables.append(_comparison_table(compared))
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


def _force_text(made: MotorDesign) -> str:
    from linid.physics.field.sine_scope import NEGLIGIBLE
    from linid.physics.field.winding import ripple_share

    one, balanced = (ripple_share(made.exact, balanced=which) for which in (False, True))
    advice = "sine will do" if one < NEGLIGIBLE else "take theta, unless" if balanced < NEGLIGIBLE else "take theta"
    advice += " the currents always sum to zero" if advice.endswith("unless") else ""
    return (
        f"In the exact field a sine misses {100.0 * one:.2g} % of a winding's thrust, and {100.0 * balanced:.2g} % of "
        f"the motor's under currents that sum to zero: {advice}."
    )


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
        ("field shape", "k", f"{made.k:.4g}", "", "17"),
        ("nome", "q_0", f"{made.nome:.4g}", "", "35"),
        ("sine force constant", "K_f", f"{made.sine['force_constant']:.4g}", "N/A", "30"),
        ("theta force constant", "K_f'", f"{made.theta['force_constant']:.4g}", "N/A", "38"),
        ("guideway density", "omega_g", f"{made.sine['guideway_density']:.4g}", "1/m", "32"),
        ("guideway density", "z_0", f"{made.theta['guideway_density']:.4g}", "1/m", "35"),
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
