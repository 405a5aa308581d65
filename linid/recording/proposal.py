"""A campaign proposed for recordings that somebody has: kinds, repeats and a split, each with its reason."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linid.errors import LinidError
from linid.recording.inspection import inspect_file
from linid.recording.mapping import ChannelMapping
from linid.recording.read import read_recording
from linid.recording.recording import Axis, Recording, Split

_ALIKE = 0.02  # of the motion's RMS, by which two runs of one command may differ
_SAME_PERIOD = 1e-6  # by which the printed periods of one rate may differ
_SAME_LENGTH = 0.9  # of the longer run: a run that was cut short repeats no whole one
_EVERY = 3  # of recordings of one kind that repeat nothing, each third is held out
SUFFIXES = (
    ".csv",
    ".txt",
    ".tsv",
    ".dat",
    ".log",
    ".asc",
    ".lvm",
    ".mat",
    ".mf4",
    ".mdf",
    ".tdms",
    ".parquet",
    ".svb",
    ".gz",
    ".zip",
    ".h5",
    ".hdf5",
)


@dataclass(frozen=True)
class Proposed:
    """One recording of a campaign; repeat_of: file of the first of its command ("": none); reason: of the split."""

    recording: Recording
    split: Split
    repeat_of: str
    reason: str


@dataclass(frozen=True)
class Unusable:
    """A file that cannot be read as it is, and why."""

    path: Path
    problem: str


@dataclass(frozen=True)
class Proposal:
    """What is proposed for the files of a folder."""

    folder: Path
    axis: Axis
    entries: tuple[Proposed, ...]
    unusable: tuple[Unusable, ...]


def candidates_in(folder: Path) -> list[Path]:
    """The files of a folder that may be recordings, by their suffix, in the order of their names."""
    found = [p for p in folder.iterdir() if p.is_file() and p.suffix.lower() in SUFFIXES and not p.name.startswith(".")]
    return sorted(found, key=lambda p: p.name)


def propose(
    folder: Path, files: Sequence[Path], channels: ChannelMapping | None = None, axis: Axis | None = None
) -> Proposal:
    """Read every file and propose how it may be used; channels: mapping of all; axis: None takes the position's unit
    of the first that can be read."""
    recordings: list[Recording] = []
    unusable: list[Unusable] = []
    for path in files:
        try:
            found = inspect_file(path, channels, axis)
            if found.problem is not None:
                unusable.append(Unusable(path, found.problem))
                continue
            rotary = any(c.channel == "position" and c.si == "rad" for c in found.columns)
            axis = axis or ("rotary" if rotary else "linear")
            recordings.append(read_recording(path, channels=channels, axis=axis))
        except LinidError as error:
            unusable.append(Unusable(path, str(error)))
    return Proposal(folder, axis or "linear", proposed(recordings), tuple(unusable))


def proposed(recordings: Sequence[Recording]) -> tuple[Proposed, ...]:
    """Repeats found by their motion; of repeats the last is held out, of others of one kind each third."""
    first: list[int] = []
    for k, one in enumerate(recordings):
        same = next((j for j in range(k) if first[j] == j and _repeats(recordings[j], one)), k)
        first.append(same)
    out = []
    singles = {"free_wheel": 0, "motor": 0}
    for k, one in enumerate(recordings):
        group = [j for j, owner in enumerate(first) if owner == first[k]]
        held, reason = False, ""
        if len(group) > 1:
            held = k == group[-1]
            reason = "last repeat" if held else "repeated"
        else:
            singles[one.kind] += 1
            held = singles[one.kind] % _EVERY == 0
            reason = f"each third of kind {one.kind}" if held else ""
        name = recordings[first[k]].source or Path(recordings[first[k]].name)
        out.append(Proposed(one, "held_out" if held else "fit", name.name if first[k] != k else "", reason))
    return _with_something_held_out(out)


def _with_something_held_out(entries: list[Proposed]) -> tuple[Proposed, ...]:
    """Without a held-out driven recording nothing judges a model: the last of several is held out."""
    for kind in ("motor", "free_wheel"):
        mine = [k for k, e in enumerate(entries) if e.recording.kind == kind]
        if len(mine) > 1 and all(entries[k].split == "fit" for k in mine):
            last = entries[mine[-1]]
            entries[mine[-1]] = Proposed(last.recording, "held_out", last.repeat_of, f"last of kind {kind}")
    return tuple(entries)


def _repeats(one: Recording, other: Recording) -> bool:
    """Whether two recordings show the same motion from where they begin."""
    if one.kind != other.kind or abs(one.period - other.period) > _SAME_PERIOD * one.period:
        return False
    n = min(one.y.size, other.y.size)
    if n < _SAME_LENGTH * max(one.y.size, other.y.size):
        return False
    a, b = one.y[:n] - one.y[0], other.y[:n] - other.y[0]
    size = float(np.sqrt(np.mean(a**2)))
    return size > 0.0 and float(np.sqrt(np.mean((a - b) ** 2))) < _ALIKE * size


def campaign_text(proposal: Proposal, channels: ChannelMapping | None = None) -> str:
    """The proposal as a campaign file, to be checked by its user."""
    lines = [
        "# Campaign proposed by `linid inspect FOLDER --campaign`; check every line: kinds by the inputs, repeats by",
        "# the motion. Held-out recordings are never fitted and judge the result. Add what was known of each run:",
        "# added_mass_kg (rotary: added_inertia_kg_m2), window: [t0, t1].",
        f"name: {json.dumps(proposal.folder.resolve().name, ensure_ascii=False)}",
    ]
    if proposal.axis == "rotary":
        lines.append("axis: rotary")
    if channels is not None:
        content = channels.model_dump(mode="json", exclude_unset=True, exclude_none=True)
        lines.append(f"channels: {json.dumps(content, ensure_ascii=False)}")
    lines.append("recordings:" if proposal.entries else "recordings: []  # TODO: no file could be read as it is")
    for entry in proposal.entries:
        r = entry.recording
        name = r.source.name if r.source is not None else r.name
        parts = [f"file: {json.dumps(name, ensure_ascii=False)}", f"kind: {r.kind}", f"split: {entry.split}"]
        if entry.repeat_of:
            parts.append(f"repeat_of: {json.dumps(entry.repeat_of, ensure_ascii=False)}")
        facts = f"{r.duration:.3g} s at {1.0 / r.period:.4g} Hz, travel {np.ptp(r.y):.4g}"
        facts += " rad" if proposal.axis == "rotary" else " m"
        lines.append(f"  - {{{', '.join(parts)}}}  # {facts}{f'; {entry.reason}' if entry.reason else ''}")
    if proposal.unusable:
        lines.append("# Not usable as they are (`linid inspect FILE` says more):")
        lines += [f"#   {one.path.name}: {' '.join(one.problem.split())[:200]}" for one in proposal.unusable]
    return "\n".join(lines) + "\n"
