"""Free wheels in MuJoCo: a body on a slide joint, braked by the LuGre friction of the `dcmotor` actuator."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from tests.benchmarks.peers.problems import Problem, Simulation

Array = NDArray[np.float64]

# A motor constant has to be given; this one is so small that the motor itself neither pushes nor brakes.
_BODY = """<mujoco><option timestep="{step}" gravity="0 0 0" integrator="RK4"><flag autoreset="disable"/></option>
<worldbody><body><joint name="axis" type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
</body></worldbody><actuator><dcmotor joint="axis" motorconst="1e-12" resistance="1" lugre="1e4 1e2 1 2 1e-2"/>
</actuator></mujoco>"""
# Without `autoreset` an unstable simulation stays nan instead of beginning anew; its warnings would fill a log file.
_SIGMA, _LEVELS = 5, 3  # where the parameters of LuGre stand among those of the actuator


def simulation(problem: Problem, substeps: int) -> Simulation:
    """Free wheels with `substeps` steps per sample."""
    mujoco.set_mju_user_warning(lambda message: None)
    models, data = [], []
    for recording in problem.recordings:
        models.append(mujoco.MjModel.from_xml_string(_BODY.format(step=recording.period / substeps)))
        data.append(mujoco.MjData(models[-1]))
    physics = mujoco.mjtState.mjSTATE_FULLPHYSICS
    size = mujoco.mj_stateSize(models[0], physics)

    def simulate(values: dict[str, float]) -> Array:
        rows = []
        for recording, start, model, scratch in zip(
            problem.recordings, problem.starts(values), models, data, strict=True
        ):
            model.body_mass[1] = values["mass"] + recording.added_mass
            model.dof_damping[0] = values["viscous_friction"]
            model.actuator_dynprm[0, _SIGMA : _SIGMA + 2] = values["bristle_stiffness"], values["bristle_damping"]
            model.actuator_biasprm[0, _LEVELS : _LEVELS + 3] = (
                values["coulomb_force"],
                values["static_force"],
                values["stribeck_velocity"],
            )
            mujoco.mj_setConst(model, scratch)
            initial = np.zeros(size)
            initial[1:] = start  # after the time: position, speed, bristle
            states, _ = rollout.rollout(model, scratch, initial, nstep=(recording.t.size - 1) * substeps)
            rows.append(np.concatenate([[start[0]], states[0, substeps - 1 :: substeps, 1]]))
        return np.concatenate(rows)

    return simulate
