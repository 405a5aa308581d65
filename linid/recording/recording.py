"""The Recording: one scope export in SI units, checked and read-only."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from linid.arrays import Array
from linid.recording.jumps import sets_off
from linid.recording.motion import MeasuredMotion, motion_behind

Axis = Literal["linear", "rotary"]
Kind = Literal["free_wheel", "motor"]
Split = Literal["fit", "held_out"]
BetweenSamples = Literal["detected", "spline", "linear", "hold"]


@dataclass(frozen=True)
class Reading:
    """What a file's numbers were before they were put in order on a regular clock.

    jitter: RMS deviation of the time steps from their median, as a share of it, gaps left out (nan: no time stamps);
    stamp_step: resolution of the time stamps in s where that is why they were uneven, else 0;
    gaps, missing, longest_gap: steps above 1.5 periods, the samples that they lack, the longest in s;
    left_out: rows with a repeated or unreadable time stamp; filled: unreadable cells interpolated; cut: samples lost
    at the ends or beyond a long gap; resampled: put on a regular grid by a spline;
    wraps, wrap: jumps of a wrapped position that were made continuous, and the size of one in m (rotary: rad);
    position_step, input_step: resolution of the position in m (rotary: rad) and of the inputs in their unit, 0 where
    the values lie on no lattice.
    """

    jitter: float
    stamp_step: float = 0.0
    gaps: int = 0
    missing: int = 0
    longest_gap: float = 0.0
    left_out: int = 0
    filled: int = 0
    cut: int = 0
    resampled: bool = False
    wraps: int = 0
    wrap: float = 0.0
    position_step: float = 0.0
    input_step: float = 0.0


def frozen(array: Array) -> Array:
    """The array (any shape, any unit) itself, from now on read-only: such a one is kept by a recording as it is, any
    other is copied.
    """
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class Recording:
    """One scope export: SI units, equal lengths, finite, t increasing.

    t: (n,) time in s, strictly increasing; y: (n,) position in m (rotary: rad);
    v: (n,) velocity as exported, m/s, only shown, never fitted; reference: (n,) commanded position, m;
    simulated: (n,) position in m of a simulation of the user's own by the same inputs;
    phase_currents: (3, n) A; phase_voltages: (3, n) V, each phase to the neutral or across its winding;
    drive_input: (n,) q-current in A or command in `input_unit`.
    added_mass: known extra mass in kg (rotary: kg m^2); number: place in the campaign, from 1 (0: none);
    elapsed: running time of the campaign in s when this recording's clock shows 0; repeat_of: name of the first
    recording of the same command.
    between_samples: what the inputs do there; jump_at: at which share of its interval one steps (None: as the motion
    shows it); see `input_course`.
    notes: what the reader corrected or noticed; reading: the same in numbers (None: not read from a file);
    before_noise: see `stepping`; carried: see `motion`.
    Two recordings are equal only if they are the same object.
    """

    name: str
    t: Array
    y: Array
    v: Array | None = None
    phase_currents: Array | None = None
    phase_voltages: Array | None = None
    drive_input: Array | None = None
    input_unit: str = "A"
    axis: Axis = "linear"
    kind: Kind = "motor"
    split: Split = "fit"
    added_mass: float = 0.0
    repeat_of: str = ""
    number: int = 0
    elapsed: float = 0.0
    between_samples: BetweenSamples = "detected"
    jump_at: float | None = None
    source: Path | None = None
    sha256: str = ""
    notes: tuple[str, ...] = field(default=())
    reading: Reading | None = None
    reference: Array | None = None
    simulated: Array | None = None
    before_noise: Recording | None = field(default=None, repr=False, compare=False)
    carried: MeasuredMotion | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("t", "y", "v", "reference", "simulated", "phase_currents", "phase_voltages", "drive_input"):
            array = getattr(self, name)
            if array is not None and array.flags.writeable:  # the caller's own: may change later
                object.__setattr__(self, name, frozen(array.copy()))

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "carried": None}  # quicker found again than sent

    @property
    def motion(self) -> MeasuredMotion:
        """The motion behind the positions: smoothed once, and carried to copies with the same positions."""
        dt = self.duration / (self.y.size - 1)
        if self.carried is None or self.carried.measured is not self.y or self.carried.dt != dt:
            object.__setattr__(self, "carried", motion_behind(self.y, dt, sets_off=sets_off(self.y, self.inputs)))
        assert self.carried is not None
        return self.carried

    @property
    def inputs(self) -> Array | None:
        """The phase currents (3, n) in A, else the one input (n,) in `input_unit`; None where nothing drives."""
        return self.phase_currents if self.phase_currents is not None else self.drive_input

    @property
    def stepping(self) -> Recording:
        """The recording whose inputs tell where these step: that before noise was added to them, unless cut since."""
        before = self.before_noise
        return self if before is None or before.t.size != self.t.size else before

    @property
    def measured(self) -> bool:
        """Whether positions were recorded; all are nan otherwise."""
        return bool(np.isfinite(self.y[0]))

    @property
    def period(self) -> float:
        """Median sampling period in s."""
        return float(np.median(np.diff(self.t)))

    @property
    def duration(self) -> float:
        """Time from the first to the last sample in s."""
        return float(self.t[-1] - self.t[0])


def in_order(recordings: Iterable[Recording]) -> tuple[Recording, ...]:
    """The recordings numbered in the order given, each with the running time of those before it."""
    out: list[Recording] = []
    before = 0.0
    for number, recording in enumerate(recordings, start=1):
        out.append(replace(recording, number=number, elapsed=before - float(recording.t[0])))
        before += recording.duration
    return tuple(out)


@dataclass(frozen=True)
class RecordedCampaign:
    """Recordings of one axis with what is known about it (`known`: parameter name -> SI value)."""

    name: str
    axis: Axis
    recordings: tuple[Recording, ...]
    known: dict[str, float] = field(default_factory=dict)
    path: Path | None = None

    def of(self, *, kind: Kind | None = None, split: Split | None = None) -> tuple[Recording, ...]:
        """The recordings of the given kind and split (None: any)."""
        return tuple(
            r for r in self.recordings if (kind is None or r.kind == kind) and (split is None or r.split == split)
        )
