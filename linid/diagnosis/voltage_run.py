"""The free run of a motor that a recording's phase voltages drive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.gap import Trace, traced
from linid.identification.result import FitResult
from linid.identification.signals.motion import measure_motion
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings


def voltage_driven(
    result: FitResult, recording: Recording, position: float | None = None, speed: float | None = None
) -> tuple[Trace, Array]:
    """Motion and currents (3, n) in A of a fitted motor under a recording's voltages.

    position, speed: of the start, in m and m/s (None: as measured, or zero where nothing was); the currents start as
    measured or, where none were logged, at those that the first voltages would hold.
    """
    model = Model(result.model, result.effects, result.winding, result.law)
    vector = model.vector({e.name: e.value for e in result.estimates})[None, :]
    inputs = pack_inputs([recording], voltages=True)
    begun = (0.0, 0.0)
    if recording.measured:
        motion = measure_motion([recording])
        begun = (float(motion.y[0]), float(motion.v[0]))
    place, velocity = (own if own is not None else at for own, at in zip((position, speed), begun, strict=True))
    state = np.array([[[place, velocity, np.nan]]])
    first = np.full((1, 1, 3), np.nan)
    if recording.phase_currents is not None:
        first[0, 0] = recording.phase_currents[:, 0]
    y, v, i, _ = Simulator(model, inputs, result.substeps).run_by_voltage(
        vector, whole_recordings(inputs), state, first
    )
    trace = replace(traced(recording, y[0], v[0]), phase_currents=i[0], drive_input=None, inputs=None)
    return trace, np.asarray(i[0])
