"""Files -> a campaign: recordings to fit and to hold out, with what is known and what was noticed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.digests import file_digest
from linid.errors import ConfigError, DataError, UsageError
from linid.interface.campaign import Campaign, FoundCoastDown
from linid.report.files import finite

if TYPE_CHECKING:
    from linid.interface.settings import Settings
    from linid.recording import CoastDown, Recording


def read_files(
    files: Sequence[Path], settings: Settings, *, axis: str | None = None, unmeasured: bool = False
) -> Campaign:
    """Read recordings and campaigns; free wheels that begin with a push are cut to their coast-down.

    files: bare recordings take channels, kind, window, period and added mass from the settings, campaigns bring their
    own; axis: of bare files when the settings say nothing; unmeasured: bare files of phase voltages need no position.
    Raises UsageError, ConfigError or DataError.
    """
    from linid.recording import in_order, is_campaign, read_campaign

    if not files:
        raise UsageError("FILE", "no file is given", "Name recordings or a campaign.")
    recordings: list[Recording] = []
    records: list[dict[str, Any]] = []
    known: dict[str, float] = {}
    axes: list[str] = []
    names: list[str] = []
    masses = _masses(files, settings)
    for path in files:
        if is_campaign(path):
            campaign = read_campaign(path)
            recordings += campaign.recordings
            known.update(campaign.known)
            axes.append(campaign.axis)
            names.append(campaign.name)
            records.append(file_record(path))
        else:
            recordings.append(_bare(path, settings, axis, masses.get(str(path), 0.0), unmeasured))
            axes.append(recordings[-1].axis)
            names.append(recordings[-1].name)
    records += [_record(r) for r in recordings]
    if settings.axis is not None:
        axes.append(settings.axis)
    if len(set(axes)) > 1:
        raise UsageError("FILE", "linear and rotary recordings are mixed", "Fit one axis at a time.")
    _refuse_equal_names(recordings)
    recordings = list(in_order(recordings))
    found = [_cut_push(r, settings) for r in recordings]
    made = Campaign(
        tuple(r for r, _ in found),
        axes[0],
        known,
        names[0],
        files=_distinct(records),
        coast_downs=tuple(
            FoundCoastDown(whole, coast) for whole, (_, coast) in zip(recordings, found, strict=True) if coast
        ),
    )
    return replace(made, notes=(*made.warnings, *_notes(made.recordings)))


def _notes(recordings: Sequence[Recording]) -> list[str]:
    """What the reader noticed, one line per distinct note with its recordings."""
    owners: dict[str, list[str]] = {}
    for recording in recordings:
        for note in recording.notes:
            owners.setdefault(note, []).append(recording.name)
    return [f"{names[0] if len(names) == 1 else f'{len(names)} recordings'}: {note}" for note, names in owners.items()]


def file_record(path: Path) -> dict[str, Any]:
    """Path and SHA-256 of an input file."""
    try:
        digest = file_digest(path)
    except OSError:
        digest = ""
    return {"file": str(path), "sha256": digest}


def _record(recording: Recording) -> dict[str, Any]:
    """What a recording's file was and what reading it did to its numbers, for run.json."""
    read = None if recording.reading is None else finite(asdict(recording.reading))
    return {
        "file": str(recording.source or recording.name),
        "sha256": recording.sha256,
        "samples": int(recording.t.size),
        "read": read,
        "notes": list(recording.notes),
    }


def _bare(path: Path, settings: Settings, axis: str | None, added_mass: float, unmeasured: bool) -> Recording:
    from linid.recording import read_recording
    from linid.recording.mapping import ChannelMapping

    channels = settings.channels
    if unmeasured:
        channels = ChannelMapping(unmeasured=True).over(channels)
    return read_recording(
        path,
        channels=channels,
        axis=settings.axis or axis or "linear",  # type: ignore[arg-type]
        kind=settings.kind,
        added_mass=added_mass,
        window=settings.window,
        period=settings.period,
    )


def _masses(files: Sequence[Path], settings: Settings) -> dict[str, float]:
    """Added mass per file, by path, name or stem; `*` is for all others."""
    from linid.recording import is_campaign

    masses: dict[str, float] = {}
    bare = [path for path in files if not is_campaign(path)]
    used = {"*"}
    for path in bare:
        for key in (str(path), path.name, path.stem, "*"):
            if key in settings.added_mass:
                masses[str(path)] = settings.added_mass[key]
                used.add(key)
                break
    unused = sorted(set(settings.added_mass) - used)
    if unused or (settings.added_mass and not bare):
        raise ConfigError(
            "added_mass",
            f"no bare recording is called {unused[0] if unused else 'so'}",
            "Name a file as on the command line; a campaign states `added_mass_kg` itself.",
        )
    return masses


def _cut_push(recording: Recording, settings: Settings) -> tuple[Recording, CoastDown | None]:
    """The coast-down of a free wheel; recordings with a window, or coasting from the start, stay as they are."""
    from linid.recording import find_coast_down, trim

    windowed = any(note.startswith("window [") for note in recording.notes)
    if recording.kind != "free_wheel" or windowed or not settings.find_coast_down:
        return recording, None
    try:
        coast = find_coast_down(recording)
    except DataError as error:
        error.remedy += " Or give the part to use by --window T0:T1 (in a campaign: `window: [t0, t1]`)."
        raise DataError(error.place, error.fact, error.remedy) from None
    if coast.t_start <= recording.t[0]:
        return recording, None
    cut = trim(recording, coast.t_start, coast.t_end)
    return replace(cut, notes=(*cut.notes, f"coast-down: {coast.evidence}")), coast


def _refuse_equal_names(recordings: Sequence[Recording]) -> None:
    seen: set[str] = set()
    for recording in recordings:
        if recording.name in seen:
            raise UsageError(
                recording.name, "two recordings have this name", "Rename one file, or list both in a campaign."
            )
        seen.add(recording.name)


def _distinct(records: Iterable[dict[str, Any]]) -> tuple[dict[str, Any], ...]:
    return tuple({(r["file"], r["sha256"]): r for r in records}.values())
