"""The figures of the paper's reproduction: file stem -> title and how to draw it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from linid.errors import DataError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import Trace
    from linid.identification.result import FitResult
    from linid.physics.field.geometry import MotorDesign
    from linid.recording import Recording
    from linid.reproduction.evidence import Fitted

    Drawn = tuple[str, Callable[[], Figure]]  # title and how to draw it

# The four cases of motor operation that the paper shows, by the names of the stand's scope modes.
CASES = ("sine_current", "square_current", "sine_position", "moves")


def figures(
    made: MotorDesign,
    fitted: Mapping[str, Fitted],
    traces: Mapping[str, Mapping[str, Trace]],
    recordings: Sequence[Recording],
) -> dict[str, Drawn]:
    """File stem -> title and how to draw it; fitted, traces: by the names of the models, what was measured and run."""
    return {
        **_field_figures(made),
        **_free_wheel_figures(traces["friction"], [r for r in recordings if r.kind == "free_wheel"]),
        **_current_figures(recordings),
        **_operation_figures(fitted, traces, recordings),
        **_narrow_figure(traces),
    }


def _field_figures(made: MotorDesign) -> dict[str, Drawn]:
    from linid.report.figures import magnet_field, sine_scope
    from linid.workflow.commands.field import own_ratios

    return {
        "figure_03_magnet_pair": (
            "Fig. 3: field of a pair of magnets and its Gaussian",
            partial(magnet_field.pair_figure, made),
        ),
        "figure_05_guideway": ("Fig. 5: field of the guideway over k", magnet_field.guideway_figure),
        "figure_06_sine_scope": ("Fig. 6: Delta(k, N) and its zeros", sine_scope.scope_figure),
        "figure_07_theta3": ("Fig. 7: theta function for real z and q", magnet_field.theta3_figure),
        "figure_08_field_shapes": (
            "Fig. 8: shape of the field for some k",
            partial(magnet_field.shapes_figure, own=own_ratios(made, None)),
        ),
    }


def _free_wheel_figures(traces: Mapping[str, Trace], wheels: Sequence[Recording]) -> dict[str, Drawn]:
    from linid.report.figures import free_wheel
    from linid.report.figures.overview import overview_figure

    three = [
        traces[next(r.name for r in wheels if r.added_mass == mass)]
        for mass in sorted({r.added_mass for r in wheels})[:3]
    ]
    return {
        "figure_09_free_wheel_velocity": (
            "Fig. 9: velocity of free wheels with three added masses, differentiated from the position",
            partial(free_wheel.free_wheel_velocity_figure, three),
        ),
        "figure_10_free_wheel_displacement": (
            "Fig. 10: displacement of free wheels with three added masses",
            partial(free_wheel.free_wheel_displacement_figure, three),
        ),
        "figure_11_friction_model": (
            "Fig. 11: resistive force model against the free wheels",
            partial(
                overview_figure,
                [free_wheel.until_rest(traces[r.name]) for r in wheels],
                "Free wheels, long rests cut: measured (blue) and simulated (black) position",
            ),
        ),
    }


def _current_figures(recordings: Sequence[Recording]) -> dict[str, Drawn]:
    from linid.recording.input_course import input_course
    from linid.report.figures.currents import currents_figure

    driven = next(r for r in recordings if r.name.startswith("sine_current") and r.split == "fit")
    currents = driven.phase_currents
    assert currents is not None
    return {
        "figure_12_measured_currents": (
            "Fig. 12: measured currents",
            partial(currents_figure, driven.name, driven.t, currents),
        ),
        "figure_13_interpolated_currents": (
            "Fig. 13: interpolated currents",
            partial(currents_figure, driven.name, driven.t, currents, input_course(driven)),
        ),
    }


def _operation_figures(
    fitted: Mapping[str, Fitted], traces: Mapping[str, Mapping[str, Trace]], recordings: Sequence[Recording]
) -> dict[str, Drawn]:
    """Figures 14 to 17 as the prediction 0.1 s ahead, with the other model beside it, and as the free run."""
    from linid.report.figures.operation import operation_figure
    from linid.report.figures.overview import overview_figure
    from linid.report.reproduction.captions import free_run_caption

    pages = (
        (14, "sine", "fit", "identification"),
        (15, "sine", "held_out", "validation"),
        (16, "theta", "fit", "identification"),
        (17, "theta", "held_out", "validation"),
    )
    drawn: dict[str, Drawn] = {}
    for number, kind, split, purpose in pages:
        other = "theta" if kind == "sine" else "sine"
        names = [next(r.name for r in recordings if r.name.startswith(c) and r.split == split) for c in CASES]
        ours, theirs = ([traces[of][name] for name in names] for of in (kind, other))
        each = "; ".join(free_run_caption(fitted[kind].measured[trace.recording].gap, trace) for trace in ours)
        said = f"Fig. {number}: {kind} model over four cases of operation, {purpose}"
        drawn[f"figure_{number}_{kind}_{purpose}"] = (
            f"{said}; restarted every 0.1 s, {other} model beside it",
            partial(operation_figure, ours, theirs, (kind, other), f"{kind.capitalize()} model, {purpose}"),
        )
        drawn[f"figure_{number}_{kind}_{purpose}_free_run"] = (
            f"{said}; started once, as long as it goes. Of each: {each}",
            partial(
                overview_figure,
                [replace(trace, ahead=None) for trace in ours],
                f"{kind.capitalize()} model, {purpose}: measured (blue) and free run (black)",
            ),
        )
    return drawn


def _narrow_figure(traces: Mapping[str, Mapping[str, Trace]]) -> dict[str, Drawn]:
    from linid.report.figures.overview import overview_figure
    from linid.reproduction.claims import SQUARE

    squares = [
        replace(trace, recording=f"{name.removeprefix('narrow_')}: {trace.recording}")
        for name in ("narrow_sine", "narrow_theta")
        for trace in traces[name].values()
        if trace.recording.startswith(SQUARE)
    ]
    return {
        "figure_narrow_square_waves": (
            "Not in the paper: square-wave currents where the magnets are narrow, 0.1 s ahead",
            partial(overview_figure, squares, "Narrow magnets: measured (blue) and 0.1 s ahead (black)"),
        )
    }


def drawn_in_closed_loop(theta: FitResult, recordings: Sequence[Recording]) -> dict[str, Drawn]:
    """The paper's modes as a user runs them: the model in the loops of a drive like the stand's."""
    from linid.diagnosis.measures import model_of
    from linid.interface.measuring import in_closed_loop
    from linid.report.figures.closed_loop import closed_loop_figure
    from linid.simulation.closed_loop import measured_q_current
    from linid.simulation.controller import Controller

    moves = next(r for r in recordings if r.name.startswith("moves") and r.split == "held_out")
    run = in_closed_loop(theta, moves, Controller())
    current = measured_q_current(model_of(theta)[0], {e.name: e.value for e in theta.estimates}, moves)
    return {
        "figure_closed_loop": (
            "Not in the paper: the theta model in a drive's loops, commanded to where the machine went",
            partial(closed_loop_figure, moves.name, run, moves.axis, measured_current=current),
        )
    }


def drawn_by_voltage(result: FitResult, recordings: Sequence[Recording], files: Sequence[Path]) -> dict[str, Drawn]:
    """Held-out recordings as the phase voltages alone drive the model. Raises DataError where there is none."""
    from linid.interface.measuring import run_by_voltage
    from linid.report.figures.by_voltage import ByVoltage, by_voltage_figure

    cases = []
    for recording in recordings:
        voltages, currents = recording.phase_voltages, recording.phase_currents
        driven = recording.kind == "motor" and recording.split == "held_out"
        if driven and voltages is not None and currents is not None:
            cases.append(ByVoltage(run_by_voltage(result, recording), voltages, currents))
    if not cases:
        raise DataError(
            ", ".join(str(path) for path in files),
            "holds no driven held-out recording with phase voltages and currents",
            "Take the campaign of a stand such as configs/stand_by_voltage.yaml.",
        )
    return {
        "figure_by_voltage": (
            "Not in the paper, whose drive took no voltages: eqs. (31) and (39), phase voltages alone drive the motor",
            partial(by_voltage_figure, cases, "Driven by voltages alone: a free run, held-out recordings"),
        )
    }
