"""Scope export -> Recording: the whole chain from file to checked SI arrays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from linid.arrays import Array
from linid.errors import DataError, UsageError
from linid.recording.assemble import Signals, assemble
from linid.recording.mapping import PHASES, VOLTAGES, ChannelMapping, Role
from linid.recording.names import plain
from linid.recording.readers.registry import read_table
from linid.recording.recording import Axis, Kind, Recording, Split, frozen
from linid.recording.repair import saturation_note
from linid.recording.resolve import Channels, resolve, used_columns
from linid.recording.splines import to_uniform
from linid.recording.table import Table

_FEWEST = 50


def read_recording(
    path: str | Path,
    *,
    channels: ChannelMapping | None = None,
    axis: Axis = "linear",
    kind: Kind | None = None,
    split: Split = "fit",
    added_mass: float = 0.0,
    window: tuple[float, float] | None = None,
    period: float | None = None,
) -> Recording:
    """Read one scope export into SI units on a regular time grid; every correction is a sentence in `notes`.

    channels: column mapping (default: by name); axis: linear (m) or rotary (rad); kind: None decides by the currents or
    command, without them by the phase voltages (none, or all zero: free_wheel); added_mass: kg (rotary: kg m^2);
    window: (t0, t1) in s of the file's own time; period: sampling period in s where the file has no time column. Raises
    DataError for anything in the file that cannot be used, with line, found, expected and remedy; UsageError for a YAML
    file.
    """
    path = Path(path)
    if path.suffix.lower() in (".yaml", ".yml"):
        raise UsageError(str(path), "is a YAML file, a recording is expected", "Read campaigns with read_campaign().")
    mapping = channels or ChannelMapping()
    if period is not None and not period > 0:
        raise UsageError("period", f"found {period:g} s", "Give a sampling period above zero.")
    period = period if period is not None else mapping.period_s
    table = read_table(path, mapping, lambda table: used_columns(table, mapping, axis, period))
    found = resolve(table, mapping, axis, period)
    signals = assemble(table, found, period, window)
    recording = _recording(table, signals, found, axis, kind, split, added_mass)
    return to_uniform(replace(recording, between_samples=mapping.between_samples, jump_at=mapping.jump_at))


def check_long_enough(recording: Recording, samples: int = _FEWEST) -> None:
    """Raises DataError when a recording is too short to fit anything to it."""
    if len(recording.t) < samples:
        raise DataError(
            str(recording.source or recording.name),
            f"found {len(recording.t)} samples ({recording.duration:.3g} s), expected at least {samples}",
            "Record longer, or widen `window:`.",
        )


def _recording(
    table: Table, signals: Signals, channels: Channels, axis: Axis, kind: Kind | None, split: Split, added_mass: float
) -> Recording:
    path, values = table.path, signals.values
    notes = [*table.notes, *channels.notes, *signals.notes]
    phases, phase_notes = _three_phases(values, path)
    notes += phase_notes
    voltages = np.stack([values[role] for role in VOLTAGES]) if VOLTAGES[0] in values else None
    drive, unit = None, "A"
    if "command" in values:
        drive, unit = values["command"], channels.by_role["command"].si
    if "current_q" in values and "command" not in values:
        drive = values["current_q"]
    decided, kind_notes = _kind(kind, phases, drive, voltages, path)
    notes += kind_notes
    y = values.get("position", np.full(values["time"].size, np.nan))
    if "position" in values:
        _refuse_constant(y, decided, path)
    else:
        notes.append("no position is recorded: simulated ones have nothing to be compared with")
    for name, x in [(f"I_{j + 1}", phases[j]) for j in range(3)] if phases is not None else [("i_q", drive)]:
        if x is not None and "command" not in values and (note := saturation_note(x, name, "A")):
            notes.append(note)
    if values["time"][0] < 0:
        notes.append(f"time starts at {values['time'][0]:g} s (samples before the trigger are kept)")
    for own in (*values.values(), phases, voltages):  # nobody else's: they need not be copied
        if own is not None:
            frozen(own)
    return Recording(
        name=plain(path.stem) or "recording",
        t=values["time"],
        y=y,
        v=values.get("velocity"),
        reference=values.get("reference"),
        simulated=values.get("simulated"),
        phase_currents=phases,
        phase_voltages=voltages,
        drive_input=drive,
        input_unit=unit,
        axis=axis,
        kind=decided,
        split=split,
        added_mass=added_mass,
        source=path,
        sha256=table.sha256,
        notes=tuple(notes),
        reading=signals.reading,
    )


def _three_phases(values: dict[Role, Array], path: Path) -> tuple[Array | None, list[str]]:
    present = [role for role in PHASES if role in values]
    if not present:
        return None, []
    if len(present) == 1:
        raise DataError(
            str(path),
            f"found one phase current ({present[0]}), expected two or three",
            "Map a second phase current, or map the q-current as `current_q`.",
        )
    if len(present) == 3:
        return np.stack([values[role] for role in PHASES]), []
    missing = next(role for role in PHASES if role not in values)
    total = -(values[present[0]] + values[present[1]])
    return (
        np.stack([values.get(role, total) for role in PHASES]),
        [f"two phase currents recorded: {missing} = -({present[0]} + {present[1]})"],
    )


def _kind(
    kind: Kind | None, phases: Array | None, drive: Array | None, voltages: Array | None, path: Path
) -> tuple[Kind, list[str]]:
    inputs, names = [x for x in (phases, drive) if x is not None], "currents"
    if not inputs and voltages is not None and kind != "free_wheel":  # a free wheel's are its back-EMF
        inputs = [voltages]
        names = "voltages"
    silent = all(bool((x == 0).all()) for x in inputs)
    if kind == "motor" and not inputs:
        raise DataError(
            str(path),
            "a motor recording without currents or command",
            "Map the phase currents or voltages, the q-current or the command, or set `kind: free_wheel`.",
        )
    if kind == "motor" and silent:
        return "motor", [f"all {names} are zero although the recording is of kind motor"]
    if kind == "free_wheel" and not silent:
        largest = max(float(np.abs(x).max()) for x in inputs)
        return "free_wheel", [f"a free-wheel recording with currents or commands up to {largest:.3g}"]
    return kind or ("free_wheel" if silent else "motor"), []


def _refuse_constant(y: Array, kind: Kind, path: Path) -> None:
    if float(y.max()) == float(y.min()):
        raise DataError(
            str(path),
            f"the position is constant ({y[0]:g}) in a {kind} recording",
            "Check the mapped column and the encoder; a recording without motion holds nothing to identify.",
        )
