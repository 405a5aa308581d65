"""The objective `winding_currents`: phase currents that the measured voltages drive along the measured motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from linid.arrays import Array, Integers
from linid.identification.signals.motion import measure_motion
from linid.physics.electrical import SEPARATE, STAR
from linid.physics.model import Model
from linid.recording.jumps import find_jumps
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.winding_currents import currents_along

_GROUP = 0.004  # s, residuals are grouped in bins of this length: noise hardly outlives a winding's memory
_FLOOR = 1e-9  # A
_SHORTEST = 16  # samples of a piece between two steps: fewer tell no motion
# Samples after a step that are left out: the smoothed speed, and so the back-EMF, is off until the current has risen.
_UNSETTLED = 2
# Rows along which currents are compared, orthonormal, so that equal noise of the phases stays white and equal. What a
# star's currents have in common is no more than an error of their sensors.
CURRENT_AXES = {
    SEPARATE: np.eye(3),
    STAR: np.array([[2.0, -1.0, -1.0], [0.0, math.sqrt(3.0), -math.sqrt(3.0)]]) / math.sqrt(6.0),
}


def tells_windings(recording: Recording) -> bool:
    """Whether a recording is driven and has both phase voltages and phase currents."""
    driven = recording.kind != "free_wheel"
    return driven and recording.phase_voltages is not None and recording.phase_currents is not None


def between_steps(recording: Recording) -> list[Recording]:
    """A recording cut where its voltages step, each piece from soon after a step to the next one.

    When a voltage stepped within its interval no sample tells, least of all the motion, which a winding delays: the
    inductance would take the difference. Each piece starts with its measured currents. Where what the inputs do
    between samples is stated, or too little is left, the recording stays whole.
    """
    assert recording.phase_voltages is not None
    jumps = find_jumps(recording.phase_voltages) if recording.between_samples == "detected" else ()
    edges = [0, *(edge for jump in jumps for edge in (jump.first, jump.last + 1 + _UNSETTLED)), recording.t.size - 1]
    spans = [(a, b + 1) for a, b in zip(edges[::2], edges[1::2], strict=True) if b + 1 - a >= _SHORTEST]
    return [_span(recording, a, b) for a, b in spans] if jumps and spans else [recording]


def _span(recording: Recording, a: int, b: int) -> Recording:
    currents, voltages = recording.phase_currents, recording.phase_voltages
    assert currents is not None and voltages is not None
    return replace(
        recording,
        t=recording.t[a:b],
        y=recording.y[a:b],
        v=None,
        reference=None,
        simulated=None,
        drive_input=None,
        phase_currents=currents[:, a:b],
        phase_voltages=voltages[:, a:b],
    )


@dataclass
class WindingCurrents:
    """Simulated minus measured currents along CURRENT_AXES, in A, of recordings cut where their voltages step; every
    start is soon forgotten.

    The back-EMF is that of the measured motion, so an axis without a spring does not drift here. model: with windings;
    recordings: driven ones with phase voltages and currents.
    """

    model: Model
    recordings: tuple[Recording, ...]
    name: str = "winding_currents"
    nuisances: int = 0
    robust: bool = False
    floor: float = _FLOOR

    def __post_init__(self) -> None:
        cut = [between_steps(recording) for recording in self.recordings]
        pieces = [piece for some in cut for piece in some]
        owners = [index for index, some in enumerate(cut) for _ in some]
        self.inputs = pack_inputs(pieces, voltages=True)
        self.motion = measure_motion(pieces)
        self.axes = CURRENT_AXES[self.model.winding]
        measured = [piece.phase_currents for piece in pieces if piece.phase_currents is not None]
        self.start = np.array([rows[:, 0] for rows in measured])
        # Piece after piece, and in each one axis after the other.
        self.measured = np.concatenate([(self.axes @ rows).ravel() for rows in measured])
        classes: list[Integers] = []
        groups: list[Integers] = []
        owner: list[int] = []
        for number, (index, piece) in enumerate(zip(owners, pieces, strict=True)):
            size = piece.y.size
            bins = (np.arange(size) * self.inputs.dts[number] / _GROUP).astype(np.int64)
            for axis in range(len(self.axes)):
                base = int(groups[-1][-1]) + 1 if groups else 0
                groups.append(bins + base)
                classes.append(np.full(size, len(self.axes) * index + axis, dtype=np.int64))
                owner += [index] * (int(bins[-1]) + 1)
        self.classes = np.concatenate(classes)
        self.groups = np.concatenate(groups)
        self.group_recording = np.array(owner, dtype=np.int64)
        self.signal = self.measured

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) current errors in A. params: (C, VECTOR_SIZE); offsets: (C, 0), there are none."""
        found = currents_along(self.model, params, self.inputs, self.motion.y, self.motion.v, self.start)
        edges = self.inputs.sample_offsets
        rows = [(self.axes @ found[:, :, a:b]).reshape(params.shape[0], -1) for a, b in pairwise(edges)]
        return np.asarray(np.concatenate(rows, axis=1) - self.measured)
