"""simulate: the free run of a fitted model over recordings, as CSV and figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import DataError, UsageError
from linid.report.files import csv_text, finite
from linid.workflow.run import results
from linid.workflow.run.fit_run import announce, begin, measure
from linid.workflow.run.inputs import fingerprint, read_inputs
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import file_record, identity_of, recorded, write_text
from linid.workflow.run.stage import decisive

if TYPE_CHECKING:
    from linid.diagnosis.gap import Trace
    from linid.identification.result import FitResult
    from linid.recording import Recording
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "simulate"


@dataclass(frozen=True)
class StartState:
    """Start of the simulation in m and m/s (rotary: rad, rad/s); None: as measured."""

    position: float | None = None
    speed: float | None = None

    @property
    def measured(self) -> bool:
        """Whether nothing is given."""
        return self.position is None and self.speed is None


def simulate(
    request: Request, reporter: Reporter, *, model: Path, start: StartState | None = None, by_voltage: bool = False
) -> Outcome:
    """Run a MODEL freely over recordings: simulations/NAME.csv with t, y_measured, y_simulated, v, and a figure each.

    by_voltage: the phase voltages drive the motor, and the currents that follow are written too.
    Raises ConfigError for the model, DataError or UsageError for the recordings.
    """
    from linid.diagnosis.voltage_run import voltage_driven
    from linid.identification.model_file import load_model, model_to_text
    from linid.report.figures.ahead import free_run_end
    from linid.report.files import file_stems

    start = start or StartState()
    result = load_model(model)
    inputs = read_inputs(request.files, request.settings, axis=result.axis)
    announce(inputs, reporter)
    chosen = _chosen(request, result, inputs.recordings, by_voltage)
    if request.dry_run:
        names = [r.name for r in chosen]
        return Outcome(COMMAND, None, summary={"command": COMMAND, "dry_run": True, "recordings": names})
    more = ["by voltage"] if by_voltage else []
    identity = identity_of(
        COMMAND, fingerprint(chosen), decisive(request.settings), model_to_text(result), str(start), *more
    )
    folder = begin(request, COMMAND, inputs, identity, [file_record(model)])
    rows = []
    with recorded(folder), reporter:
        traces: tuple[Trace, ...] = ()
        if not by_voltage:
            _, traces = measure(result, chosen, reporter, jobs=request.jobs, seed=request.settings.seed, strict=True)
        for number, (recording, stem) in enumerate(zip(chosen, file_stems(r.name for r in chosen), strict=True)):
            currents = None
            if by_voltage:
                shown, currents = voltage_driven(result, recording, start.position, start.speed)
                reporter.step("simulations", number + 1, len(chosen))
            elif start.measured:
                shown = traces[number]
            else:
                shown = _from(start, result, recording, traces[number], request.jobs)
            path = write_text(folder.path / "simulations" / f"{stem}.csv", trace_csv(shown, currents))
            if request.settings.figures:
                _figure(shown, folder.path / "figures" / f"simulation_{stem}", request.settings.figure_formats)
            rms = math.sqrt(float(((shown.y_simulated - shown.y_measured) ** 2).mean()))
            end = free_run_end(shown)
            left = None if end is None else float(shown.t[end])
            rows.append({"recording": recording.name, "file": str(path), "rms_error": finite(rms), "left_at": left})
        folder.end("done", DONE)
    summary = {
        "command": COMMAND,
        "folder": str(folder.path),
        "axis": result.axis,
        "simulations": rows,
        "exit_code": DONE,
    }
    return Outcome(COMMAND, folder.path, DONE, "", (_table(rows, result.axis),), summary)


def _chosen(
    request: Request, result: FitResult, recordings: Sequence[Recording], by_voltage: bool
) -> Sequence[Recording]:
    """The recordings that the model can run over; raises DataError where there is none."""
    chosen = _with_voltages(result, recordings) if by_voltage else results.residual_recordings(recordings, result)
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
    import numpy as np

    columns = [trace.t, trace.y_measured, trace.y_simulated, trace.velocity_simulated]
    unit = "rad" if trace.axis == "rotary" else "m"
    names = ["t (s)", f"y_measured ({unit})", f"y_simulated ({unit})", f"v ({unit}/s)"]
    if currents is not None:
        columns += list(currents)
        names += ["i_u (A)", "i_v (A)", "i_w (A)"]
    return csv_text(names, np.column_stack(columns).tolist(), 9)


def _from(start: StartState, result: FitResult, recording: Recording, trace: Trace, jobs: int) -> Trace:
    """The free run from a given start state; the bristle starts at its steady deflection."""
    import numpy as np

    from linid.diagnosis.measures import model_of
    from linid.simulation.inputs import pack_inputs
    from linid.simulation.run import Simulator, whole_recordings

    model, vector = model_of(result)
    simulator = Simulator(model, pack_inputs([recording]), result.substeps, jobs)
    position = start.position if start.position is not None else trace.y_simulated[0]
    speed = start.speed if start.speed is not None else trace.velocity_simulated[0]
    state = np.array([[[position, speed, np.nan]]])
    y, v, _ = simulator.run(vector, whole_recordings(simulator.inputs), state, velocity=True)
    return replace(trace, y_simulated=y[0], velocity_simulated=v[0])


def _figure(trace: Trace, stem: Path, formats: tuple[str, ...]) -> None:
    from linid.report.figures.comparison import comparison_figure
    from linid.report.style import save

    save(comparison_figure(trace), stem, formats)


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
        table.add_row(str(row["recording"]), error, until, str(row["file"]))
    return table
