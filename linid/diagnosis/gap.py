"""The sim-to-real gap of one recording: three measures, each beside its noise floor, and the traces behind them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.recording.input_course import InputCourse, input_course
from linid.recording.recording import Recording


@dataclass(frozen=True)
class RecordingGap:
    """Gap measures of one recording.

    free_run: RMS(y_sim - y)/std(y); ahead: RMS position error 0.1 s ahead in m (rotary: rad);
    force: RMS residual force in N (rotary: N m); force_share: the same over the RMS total force.
    Those that end in `_floor` hold what encoder and current noise alone would give, and at least what of the error does
    not repeat, where repeats: their number besides this recording. per_mass: forces are in N/kg, of a model that knows
    no mass.
    """

    recording: str
    kind: str
    split: str
    free_run: float
    free_run_floor: float
    ahead: float
    ahead_floor: float
    force: float
    force_share: float
    force_floor: float
    repeats: int = 0
    per_mass: bool = False


@dataclass(frozen=True)
class AheadPieces:
    """Prediction restarted from the measured state, stitched piece by piece; SI units.

    t, y, v, error: (m,) time, predicted position and velocity, predicted minus measured position, nan between pieces.
    end_t, end_error: (k,) time and error at the horizon of all windows, of which the measure `ahead` is the RMS.
    """

    horizon: float
    t: Array
    y: Array
    v: Array
    error: Array
    end_t: Array
    end_error: Array


@dataclass(frozen=True)
class Trace:
    """Measured and simulated motion of one recording, (n,) arrays in SI units.

    velocity_measured is differentiated position, shown only; force_residual, in N, lives on force_t, (k,) both.
    phase_currents: (3, n) A or None; drive_input: (n,) or None. ahead: of driven recordings. pole_pitch: m; a free run
    that is off by as much has lost step (None: the model has no poles). inputs: what they do between the samples.
    """

    recording: str
    kind: str
    split: str
    axis: str
    added_mass: float
    t: Array
    y_measured: Array
    y_simulated: Array
    velocity_measured: Array
    velocity_simulated: Array
    force_t: Array
    force_residual: Array
    phase_currents: Array | None = None
    drive_input: Array | None = None
    input_unit: str = "A"
    ahead: AheadPieces | None = None
    pole_pitch: float | None = None
    inputs: InputCourse | None = None

    @property
    def measured(self) -> bool:
        """Whether there is a measured position to be compared with."""
        return bool(np.isfinite(self.y_measured[0]))


def traced(recording: Recording, y: Array, v: Array) -> Trace:
    """A recording beside its simulated motion, without a residual force.

    y, v: (n,) simulated position in m (rotary: rad) and speed in m/s (rad/s) at the recording's samples.
    """
    dt, nothing = recording.duration / (recording.t.size - 1), np.zeros(0)
    return Trace(
        recording=recording.name,
        kind=recording.kind,
        split=recording.split,
        axis=recording.axis,
        added_mass=recording.added_mass,
        t=recording.t,
        y_measured=recording.y,
        y_simulated=y,
        velocity_measured=np.gradient(recording.y, dt, edge_order=2),
        velocity_simulated=v,
        force_t=nothing,
        force_residual=nothing,
        phase_currents=recording.phase_currents,
        drive_input=recording.drive_input,
        input_unit=recording.input_unit,
        inputs=input_course(recording),
    )
