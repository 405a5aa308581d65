"""field: the motor model from the dimensions of its magnets and coils, and the scope of the sine model."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from linid.errors import UsageError
from linid.interface.reading import file_record
from linid.report.files import csv_text, finite
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import identity_of, open_run_folder, recorded, write_text

if TYPE_CHECKING:
    from linid.design.comparison import Comparison
    from linid.identification.result import FitResult
    from linid.physics.field.geometry import MotorDesign, MotorGeometry
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "field"
SCHEMA = 1
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
    from linid.design import curves
    from linid.design.comparison import against_dimensions
    from linid.identification.model_file import load_model
    from linid.physics.field.geometry import design
    from linid.report.design import design_tables

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
        own = k if k is not None else next(iter(own_ratios(made, identified).values()), None)
        compared = against_dimensions(identified, made) if identified is not None and made is not None else ()
        reporter.step("field", 1, 3)
        data = _data(made, own, compared)
        write_text(folder.path / "field.json", json.dumps(data, indent=1, allow_nan=False) + "\n")
        write_text(folder.path / "best_k.csv", csv_text(("N", "k_N"), curves.best_k_rows()))
        models: list[str] = []
        if made is not None:
            models = _write_design(folder.path, made, rest)
        reporter.step("field", 2, 3)
        if request.settings.figures != "none":
            shown = {"given": k} if k is not None else own_ratios(made, identified)
            _figures(folder.path / "figures", request.settings.figure_formats, made, shown, identified)
        reporter.step("field", 3, 3)
        folder.end("done", DONE)
    summary = {"command": COMMAND, "folder": str(folder.path), **data, "models": models, "exit_code": DONE}
    tables = design_tables(made, own, compared, bool(models))
    return Outcome(COMMAND, folder.path, DONE, _headline(made, own), tables, summary)


def _headline(made: MotorDesign | None, own: float | None) -> str:
    if made is not None:
        return f"k = {made.k:.4g} (Gaussian of a pair), {made.matched_k:.4g} (theta, matched)"
    return "" if own is None else f"k = {own:.4g}"


def _write_design(folder: Path, made: MotorDesign, rest: dict[str, float]) -> list[str]:
    """Parameters and curves of a designed motor; with mass and friction also its models, whose paths are returned."""
    from linid.design import curves
    from linid.identification.model_file import model_to_text

    for name, header, rows in (
        ("parameters", ("model", "name", "value", "unit"), curves.parameter_rows(made)),
        ("guideway_field", curves.GUIDEWAY_COLUMNS, curves.guideway_rows(made)),
        ("thrust", curves.THRUST_COLUMNS, curves.thrust_rows(made)),
    ):
        write_text(folder / f"{name}.csv", csv_text(header, rows))
    rest = _given(made.geometry) | rest
    return [
        str(write_text(folder / f"model_{kind}.json", model_to_text(_designed(made, kind, rest))))
        for kind in (_KINDS if rest else ())
    ]


def _motor_model(path: Path) -> FitResult:
    from linid.identification.model_file import load_model
    from linid.physics.motors.registry import MOTORS

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


def own_ratios(made: MotorDesign | None, identified: FitResult | None) -> dict[str, float]:
    """The ratios k = sigma_y / pole pitch (17) of a motor, by what they are of: the dimensions', else the fit's."""
    if made is not None:
        return {"Gaussian of a pair": made.k, "theta, matched": made.matched_k}
    if identified is None:
        return {}
    return {"identified": next(e.value for e in identified.derived if e.name == "field_shape")}


def _data(made: MotorDesign | None, own: float | None, compared: Sequence[Comparison]) -> dict[str, Any]:
    """The content of field.json, SI."""
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
        data |= {
            "k": made.k,
            "k_matched": made.matched_k,
            "nome": made.nome,
            "magnitude": made.magnitude,
            "sine": made.sine,
            "theta": made.theta,
        }
        data["theta_matched"] = made.matched
        data["best_sine_constant"] = made.best_sine_constant
        data["exact_thrust_harmonics"] = {str(n): a for n, a in made.exact.items()}
        data["sine_force_error"] = {
            "one_winding": ripple_share(made.exact, balanced=False),
            "balanced_currents": ripple_share(made.exact, balanced=True),
        }
    if compared:
        data["identified"] = [finite(asdict(one)) for one in compared]
    return data


def _figures(
    folder: Path, formats: Sequence[str], made: MotorDesign | None, own: dict[str, float], identified: FitResult | None
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
