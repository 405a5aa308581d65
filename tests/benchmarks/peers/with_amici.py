"""Free wheels for AMICI, the simulator of PEtab problems: SUNDIALS' CVODES on compiled C++, forward sensitivities."""

from __future__ import annotations

import hashlib
import importlib.metadata
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from amici import MeasurementChannel
from amici.importers.antimony import antimony2amici
from amici.sim import sundials
from numpy.typing import NDArray

from linid.physics.friction import PARAMETERS as FRICTION
from tests.benchmarks.peers.problems import Problem
from tests.benchmarks.peers.slopes import by_differences

Array = NDArray[np.float64]

LAW = tuple(p.name for p in FRICTION if p.name != "stribeck_exponent")
STEPS = 200_000  # of CVODES, for one recording
# SI; z is the bristle's force in N, first that of steady sliding in the direction `turn_0`.
_MODEL = """model lugre
  coulomb_force = 1; static_force = 2; stribeck_velocity = 3e-3; bristle_stiffness = 1e4; bristle_damping = 90;
  viscous_friction = 2; mass = 0.5; added_mass = 0; y_0 = 0; v_0 = 1; turn_0 = 1;
  level := coulomb_force + (static_force - coulomb_force)*exp(-(v/stribeck_velocity)^2);
  speed := piecewise(v, v > 0, -v);
  w_rate := v - speed*z/level;
  y = y_0;
  v = v_0;
  z = turn_0*(coulomb_force + (static_force - coulomb_force)*exp(-(v_0/stribeck_velocity)^2));
  y' = v;
  v' = (-z - bristle_damping*w_rate - viscous_friction*v)/(mass + added_mass);
  z' = bristle_stiffness*w_rate;
end
"""
_GIVEN = ["added_mass", "y_0", "v_0", "turn_0"]


@cache
def model() -> Any:
    """The compiled model; its C++ takes half a minute once and is kept in the folder of temporary files."""
    key = _MODEL + importlib.metadata.version("amici")
    name = f"lugre_{hashlib.sha256(key.encode()).hexdigest()[:12]}"
    folder = Path(tempfile.gettempdir()) / f"amici_{name}"
    if not (folder / "done").exists():
        antimony2amici(
            _MODEL,
            model_name=name,
            output_dir=str(folder),
            fixed_parameters=_GIVEN,
            observation_model=[MeasurementChannel(id_="position", formula="y")],
            compute_conservation_laws=False,
        )
        (folder / "done").touch()
    return sundials.import_model_module(name, str(folder)).get_model()


class Amici:
    """Positions and their Jacobian by AMICI at a relative tolerance."""

    def __init__(self, problem: Problem, tolerance: float) -> None:
        self.problem, self.model = problem, model()
        if tuple(self.model.get_free_parameter_ids()) != LAW:
            raise ValueError("AMICI put the parameters in another order")
        self.solver = self.model.create_solver()
        self.solver.set_relative_tolerance(tolerance)
        self.solver.set_absolute_tolerance(1e-2 * tolerance)
        self.solver.set_max_steps(STEPS)
        self.solver.set_return_data_reporting_mode(sundials.RDataReporting.observables_likelihood)

    def positions(self, values: dict[str, float]) -> Array:
        """(N,) m; nan where CVODES gives up."""
        self.solver.set_sensitivity_order(sundials.SensitivityOrder.none)
        return np.concatenate([run.y[:, 0] for run in self._runs(values)])

    def jacobian(self, x: Array) -> Array:
        """(N, p) m at a point of the unit cube (p,); zero where CVODES gives up."""
        self.solver.set_sensitivity_order(sundials.SensitivityOrder.first)
        self.solver.set_sensitivity_method(sundials.SensitivityMethod.forward)
        slopes = np.concatenate([run.sy[:, :, 0] for run in self._runs(self.problem.values(x))])
        chain = by_differences(lambda at: np.array([self.problem.values(at)[name] for name in LAW]), x)
        return np.nan_to_num(slopes @ chain, nan=0.0, posinf=0.0, neginf=0.0)

    def _runs(self, values: dict[str, float]) -> list[Any]:
        runs = []
        for recording, state in zip(self.problem.recordings, self.problem.states, strict=True):
            self.model.set_free_parameters([values[name] for name in LAW])
            y, v = float(state[0]), float(state[1])
            self.model.set_fixed_parameters([recording.added_mass, y, v, float(np.sign(v))])
            self.model.set_timepoints(recording.t - recording.t[0])
            runs.append(sundials.run_simulation(self.model, solver=self.solver))
        return runs
