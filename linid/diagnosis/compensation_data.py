"""What a feed-forward would save: following errors of the axis in its drive's closed loop."""

from __future__ import annotations

import math
from dataclasses import dataclass

from linid.arrays import Array


@dataclass(frozen=True)
class Ranged:
    """A figure in m (rotary: rad) with its 95 % interval, nan where nothing tells one."""

    value: float = math.nan
    low: float = math.nan
    high: float = math.nan


@dataclass(frozen=True)
class Following:
    """Following error, commanded position minus the encoder's: RMS over all references and largest, m (rotary: rad)."""

    rms: Ranged = Ranged()
    largest: Ranged = Ranged()


@dataclass(frozen=True)
class EffectCost:
    """What one named effect costs in RMS following error, m (rotary: rad).

    cost: of the axis with it, less that without it, both without feed-forward; saved: by its part of the feed-forward,
    all other parts in (nan where it has none); held: whether the feed-forward has a part for it; reason: why not.
    """

    effect: str
    cost: Ranged
    saved: Ranged
    held: bool
    reason: str = ""


@dataclass(frozen=True)
class FollowingCourse:
    """Following errors along one reference of the axis drawn that is in the middle.

    t: (n,) s; reference: (n,) commanded position in m; without, base, full: (n,) errors in m, under the three
    feed-forwards of `Compensation`.
    """

    recording: str
    t: Array
    reference: Array
    without: Array
    base: Array
    full: Array


@dataclass(frozen=True)
class Compensation:
    """Following errors of the diagnosed axis under its drive.

    refused: why there is no figure, empty where there is one; drive, reference: which loops and which motion, for
    people; controller: the loops' values by key; without, base, full: no feed-forward, that of the model before, that
    of the model after; effects: what each named one costs; courses: over time; draws: axes drawn from the covariance
    of the parameters; seed: of the draws.
    """

    refused: str = ""
    drive: str = ""
    reference: str = ""
    controller: dict[str, float | None] | None = None
    without: Following = Following()
    base: Following = Following()
    full: Following = Following()
    effects: tuple[EffectCost, ...] = ()
    courses: tuple[FollowingCourse, ...] = ()
    draws: int = 0
    seed: int = 0

    @property
    def saved(self) -> float:
        """Share of the RMS following error that the full feed-forward takes away; nan where there is none."""
        whole = self.without.rms.value
        return 1.0 - self.full.rms.value / whole if whole > 0.0 else math.nan
