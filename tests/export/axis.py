"""Exported models of the small axis of `tests/simulation`, and how linid itself simulates them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from linid.export.target import Exported
from linid.identification.result import Estimate, FitResult
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import Inputs, pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.simulation.axis_with_effects import AXIS, SAMPLES, start_of_run

# Every kind of term, and hidden states.
EIGHT = (
    "cogging",
    "force_ripple",
    "current_offset",
    "position_dependent_friction",
    "thermal_derating",
    "flexible_load",
    "encoder_periodic_error",
    "gravity",
    "load_dependent_friction",
)
OWN = "my_drag: -c * v * abs(v) + spline(y, -0.06, 0.09, 5)"
OWN_VALUES = {"my_drag_c": 1.5, **{f"my_drag_{k}": value for k, value in enumerate((0.4, -0.3, 0.5, 0.2, -0.4), 1)}}

LOOSE = "loose: -b * acceleration * abs(acceleration)"
LOOSE_VALUES = {"loose_b": 0.005}

PRESSED = "pressed: -c * stribeck * (1 + cos(90 * y)) * sign(v)"
PRESSED_VALUES = {"pressed_c": 0.6}


def result_of(
    effects: tuple[str, ...] = (),
    kind: str = "sine",
    law: str = "lugre",
    values: Mapping[str, float] | None = None,
    substeps: int = 2,
) -> FitResult:
    """A MODEL with the effects' sample parameters, or with `values` over them."""
    model = Model(kind, effects, law=law)
    known = dict(AXIS)
    for name in effects:
        known |= SAMPLES.get(name, {})
    known |= dict(values or {})
    nothing = np.zeros((0, 0))
    estimates = tuple(
        Estimate(p.name, p.symbol, p.unit, float(known.get(p.name, p.default)), *(math.nan,) * 3, "fixed")
        for p in model.parameters
    )
    return FitResult(
        model=kind,
        axis="linear",
        effects=model.effects,
        estimates=estimates,
        fitted=(),
        correlation=nothing,
        condition_number=1.0,
        pairs=(),
        starts={},
        objectives={},
        residual_rms={},
        history=(),
        stop_reasons=(),
        converged=True,
        seed=1,
        evaluations=0,
        substeps=substeps,
        step_error=0.0,
        law=law,
    )


def exported(effects: tuple[str, ...] = (), **more: object) -> Exported:
    """Such a model on its way to a target."""
    return Exported(result_of(effects, **more), "axis_model")  # type: ignore[arg-type]


def simulated(model: Exported, recording: Recording) -> tuple[np.ndarray, np.ndarray, Inputs]:
    """Reading (n,) in m and speed (n,) in m/s as linid simulates it from the start of `synchronous_run`."""
    inputs = pack_inputs([recording])
    simulator = Simulator(model.model, inputs, model.result.substeps)
    start = np.array([[(*start_of_run()[:2], math.nan)]])
    y, v, _ = simulator.run(model.vector[None, :], whole_recordings(inputs), start, velocity=True)
    return y[0], v[0], inputs
