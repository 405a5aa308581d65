"""Models with many effects, and recordings that these models make."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.diagnosis.measures import model_of
from linid.export.target import Exported, reshaped
from linid.identification.result import FitResult
from linid.identification.signals.motion import measure_motion
from linid.physics.model import STATE_PLACES
from linid.recording.recording import Recording, in_order
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Segments, Simulator, whole_recordings
from tests.diagnosis.machine import result

PERIOD, DURATION = 1e-3, 2.0  # s
AHEAD = 0.1  # s, of predictions
FRICTION = {
    "mass": 2.0,
    "coulomb_force": 8.0,
    "static_force": 12.0,
    "stribeck_velocity": 0.01,
    "bristle_stiffness": 2e6,
    "bristle_damping": 1500.0,
    "viscous_friction": 12.0,
    "force_constant": 30.0,
}
# Effects that MuJoCo's form has one by one, each strong enough to be seen.
HELD = {
    "cogging": {
        "cogging_wavenumber": 200.0,
        "cogging_order_1": 1.0,
        "cogging_sine_1": 1.5,
        "cogging_cosine_1": -0.8,
        "cogging_order_2": 2.0,
        "cogging_sine_2": 0.5,
    },
    "constant_force": {"constant_force": 1.2},
    "cable_force": {
        "cable_preload": 0.4,
        "cable_stiffness": 15.0,
        "cable_hysteresis": 2.0,
        "cable_hysteresis_length": 0.02,
        "cable_middle": 0.1,
    },
    "quadratic_drag": {"drag_coefficient": 4.0, "drag_power": 2.0, "drag_speed": 0.5},
    "thermal_derating": {"derating": 0.08, "thermal_time": 0.7},
    "input_delay": {"input_delay": 2e-3},
    "flexible_load": {"load_mass": 0.3, "load_frequency": 25.0, "load_damping": 0.05},
    "gravity": {"gravity_sine": 1.0, "gravity_cosine": -0.5},
}
# Effects that it has not, or not whole.
LOST = {
    "force_ripple": {"ripple_wavenumber": 200.0, "ripple_sine_6": 0.05},
    "force_saturation": {"saturation": 0.05, "saturation_knee": 1.0},
    "load_dependent_friction": {"load_friction": 0.05},
    "asymmetric_friction": {"friction_asymmetry": 0.1},
    "eddy_current_drag": {"eddy_damping": 6.0, "eddy_speed": 1.0},
}


def axis(*parts: dict[str, dict[str, float]], kind: str = "force", **changes: float) -> FitResult:
    """The axis with all effects of some groups; changes: of its parameters, SI."""
    effects = {name: values for part in parts for name, values in part.items()}
    values = FRICTION | {key: x for one in effects.values() for key, x in one.items()} | changes
    return reshaped(replace(result(), model=kind, substeps=8), effects=tuple(effects), values=values)


def course(t: np.ndarray, size: float = 1.2) -> np.ndarray:
    """A q-current in A that reverses the axis some times and lets it rest."""
    return np.asarray(size * np.sin(2.0 * np.pi * 1.5 * t) * (1.0 + 0.5 * np.sin(2.0 * np.pi * 0.7 * t)))


def phase_currents(model: FitResult, t: np.ndarray, size: float = 1.2) -> np.ndarray:
    """Phase currents (3, n) in A that turn with a field which moves to and fro."""
    place = 0.03 * np.sin(2.0 * np.pi * 0.8 * t)
    angles = model.value("electrical_wavenumber") * place + model.value("commutation_offset")
    turns = 2.0 if model.model == "theta" else 1.0
    phases = turns * (angles + np.array([[-1.0], [0.0], [1.0]]) * model.value("winding_displacement"))
    return np.asarray(size * np.sin(phases + 0.5 * np.pi * np.tanh(3.0 * np.sin(2.0 * np.pi * 1.1 * t))))


def made(model: FitResult, *sizes: float) -> tuple[Recording, ...]:
    """Held-out recordings that a model makes under currents of these sizes, without noise."""
    t = np.arange(round(DURATION / PERIOD) + 1) * PERIOD
    bare = []
    for k, size in enumerate(sizes):
        if model.model in ("sine", "theta"):
            inputs = {"phase_currents": phase_currents(model, t, size)}
        else:
            inputs = {"drive_input": course(t, size)}
        bare.append(Recording(f"run_{k}", t, np.zeros_like(t), split="held_out", axis=model.axis, **inputs))
    return tuple(replace(recording, y=free_run(model, recording)) for recording in in_order(bare))


def free_run(model: FitResult, recording: Recording) -> np.ndarray:
    """Positions (n,) in m of a model from rest at zero."""
    kind, vector = model_of(model)
    simulator = Simulator(kind, pack_inputs([recording]), model.substeps)
    y, _, _ = simulator.run(vector, whole_recordings(simulator.inputs), np.zeros((1, 1, 3)))
    return np.asarray(y[0])


def ahead(model: FitResult, recording: Recording, text: str = "") -> np.ndarray:
    """Errors (k,) in m of positions 0.1 s ahead of measured states every 0.05 s, by linid or, of a file, by MuJoCo."""
    kind, vector = model_of(model)
    simulator = Simulator(kind, pack_inputs([recording]), model.substeps)
    motion = measure_motion([recording])
    along = simulator.along(vector, motion.y, motion.v, motion.standstill, np.zeros((1, 1)))
    step = round(AHEAD / recording.period)
    firsts = np.arange(step // 2, recording.t.size - step - 1, step // 2)
    if not text:
        starts = along.starts(firsts, motion.y, motion.v, simulator.inputs)
        windows = Segments(np.zeros_like(firsts), firsts, np.full_like(firsts, step + 1))
        ends = simulator.run(vector, windows, starts)[0][0, step :: step + 1]
    else:
        import mujoco

        from linid.export.targets.mujoco.run_axis import run

        simple = mujoco.MjModel.from_xml_string(text)
        simple.body("mover").mass += recording.added_mass
        inputs = np.atleast_2d(recording.phase_currents if recording.drive_input is None else recording.drive_input)
        cable = np.zeros(recording.t.size)
        if "cable_force" in model.effects:
            cable = along.states[0, :, kind.states.index(STATE_PLACES["cable_force"])]
        at = np.column_stack([motion.y, motion.v, along.bristle[0], cable])[firsts]
        ends = [
            run(simple, recording.t[k : k + step + 1], inputs[:, k : k + step + 1], *row)[0, -1]
            for k, row in zip(firsts, at, strict=True)
        ]
    return np.asarray(ends) - recording.y[firsts + step]


def exported(model: FitResult, *recordings: Recording) -> Exported:
    """The model on its way to a target."""
    return Exported(model, "axis_01", recordings=recordings)
