"""The objective `winding_currents`: phase currents that the measured voltages drive along the measured motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from linid.arrays import Array, Integers
from linid.identification.signals.motion import measure_motion
from linid.physics.electrical import SEPARATE, STAR
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import currents_along

_GROUP = 0.004  # s, residuals are grouped in bins of this length: noise hardly outlives a winding's memory
_FLOOR = 1e-9  # A
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


@dataclass
class WindingCurrents:
    """Simulated minus measured currents of whole recordings along CURRENT_AXES, in A; every start is soon forgotten.

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
        self.inputs = pack_inputs(self.recordings, voltages=True)
        self.motion = measure_motion(self.recordings)
        self.axes = CURRENT_AXES[self.model.winding]
        measured = [r.phase_currents for r in self.recordings if r.phase_currents is not None]
        self.start = np.array([rows[:, 0] for rows in measured])
        # Recording after recording, and in each one axis after the other.
        self.measured = np.concatenate([(self.axes @ rows).ravel() for rows in measured])
        classes: list[Integers] = []
        groups: list[Integers] = []
        owner: list[int] = []
        for index, recording in enumerate(self.recordings):
            size = recording.y.size
            bins = (np.arange(size) * self.inputs.dts[index] / _GROUP).astype(np.int64)
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
