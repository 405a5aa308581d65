"""A model in a drive's cascade: what `simulate --controller` and `validate --controller` run, write and show."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.errors import DataError
from linid.report.files import columns_csv_text, file_stems, finite
from linid.workflow.run.run_folder import write_text

if TYPE_CHECKING:
    from linid.interface.results import Fit
    from linid.recording import Recording
    from linid.report.figures.write import Drawing
    from linid.simulation.closed_loop import ClosedLoop
    from linid.simulation.controller import Controller

Row = dict[str, object]


def references(recordings: Sequence[Recording], place: str) -> tuple[Recording, ...]:
    """The recordings that command a position: those that log a reference, or, where none does, all that the axis was
    not pushed in. Raises DataError, naming the place, where there is none.
    """
    logged = tuple(r for r in recordings if r.reference is not None)
    pushed = [r for r in recordings if r.kind == "free_wheel" and r.phase_currents is not None]
    chosen = logged or tuple(r for r in recordings if r not in pushed)
    if not chosen:
        raise DataError(
            place, "commands no position", "Map the commanded position: `reference: {column: ..., unit: mm}`."
        )
    return chosen


def run_closed_loops(
    fit: Fit,
    recordings: Sequence[Recording],
    controller: Controller,
    start: tuple[float | None, float | None],
    folder: Path,
) -> tuple[list[Row], list[Drawing]]:
    """Run the model over references: closed_loop/NAME.csv; a row of measures and a drawing for each.

    start: position in m and speed in m/s, None: the reference's, at rest. The largest following error is among the few.
    """
    from linid import api
    from linid.report.figures.closed_loop import closed_loop_figure
    from linid.report.figures.write import Drawing

    def drawing(recording: Recording, stem: str, run: ClosedLoop, measured: Any) -> Drawing:
        limit, current = controller.current_limit_a, None if measured is None else _logged_current(fit, recording)
        return Drawing(
            f"closed_loop_{stem}",
            lambda: closed_loop_figure(recording.name, run, fit.result.axis, measured, limit, current),
        )

    rows: list[Row] = []
    drawings: list[Drawing] = []
    errors: list[float] = []
    for recording, stem in zip(recordings, file_stems(r.name for r in recordings), strict=True):
        run = api.follow(fit, recording, controller, position=start[0], speed=start[1])
        measured = recording.y if recording.reference is not None else None
        path = write_text(folder / "closed_loop" / f"{stem}.csv", closed_loop_csv(run, recording.axis, measured))
        drawings.append(drawing(recording, stem, run, measured))
        errors.append(float(np.max(np.abs(run.following_error))))
        rows.append({"recording": recording.name, "file": str(path), **_measures(run, controller, measured)})
    worst = int(np.argmax(errors))  # also one that is no number
    return rows, [drawing._replace(few=k == worst) for k, drawing in enumerate(drawings)]


def _logged_current(fit: Fit, recording: Recording) -> Any:
    """The machine's own q-current (n,) in A beside a model's; None where the recording logs none."""
    from linid.diagnosis.measures import model_of
    from linid.simulation.closed_loop import measured_q_current

    model = model_of(fit.result)[0]
    if recording.phase_currents is not None and model.driven_by.phases:
        return measured_q_current(model, {e.name: e.value for e in fit.result.estimates}, recording)
    return recording.drive_input if recording.input_unit == "A" else None


def _measures(run: ClosedLoop, controller: Controller, measured: Any) -> Row:
    """RMS and largest following error in m, of the machine too, RMS of simulated minus measured position; RMS current
    in A, and the share of the time at its limit."""

    def rms(x: Any) -> object:
        return finite(float(np.sqrt(np.mean(np.square(x)))))

    limited = np.abs(run.current) >= (1.0 - 1e-9) * controller.current_limit_a
    out: Row = {
        "following_error_rms": rms(run.following_error),
        "following_error_largest": finite(float(np.max(np.abs(run.following_error)))),
        "current_rms": rms(run.current),
        "share_limited": float(np.mean(limited)),
    }
    if measured is not None:
        out["following_error_measured_rms"] = rms(run.reference - measured)
        out["gap_rms"] = rms(run.y - measured)
    return out


def closed_loop_csv(run: ClosedLoop, axis: str, measured: Any = None) -> str:
    """CSV of one run: t (s), reference, y, following error (m or rad), v, q-current (A).

    measured: (n,) position in m, for one column more.
    """
    unit = "rad" if axis == "rotary" else "m"
    names = ["t (s)", f"y_reference ({unit})", f"y_simulated ({unit})", f"following_error ({unit})", f"v ({unit}/s)"]
    columns = [run.t, run.reference, run.y, run.following_error, run.v, run.current]
    names.append("i_q (A)")
    if measured is not None:
        columns.append(measured)
        names.append(f"y_measured ({unit})")
    return columns_csv_text(names, columns, 9)


def closed_loop_table(rows: Sequence[Row], axis: str) -> object:
    """The table of the console; the machine's own following error beside the model's where it was measured."""
    from rich import box
    from rich.table import Table

    from linid.report.display import display_unit
    from linid.report.numbers import format_number

    def length(value: object) -> str:
        if not isinstance(value, float):
            return "diverged"
        display = display_unit("position", axis, value)
        return f"{format_number(value * display.factor)} {display.unit}"

    measured = any("gap_rms" in row for row in rows)
    table = Table(title="In closed loop", title_justify="left", box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    table.add_column("Recording", overflow="fold")
    heads = ["Following error, RMS", "largest", *(["measured, RMS", "Model minus machine"] if measured else [])]
    for head in (*heads, "Current, RMS", "At the limit"):
        table.add_column(head, justify="right")
    for row in rows:
        cells = [length(row["following_error_rms"]), length(row["following_error_largest"])]
        if measured:
            cells += [length(row[key]) if key in row else "" for key in ("following_error_measured_rms", "gap_rms")]
        current, share = row["current_rms"], row["share_limited"]
        cells.append(f"{format_number(current)} A" if isinstance(current, float) else "diverged")
        cells.append(f"{100.0 * share:.0f} %" if isinstance(share, float) else "")
        table.add_row(str(row["recording"]), *cells)
    return table
