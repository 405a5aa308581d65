"""A functional mock-up unit (FMI 2.0 or 3.0, co-simulation) that simulates recordings, in a process of its own.

Whatever the unit does, it does to that process: a crash is an error that names the recording.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field

from linid.arrays import Array
from linid.errors import DataError, UsageError
from linid.physics.described import Description, Positive
from linid.recording.recording import Recording


def _rising(ends: tuple[float, float]) -> tuple[float, float]:
    if not ends[0] < ends[1]:
        raise ValueError("expected [low, high] with low < high")
    return ends


Channel = Literal["current_u", "current_v", "current_w", "drive"]
Range = Annotated[tuple[float, float], AfterValidator(_rising)]
_PHASES: tuple[Channel, ...] = ("current_u", "current_v", "current_w")


class FunctionalUnit(Description):
    """A unit and the names of its variables; the defaults are those of `linid export --to fmu`.

    file: of the unit; inputs: its variable for each channel of a recording (`drive`: the one input, in its unit);
    position: its output, of which one is so many m (rotary: rad) as `position_scale` says; start_position, start_speed:
    its parameters for the start, in the same scale ("": it starts where it likes); added_mass: its parameter for the
    mass that a recording carries, kg, asked for where one does ("": the unit moves without); parameters: further start
    values, each in the unit that it has there; free: ranges of parameters that are identified anew, in the same units;
    step_s: of the communication (None: the sampling period).
    """

    file: str = Field(min_length=1)
    inputs: dict[Channel, str] = Field(default_factory=lambda: {name: str(name) for name in (*_PHASES, "drive")})
    position: str = "position"
    position_scale: Positive = 1.0
    start_position: str = "start_position"
    start_speed: str = "start_speed"
    added_mass: str = "added_mass"
    parameters: dict[str, float] = Field(default_factory=dict)
    free: dict[str, Range] = Field(default_factory=dict)
    step_s: Positive | None = None


def load_unit(path: str | Path) -> FunctionalUnit:
    """A unit by its own file (.fmu), with the variables of linid's exports, or by a YAML file that describes one.

    Raises ConfigError for the YAML, with the line, and UsageError for a file that is not there.
    """
    from linid.config import load_yaml_model

    path = Path(path)
    if not path.exists():
        raise UsageError(str(path), "file not found", "Check the path.")
    if path.suffix.lower() == ".fmu":
        return FunctionalUnit(file=str(path))
    unit = load_yaml_model(path, FunctionalUnit)
    return unit.model_copy(update={"file": str(path.parent / unit.file)})


def simulate_by_unit(unit: FunctionalUnit, recordings: Sequence[Recording]) -> Iterator[tuple[Recording, Array]]:
    """Each recording with its position (n,) in m (rotary: rad) as a unit has it, as they come.

    It starts where the recording does, and as fast. Raises UsageError where FMPy or a declared variable is missing or a
    recording has no input for it, DataError where the unit fails, crashes, or gives what is no number.
    """
    known = _variables(unit)
    _check_names(unit, set(known), recordings)
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        for recording in recordings:
            yield recording, unit.position_scale * _simulated(unit, recording, pool, known)


def _variables(unit: FunctionalUnit) -> dict[str, str | None]:
    """A unit's variables with their start values; raises UsageError where FMPy or the file is missing."""
    try:
        import fmpy
    except ImportError:
        remedy = 'Install it: pip install "linid[fmu]".'
        raise UsageError(unit.file, "is an FMU, and fmpy is not installed", remedy) from None
    if not Path(unit.file).exists():
        raise UsageError(unit.file, "file not found", "Paths are relative to the file that names the unit.")
    return {one.name: one.start for one in fmpy.read_model_description(unit.file).modelVariables}


@dataclass(frozen=True)
class Window:
    """A stretch of a recording that a unit runs from the measured motion.

    t: (n,) s from 0; columns: inputs (n,) by the unit's names, each in its unit there; start: values of its
    parameters, each in its unit there;
    y: (n,) measured position in m (rotary: rad).
    """

    t: Array
    columns: dict[str, Array]
    start: dict[str, float]
    y: Array


class UnitRuns:
    """A unit that runs many windows with other parameters, in a process of its own that unpacks it once.

    Raises what `simulate_by_unit` raises.
    """

    def __init__(self, unit: FunctionalUnit, recordings: Sequence[Recording]) -> None:
        known = _variables(unit)
        _check_names(unit, set(known), recordings)
        self.unit, self.count, self._known = unit, 0, known
        self._folder = TemporaryDirectory()
        self._pool = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"))

    def __enter__(self) -> Self:
        import fmpy

        fmpy.extract(self.unit.file, self._folder.name)
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()
        self._folder.cleanup()

    def start_values(self, names: Sequence[str], otherwise: Array) -> Array:
        """Values (k,) that named parameters start with, each in its unit there: as said, else the unit's own, else
        `otherwise` (k,)."""
        own = [self.unit.parameters.get(name, self._known[name]) for name in names]
        return np.array([float(x) if x is not None else y for x, y in zip(own, otherwise, strict=True)])

    def windows(self, recording: Recording, duration: float) -> list[Window]:
        """A recording in windows of about a duration in s; whole where the unit cannot start anywhere."""
        anywhere = self.unit.start_position and self.unit.start_speed
        count = max(1, round(recording.duration / duration)) if anywhere else 1
        ends = np.linspace(0, recording.t.size - 1, count + 1).astype(int)
        columns = _columns(self.unit, recording)
        return [
            Window(
                recording.t[a : b + 1] - recording.t[a],
                {name: values[a : b + 1] for name, values in columns.items()},
                _start(self.unit, recording, self._known, a),
                recording.y[a : b + 1],
            )
            for a, b in pairwise(ends)
            if b - a > 1
        ]

    def positions(self, windows: Sequence[Window], values: Mapping[str, float]) -> Array:
        """Positions (n,) of all windows, one after the other, in m (rotary: rad); nan in those that fail.

        values: of parameters besides the windows' own, each in its unit there. Raises DataError where the unit crashes.
        """
        step = self.unit.step_s or float(windows[0].t[-1]) / (windows[0].t.size - 1)
        tasks = [(w.t, w.columns, {**w.start, **values}) for w in windows]
        try:
            found = self._pool.submit(_run_many, self._folder.name, tasks, self.unit.position, step).result()
        except BrokenProcessPool:
            raise DataError(
                self.unit.file, f"crashed its process with {dict(values)}", "Narrow the ranges under `free`."
            ) from None
        self.count += 1
        return self.unit.position_scale * np.asarray(found, dtype=np.float64)


def _simulated(unit: FunctionalUnit, recording: Recording, pool: ProcessPoolExecutor, known: Collection[str]) -> Array:
    """The position (n,) that a unit gives for a recording, in its own scale."""
    step = unit.step_s or recording.duration / (recording.t.size - 1)
    job = pool.submit(
        _run, unit.file, recording.t, _columns(unit, recording), _start(unit, recording, known), unit.position, step
    )
    try:
        y = job.result()
    except BrokenProcessPool:
        raise DataError(
            recording.name,
            f"crashed the process of the unit {unit.file}",
            "Try the unit alone in its own program, by the same input.",
        ) from None
    except RuntimeError as error:
        raise DataError(recording.name, f"the unit {unit.file} failed: {error}", "See its log.") from None
    return checked_motion(recording, y)


def checked_motion(recording: Recording, y: Array) -> Array:
    """The simulated position (n,) of a recording itself, where it is a number throughout.

    y: (n,) in the unit of whoever simulates, m where nothing else is said. Raises DataError where it is none.
    """
    if not np.all(np.isfinite(y)):
        first = float(recording.t[np.argmin(np.isfinite(y))])
        raise DataError(
            recording.name, f"is simulated to no number from {first:g} s on", "Look why the simulation diverges there."
        )
    return y


def _check_names(unit: FunctionalUnit, known: set[str], recordings: Sequence[Recording]) -> None:
    """Raise UsageError for variables that the unit lacks and are asked of it."""
    inputs = [unit.inputs[channel] for channel in _channels(unit, recordings)]
    starts = [name for name in (unit.start_position, unit.start_speed) if name]
    if unit.added_mass and any(r.added_mass for r in recordings):
        starts.append(unit.added_mass)
    missing = [name for name in (*inputs, unit.position, *starts, *unit.parameters, *unit.free) if name not in known]
    if missing:
        listed = ", ".join(sorted(known)[:30])
        raise UsageError(
            unit.file,
            f"has no variable {', '.join(dict.fromkeys(missing))}",
            "Name those that it has (inputs, position, start_position, start_speed, added_mass, parameters, free): "
            f"{listed}.",
        )


def _channels(unit: FunctionalUnit, recordings: Sequence[Recording]) -> tuple[Channel, ...]:
    """The channels that drive the unit: of phases where there are some, else the one input."""
    driven = [r for r in recordings if r.phase_currents is not None or r.drive_input is not None]
    phased = any(r.phase_currents is not None for r in driven)
    wanted: tuple[Channel, ...] = _PHASES if phased else ("drive",) if driven else ()
    unnamed = [name for name in wanted if name not in unit.inputs]
    if unnamed:
        raise UsageError(unit.file, f"names no variable for {', '.join(unnamed)}", "Name them under `inputs`.")
    return wanted


def _columns(unit: FunctionalUnit, recording: Recording) -> dict[str, Array]:
    """The recording's inputs (n,) by the unit's names."""
    if recording.phase_currents is not None:
        names = [unit.inputs[name] for name in _PHASES]
        return dict(zip(names, recording.phase_currents, strict=True))
    return {} if recording.drive_input is None else {unit.inputs["drive"]: recording.drive_input}


def _start(unit: FunctionalUnit, recording: Recording, known: Collection[str], first: int = 0) -> dict[str, float]:
    """Start values: the unit's own parameters, where and how fast the recording is at a sample, the mass that it
    carries, and, where the unit has linid's own names for them, its number and the campaign's time."""
    motion = recording.motion
    out = dict(unit.parameters)
    for name, value in ((unit.start_position, motion.y[first]), (unit.start_speed, motion.v[first])):
        if name:
            out[name] = float(value) / unit.position_scale
    if unit.added_mass and (recording.added_mass or unit.added_mass in known):
        out[unit.added_mass] = recording.added_mass
    places = {"record": float(recording.number), "elapsed": recording.elapsed + float(recording.t[first])}
    return {**{name: value for name, value in places.items() if name in known and name not in out}, **out}


def _run(
    file: str, t: Array, columns: Mapping[str, Array], start: Mapping[str, float], position: str, step: float
) -> Array:
    """The position (n,) at times t (n,) in s, in the unit's own scale. At the top of the module: it runs elsewhere."""
    import fmpy

    clock = t - t[0]
    table: Any = None
    if columns:
        table = np.zeros(clock.size, dtype=[(name, float) for name in ("time", *columns)])
        table["time"] = clock
        for name, values in columns.items():
            table[name] = values
    try:
        found = fmpy.simulate_fmu(
            file,
            stop_time=float(clock[-1]),
            step_size=step,
            output_interval=step,
            input=table,
            start_values=dict(start),
            output=[position],
            fmi_type="CoSimulation",
        )
    except Exception as error:  # of classes that another process may not know, or cannot build again
        raise RuntimeError(str(error)) from None
    return np.asarray(np.interp(clock, found["time"], found[position]), dtype=np.float64)


def _run_many(
    folder: str, tasks: Sequence[tuple[Array, Mapping[str, Array], Mapping[str, float]]], position: str, step: float
) -> Array:
    """The positions of several runs of an unpacked unit, one after the other; nan in those that fail."""
    out = []
    for t, columns, start in tasks:
        try:
            out.append(_run(folder, t, columns, start, position, step))
        except RuntimeError:
            out.append(np.full(t.size, np.nan))
    return np.concatenate(out)
