"""Campaign YAML -> the recordings of one axis."""

from __future__ import annotations

import datetime
import difflib
import os
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from linid.config import YamlFile, validate_yaml
from linid.errors import ConfigError, DataError
from linid.former_names import with_present_keys
from linid.recording.mapping import ChannelMapping
from linid.recording.names import plain
from linid.recording.read import read_recording
from linid.recording.recording import Axis, Kind, RecordedCampaign, Recording, Split, in_order

Comment = str | list[str] | None


class RecordingEntry(BaseModel):
    """One line of `recordings:`. added_mass_kg on linear, added_inertia_kg_m2 on rotary axes; window in s.

    repeat_of: file of an earlier entry that was recorded under the same command; simulated: file with time and
    position of a simulation of the user's own by the same inputs.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    file: str = Field(min_length=1)
    kind: Kind | None = None
    split: Split = "fit"
    added_mass_kg: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    added_inertia_kg_m2: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    window: tuple[float, float] | None = None
    repeat_of: str | None = None
    simulated: str | None = None
    channels: ChannelMapping | None = None
    comments: Comment = None


Known = Annotated[dict[str, Annotated[float, Field(allow_inf_nan=False)]], BeforeValidator(with_present_keys)]


class CampaignFile(BaseModel):
    """The campaign file as written. recorded: day or moment of its recordings, by which `monitor` orders campaigns."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str | None = None
    recorded: datetime.datetime | datetime.date | None = None
    axis: Axis = "linear"
    known: Known = Field(default_factory=dict)
    channels: ChannelMapping | None = None
    recordings: list[RecordingEntry] = Field(min_length=1)
    comments: Comment = None


def is_campaign(path: str | Path) -> bool:
    """Whether a path names a campaign (by its suffix .yaml or .yml)."""
    return Path(path).suffix.lower() in (".yaml", ".yml")


def read_campaign(path: str | Path) -> RecordedCampaign:
    """Read a campaign and all its recordings (files are relative to the YAML file).

    Raises ConfigError for the YAML itself and for missing or repeated files, DataError for a bad recording.
    """
    source = YamlFile(Path(path))
    config = validate_yaml(source, CampaignFile)
    folder = source.path.parent
    _check_files(source, config, folder)
    _check_masses(source, config)
    names = _names(config)
    repeats = _repeats(source, config, names)
    recordings = tuple(
        replace(_read(entry, config, folder, name, source, index), repeat_of=first)
        for index, (entry, name, first) in enumerate(zip(config.recordings, names, repeats, strict=True))
    )
    return RecordedCampaign(
        plain(config.name or source.path.parent.resolve().name) or "campaign",
        config.axis,
        in_order(recordings),
        dict(config.known),
        source.path,
    )


def _read(
    entry: RecordingEntry, config: CampaignFile, folder: Path, name: str, source: YamlFile, index: int
) -> Recording:
    channels = entry.channels.over(config.channels) if entry.channels else config.channels
    if channels is not None:
        try:
            channels.period_s  # noqa: B018  a wrong unit is a fault of the YAML, with its line
        except ConfigError as error:
            where = ("recordings", index, "channels", "period") if entry.channels else ("channels", "period")
            raise ConfigError(source.place(where), error.fact, error.remedy) from None
    mass = entry.added_inertia_kg_m2 if config.axis == "rotary" else entry.added_mass_kg
    recording = read_recording(
        folder / entry.file,
        channels=channels,
        axis=config.axis,
        kind=entry.kind,
        split=entry.split,
        added_mass=mass,
        window=entry.window,
    )
    if entry.simulated is not None:
        recording = with_simulation(recording, read_recording(folder / entry.simulated, axis=config.axis))
    return replace(recording, name=name)


def with_simulation(recording: Recording, simulation: Recording) -> Recording:
    """A recording beside the motion that a simulation has of it, at its samples.

    simulation: with the same clock. Raises DataError where it begins later or ends sooner by more than a sample.
    """
    from scipy.interpolate import CubicSpline

    t, own = recording.t, simulation.t
    slack = max(recording.period, simulation.period)
    if own[0] > t[0] + slack or own[-1] < t[-1] - slack:
        raise DataError(
            str(simulation.source or simulation.name),
            f"simulates {own[0]:g} to {own[-1]:g} s, {recording.name} is of {t[0]:g} to {t[-1]:g} s",
            "Simulate the whole recording, by its own clock.",
        )
    return replace(recording, simulated=CubicSpline(own, simulation.y)(np.clip(t, own[0], own[-1])))


def _check_files(source: YamlFile, config: CampaignFile, folder: Path) -> None:
    seen: dict[tuple[Path, tuple[float, float] | None], int] = {}
    for index, entry in enumerate(config.recordings):
        location = ("recordings", index, "file")
        path = folder / entry.file
        if not os.path.exists(path):
            present = [p.name for p in path.parent.iterdir()] if os.path.isdir(path.parent) else []
            near = difflib.get_close_matches(path.name, present, n=1)
            hint = f"Did you mean '{near[0]}'? " if near else ""
            raise ConfigError(
                source.place(location), f"file '{entry.file[:200]}' not found", f"{hint}Paths are relative to {folder}."
            )
        key = (path.resolve(), entry.window)  # two windows of one file are two recordings
        if key in seen:
            raise ConfigError(
                source.place(location),
                f"file '{entry.file}' is listed twice (first in line {source.line(('recordings', seen[key], 'file'))})",
                "Remove one, or give each a `window:` of its own.",
            )
        seen[key] = index


def _check_masses(source: YamlFile, config: CampaignFile) -> None:
    wrong, right = ("added_mass_kg", "added_inertia_kg_m2")
    if config.axis == "linear":
        wrong, right = right, wrong
    for index, entry in enumerate(config.recordings):
        if getattr(entry, wrong):
            raise ConfigError(
                source.place(("recordings", index, wrong)),
                f"'{wrong}' on a {config.axis} axis",
                f"Give '{right}', or set `axis:`.",
            )
        if entry.window is not None and not entry.window[0] < entry.window[1]:
            raise ConfigError(
                source.place(("recordings", index, "window")),
                f"window {list(entry.window)} ends before it starts",
                "Give [t0, t1] in s with t0 < t1.",
            )


def _names(config: CampaignFile) -> list[str]:
    """File stems; the path or a number is added where two would be equal."""
    stems = [plain(Path(entry.file).stem) or "recording" for entry in config.recordings]
    names: list[str] = []
    for entry, stem in zip(config.recordings, stems, strict=True):
        name = stem if stems.count(stem) == 1 else plain(Path(entry.file).with_suffix("").as_posix().replace("/", "_"))
        number = 2
        unique = name
        while unique in names:
            unique = f"{name}_{number}"
            number += 1
        names.append(unique)
    return names


def _repeats(source: YamlFile, config: CampaignFile, names: list[str]) -> list[str]:
    """For each entry the name of the first recording of its command, empty where it repeats none."""
    first: list[str] = []
    for index, entry in enumerate(config.recordings):
        if entry.repeat_of is None:
            first.append("")
            continue
        place = source.place(("recordings", index, "repeat_of"))
        before = [k for k in range(index) if config.recordings[k].file == entry.repeat_of]
        if not before:
            raise ConfigError(
                place, f"repeat_of: no earlier entry has the file '{entry.repeat_of}'", "Name the first repeat."
            )
        if config.recordings[before[0]].kind != entry.kind:
            raise ConfigError(place, "repeat_of: a recording of another kind", "Give both the same `kind:`.")
        first.append(first[before[0]] or names[before[0]])
    return first
