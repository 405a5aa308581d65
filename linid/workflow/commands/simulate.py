"""simulate: the free run of a fitted model over recordings, as CSV and figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import DataError, UsageError
from linid.interface.measuring import residual_recordings
from linid.interface.reading import file_record
from linid.report.files import columns_csv_text, finite
from linid.workflow.run import results
from linid.workflow.run.fit_run import announce, begin
from linid.workflow.run.inputs import decisive, fingerprint
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import identity_of, recorded, write_text

if TYPE_CHECKING:
    from linid.diagnosis.gap import Trace
    from linid.identification.result import FitResult
    from linid.interface.results import Fit
    from linid.recording import Recording
    from linid.report.figures.write import Drawing
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "simulate"


@dataclass(frozen=True)
class StartState:
    """Start of the simulation in m and m/s (rotary: rad, rad/s); None: as measured."""

    position: float | None = None
    speed: float | None = None


def simulate(
    request: Request,
    reporter: Reporter,
    *,
    model: Path,
    start: StartState | None = None,
    by_voltage: bool = False,
    controller: Path | None = None,
) -> Outcome:
    """Run a MODEL freely over recordings: simulations/NAME.csv with t, y_measured, y_simulated, v, and figures.

    by_voltage: the phase voltages drive the motor, and the currents that follow are written too; controller: its
    drive's loops drive it, along the commanded positions (closed_loop/NAME.csv).
    Raises ConfigError for the model, DataError or UsageError for the recordings.
    """
    from linid import api
    from linid.identification.model_file import model_to_text

    start = start or StartState()
    fit = api.load(model)
    if controller is not None:
        return _in_closed_loop(request, reporter, fit, (model, controller), start)
    result = fit.result
    campaign = api.read(*request.files, axis_of=fit, unmeasured=by_voltage, **request.settings.given())
    announce(campaign, reporter)
    chosen = _chosen(request, result, campaign.recordings, by_voltage)
    if request.dry_run:
        names = [r.name for r in chosen]
        return Outcome(COMMAND, None, summary={"command": COMMAND, "dry_run": True, "recordings": names})
    more = ["by voltage"] if by_voltage else []
    identity = identity_of(
        COMMAND, fingerprint(chosen), decisive(request.settings), model_to_text(result), str(start), *more
    )
    folder = begin(request, COMMAND, campaign, identity, [file_record(model)])
    with recorded(folder), reporter:
        traces = _runs(fit, chosen, start, by_voltage, request.jobs, reporter)
        rows = _write(traces, folder.path, by_voltage)
        summary = {
            "command": COMMAND,
            "folder": str(folder.path),
            "axis": result.axis,
            "simulations": rows,
            "exit_code": DONE,
        }
        outcome = reporter.show(Outcome(COMMAND, folder.path, DONE, "", (_table(rows, result.axis),), summary))
        results.draw(lambda: _drawings(traces), folder.path, request, reporter)
        folder.end("done", DONE)
    return outcome


def _in_closed_loop(
    request: Request, reporter: Reporter, fit: Fit, files: tuple[Path, Path], start: StartState
) -> Outcome:
    """Run a model in its drive's loops. files: of model and controller."""
    from linid import api
    from linid.identification.model_file import model_to_text
    from linid.simulation.controller import load_controller
    from linid.workflow.commands.closed_loop import closed_loop_table, references, run_closed_loops

    loops = load_controller(files[1])
    campaign = api.read(*request.files, axis_of=fit, **(request.settings.given() | {"find_coast_down": False}))
    announce(campaign, reporter)
    chosen = references(campaign.recordings, ", ".join(str(f) for f in request.files))
    if request.dry_run:
        names = [r.name for r in chosen]
        return Outcome(COMMAND, None, summary={"command": COMMAND, "dry_run": True, "recordings": names})
    more = (decisive(request.settings), model_to_text(fit.result), str(start), loops.model_dump_json())
    identity = identity_of(COMMAND, fingerprint(chosen), *more)
    folder = begin(request, COMMAND, campaign, identity, [file_record(path) for path in files])
    with recorded(folder), reporter:
        rows, drawings = run_closed_loops(fit, chosen, loops, (start.position, start.speed), folder.path)
        axis = fit.result.axis
        summary = {"command": COMMAND, "folder": str(folder.path), "axis": axis, "closed_loop": rows, "exit_code": DONE}
        outcome = Outcome(COMMAND, folder.path, DONE, "", (closed_loop_table(rows, axis),), summary)
        outcome = reporter.show(outcome)
        results.draw(lambda: drawings, folder.path, request, reporter)
        folder.end("done", DONE)
    return outcome


def _runs(
    fit: Fit, chosen: Sequence[Recording], start: StartState, by_voltage: bool, jobs: int, reporter: Reporter
) -> list[Trace]:
    """The free runs of all recordings, side by side."""
    from linid import api
    from linid.parallel_tasks import in_parallel

    def run(recording: Recording, threads: int) -> Trace:
        return api.simulate(
            fit, recording, position=start.position, speed=start.speed, by_voltage=by_voltage, jobs=threads
        )

    stage = "simulations" if by_voltage else "gaps"
    traces: list[Trace] = []
    for _, trace in in_parallel(run, chosen, jobs):
        traces.append(trace)
        reporter.step(stage, len(traces), len(chosen))
    return traces


def _write(traces: Sequence[Trace], folder: Path, by_voltage: bool) -> list[dict[str, object]]:
    """The CSV of each run; what the table and the summary say of them."""
    from linid.report.figures.ahead import free_run_end
    from linid.report.files import file_stems

    rows: list[dict[str, object]] = []
    for trace, stem in zip(traces, file_stems(t.recording for t in traces), strict=True):
        currents = trace.phase_currents if by_voltage else None
        path = write_text(folder / "simulations" / f"{stem}.csv", trace_csv(trace, currents))
        rms = _rms_error(trace)
        end = free_run_end(trace) if trace.measured else None
        left = None if end is None else float(trace.t[end])
        row = {"recording": trace.recording, "file": str(path), "rms_error": finite(rms), "left_at": left}
        rows.append(row | ({} if trace.measured else {"measured": False}))
    return rows


def _chosen(
    request: Request, result: FitResult, recordings: Sequence[Recording], by_voltage: bool
) -> Sequence[Recording]:
    """The recordings that the model can run over; raises DataError where there is none."""
    chosen = _with_voltages(result, recordings) if by_voltage else residual_recordings(recordings, result)
    if not chosen:
        raise DataError(
            ", ".join(str(f) for f in request.files),
            f"holds no recording that a {result.model} model can drive",
            "Give free wheels, or recordings with the channels that the model needs.",
        )
    return chosen


def _with_voltages(result: FitResult, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Driven recordings with phase voltages; raises UsageError where the model knows no windings."""
    if not result.winding:
        raise UsageError(
            "--input voltage", "the model knows no windings", "Identify them: linid fit-motor --input voltage."
        )
    return tuple(r for r in recordings if r.kind != "free_wheel" and r.phase_voltages is not None)


def trace_csv(trace: Trace, currents: Any = None) -> str:
    """CSV of one simulation: t (s), y_measured, y_simulated (m or rad), v (simulated, m/s or rad/s).

    currents: (3, n) A, simulated, for three columns more.
    """
    columns = [trace.t, trace.y_measured, trace.y_simulated, trace.velocity_simulated]
    unit = "rad" if trace.axis == "rotary" else "m"
    names = ["t (s)", f"y_measured ({unit})", f"y_simulated ({unit})", f"v ({unit}/s)"]
    if currents is not None:
        columns += list(currents)
        names += ["i_u (A)", "i_v (A)", "i_w (A)"]
    return columns_csv_text(names, columns, 9)


def _rms_error(trace: Trace) -> float:
    """Of the simulated position, in m or rad; nan where it diverged or nothing was measured."""
    return math.sqrt(float(((trace.y_simulated - trace.y_measured) ** 2).mean()))


def _drawings(traces: Sequence[Trace]) -> list[Drawing]:
    """A figure of each run, an overview of several; the largest error is among the few."""
    from linid.report.figures.comparison import comparison_figure
    from linid.report.figures.overview import overview_figure
    from linid.report.figures.unmeasured import unmeasured_figure
    from linid.report.figures.write import Drawing
    from linid.report.files import file_stems

    def drawing(trace: Trace, stem: str) -> Drawing:
        figure = comparison_figure if trace.measured else unmeasured_figure
        return Drawing(f"simulation_{stem}", lambda: figure(trace), few=trace is worst)

    worst = max(traces, key=lambda trace: (math.isnan(_rms_error(trace)), _rms_error(trace)))
    drawings = [drawing(t, stem) for t, stem in zip(traces, file_stems(t.recording for t in traces), strict=True)]
    measured = [trace for trace in traces if trace.measured]
    overview = [Drawing("overview", lambda: overview_figure(measured), few=True)] if len(measured) > 1 else []
    return overview + drawings


def _table(rows: list[dict[str, object]], axis: str) -> object:
    from rich import box
    from rich.table import Table

    from linid.report.display import display_unit
    from linid.report.numbers import format_number

    table = Table(title="Free runs", title_justify="left", box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    table.add_column("Recording", overflow="fold")
    table.add_column("RMS error", justify="right")
    table.add_column("With the machine", justify="right")
    table.add_column("File", overflow="fold")
    for row in rows:
        rms, left = row["rms_error"], row["left_at"]
        error = "diverged"
        if isinstance(rms, float):
            display = display_unit("position", axis, rms)
            error = f"{format_number(rms * display.factor)} {display.unit}"
        until = f"until {left:.3g} s" if isinstance(left, float) else "to the end"
        if row.get("measured") is False:
            error = until = "not measured"
        table.add_row(str(row["recording"]), error, until, str(row["file"]))
    return table
