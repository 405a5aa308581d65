"""Models asked for recordings: the gaps of many, and free runs from a start of one's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from linid.errors import DataError, LinidError, UsageError

if TYPE_CHECKING:
    from linid.diagnosis.gap import RecordingGap, Trace
    from linid.identification.result import FitResult
    from linid.recording import Recording
    from linid.simulation.closed_loop import ClosedLoop
    from linid.simulation.controller import Controller

Measured = tuple[tuple["RecordingGap", ...], tuple["Trace", ...]]
Progress = Callable[[str, int, int], None]


def residual_recordings(recordings: Sequence[Recording], result: FitResult) -> tuple[Recording, ...]:
    """The recordings whose gap the model can be asked for: a friction model knows no motor."""
    from linid.physics.motors.registry import MOTORS

    motor = MOTORS[result.model]
    if not motor.inputs:
        return tuple(r for r in recordings if r.kind == "free_wheel")
    if not motor.phases:
        return tuple(r for r in recordings if r.kind == "free_wheel" or r.drive_input is not None)
    return tuple(r for r in recordings if r.kind == "free_wheel" or r.phase_currents is not None)


def able_recordings(recordings: Sequence[Recording], result: FitResult) -> tuple[Recording, ...]:
    """`residual_recordings`; raises DataError where there is none."""
    chosen = residual_recordings(recordings, result)
    if not chosen:
        raise DataError(
            "recordings",
            f"hold none that a {result.model} model can be asked for",
            "Give free wheels, or recordings with the channels that the model needs.",
        )
    return chosen


@dataclass(frozen=True)
class Watch:
    """Who looks on while gaps are measured. progress(stage, done, total); unmeasured: told why a recording that cannot
    be measured is left out (None: that is raised)."""

    progress: Progress | None = None
    unmeasured: Callable[[LinidError], None] | None = None


def measure(
    result: FitResult,
    recordings: Sequence[Recording],
    *,
    jobs: int = 1,
    seed: int = 1,
    among: Sequence[Recording] = (),
    watch: Watch | None = None,
) -> Measured:
    """Gaps and traces of recordings, side by side.

    among: where repeats of a recording are looked for (default: recordings); jobs: threads, seed: of the noise draws.
    Raises UsageError or DataError for the first recording that cannot be measured, unless `watch` takes it.
    """
    from linid.diagnosis.measures import measure_gaps
    from linid.parallel_tasks import in_parallel

    watch = watch or Watch()

    def measured(recording: Recording, threads: int) -> Measured | LinidError:
        try:
            return measure_gaps(result, [recording], jobs=threads, seed=seed, among=among or recordings)
        except LinidError as error:
            return error

    gaps: list[RecordingGap] = []
    traces: list[Trace] = []
    for done, (_, found) in enumerate(in_parallel(measured, recordings, jobs), 1):
        if isinstance(found, LinidError):
            if watch.unmeasured is None:
                raise found
            watch.unmeasured(found)
            continue
        gaps += found[0]
        traces += found[1]
        if watch.progress is not None:
            watch.progress("gaps", done, len(recordings))
    return tuple(gaps), tuple(traces)


def free_run(
    result: FitResult, recording: Recording, *, position: float | None = None, speed: float | None = None, jobs: int = 1
) -> Trace:
    """The free run of a model from a start in m and m/s (None: as measured), under the currents or the one input.

    A given start begins with the bristles at their steady deflection. Raises DataError or UsageError.
    """
    from linid.diagnosis.measures import measure_gaps

    chosen = able_recordings([recording], result)
    _, (trace,) = measure_gaps(result, chosen, jobs=jobs, floors=False)
    if position is None and speed is None:
        return trace
    return _from(position, speed, result, recording, trace, jobs)


def _from(
    position: float | None, speed: float | None, result: FitResult, recording: Recording, trace: Trace, jobs: int
) -> Trace:
    """The free run from a given start; what is not given of it is the measured run's."""
    import numpy as np

    from linid.diagnosis.measures import model_of
    from linid.identification.unit_mass import comparable
    from linid.simulation.inputs import pack_inputs
    from linid.simulation.run import Simulator, whole_recordings

    model, vector = model_of(result)
    simulator = Simulator(model, pack_inputs([comparable(result, recording)]), result.substeps, jobs)
    place = position if position is not None else trace.y_simulated[0]
    velocity = speed if speed is not None else trace.velocity_simulated[0]
    state = np.array([[[place, velocity, np.nan]]])
    y, v, _ = simulator.run(vector, whole_recordings(simulator.inputs), state, velocity=True)
    return replace(trace, y_simulated=y[0], velocity_simulated=v[0])


def run_by_voltage(
    result: FitResult, recording: Recording, *, position: float | None = None, speed: float | None = None
) -> Trace:
    """The free run of a motor that the recording's phase voltages drive; its phase currents are simulated.

    position, speed: of the start, as in `free_run`. Raises UsageError for a model without windings, DataError for a
    recording without phase voltages.
    """
    from linid.diagnosis.voltage_run import voltage_driven

    if not result.winding:
        raise UsageError("model", "knows no windings", "Identify them: linid.fit(..., winding='star').")
    if recording.kind == "free_wheel" or recording.phase_voltages is None:
        raise DataError(recording.name, "has no phase voltages that drive it", "Map voltage_u, voltage_v, voltage_w.")
    return voltage_driven(result, recording, position, speed)[0]


def in_closed_loop(
    result: FitResult,
    recording: Recording,
    controller: Controller,
    *,
    position: float | None = None,
    speed: float | None = None,
) -> ClosedLoop:
    """A model in a drive's cascade that follows the recording's reference, or its position where none is logged.

    position, speed: of the start in m and m/s (None: the reference's first position, at rest). Raises UsageError for a
    model without motor, DataError for an added mass whose part of the whole nobody knows.
    """
    from linid.diagnosis.measures import model_of
    from linid.identification.unit_mass import comparable
    from linid.simulation.closed_loop import follow

    model, _ = model_of(result)
    if not model.driven_by.inputs:
        raise UsageError("--controller", "a friction model has no motor to control", "Give the result of fit-motor.")
    course = replace(
        comparable(result, recording), y=recording.y if recording.reference is None else recording.reference
    )
    values = {e.name: e.value for e in result.estimates}
    return follow(model, values, controller, course, (position, speed or 0.0), result.substeps)
