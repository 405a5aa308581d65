"""What is to be fitted, judged and diagnosed: recordings of one axis with what is known about it."""

from __future__ import annotations

import html
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from linid.errors import UsageError
from linid.recording.recording import Recording, in_order

if TYPE_CHECKING:
    import pandas as pd

    from linid.recording import CoastDown


@dataclass(frozen=True)
class FoundCoastDown:
    """A free wheel as recorded, and the part of it in which only friction acts."""

    recording: Recording
    coast_down: CoastDown


@dataclass(frozen=True)
class Campaign:
    """Recordings of one axis: some to be fitted, others held out as judges.

    recordings: in their order; axis: linear or rotary; known: SI values by parameter name; name: for titles; notes:
    what reading the files noticed, warnings first; files: {file, sha256} of all that was read, of recordings with what
    reading them cut, filled, unwrapped or dropped; coast_downs: where free wheels were cut.
    """

    recordings: tuple[Recording, ...]
    axis: str = "linear"
    known: dict[str, float] = field(default_factory=dict)
    name: str = "campaign"
    notes: tuple[str, ...] = field(default=(), repr=False)
    files: tuple[dict[str, Any], ...] = field(default=(), repr=False)
    coast_downs: tuple[FoundCoastDown, ...] = field(default=(), repr=False)

    @classmethod
    def of(
        cls, recordings: Iterable[Recording], *, known: dict[str, float] | None = None, name: str = "campaign"
    ) -> Campaign:
        """A campaign of recordings made in Python; raises UsageError for none, or for mixed axes or equal names."""
        chosen = in_order(recordings)
        axes = {r.axis for r in chosen}
        if len(axes) != 1:
            fact = "no recording is given" if not chosen else "linear and rotary recordings are mixed"
            raise UsageError("recordings", fact, "Give the recordings of one axis.")
        if len({r.name for r in chosen}) < len(chosen):
            raise UsageError("recordings", "two of them have the same name", "Rename one.")
        return cls(chosen, axes.pop(), dict(known or {}), name)

    @property
    def fitted(self) -> tuple[Recording, ...]:
        """Recordings that fits follow."""
        return self.select(split="fit")

    @property
    def held_out(self) -> tuple[Recording, ...]:
        """Recordings that only judge."""
        return self.select(split="held_out")

    def select(self, *, split: str | None = None, kind: str | None = None) -> tuple[Recording, ...]:
        """The recordings of a split (fit, held_out) and kind (free_wheel, motor); None: any."""
        return tuple(
            r for r in self.recordings if (split is None or r.split == split) and (kind is None or r.kind == kind)
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What reading cost so many samples that it should be known before any result is."""
        from linid.recording.check_findings import clock_findings

        return tuple(
            f"{r.name}: {text}"
            for r in self.recordings
            if r.reading is not None
            for _, level, text in clock_findings(int(r.t.size), r.reading)
            if level == "warning"
        )

    def __getitem__(self, name: str) -> Recording:
        """The recording called `name`; KeyError if there is none."""
        for recording in self.recordings:
            if recording.name == name:
                return recording
        raise KeyError(name)

    def __iter__(self) -> Iterator[Recording]:
        return iter(self.recordings)

    def __len__(self) -> int:
        return len(self.recordings)

    def to_frame(self) -> pd.DataFrame:
        """One row per recording: kind, split, samples, sampling period and duration in s, added mass in kg."""
        import pandas as pd

        rows = [
            {
                "recording": r.name,
                "kind": r.kind,
                "split": r.split,
                "samples": r.t.size,
                "period": r.period,
                "duration": r.duration,
                "added_mass": r.added_mass,
            }
            for r in self.recordings
        ]
        return pd.DataFrame(rows).set_index("recording")

    def _repr_html_(self) -> str:
        return f"<p><b>{html.escape(self.name)}</b>, {self.axis} axis</p>" + str(self.to_frame().to_html())
