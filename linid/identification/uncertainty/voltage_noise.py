"""The bias that noise of the logged voltages leaves in a winding's parameters, taken off.

A larger inductance smooths the voltages' noise and so lessens the residual: least squares prefers it. What the noise
adds to the sum of squares is known, for the windings are linear, and is subtracted (corrected score: Nakamura 1990,
Biometrika 77).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.objectives.winding_currents import CURRENT_AXES, WindingCurrents
from linid.identification.optimise.least_squares import LeastSquaresFit
from linid.identification.optimise.linearisation import Linearisation
from linid.identification.space.search_space import BOX_STD, SearchSpace
from linid.physics.electrical import PARAMETERS
from linid.physics.model import Model
from linid.recording.noise import white_level
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.winding_currents import currents_along

_ROUNDS = 3
_STEP = 1e-4  # of a search coordinate
_TAPS = 256  # samples of an impulse's answer
# Share of what seems to tell the mutual inductance that noise may feign: with twice as much its interval is too narrow.
_FEIGNED = 0.1


def without_voltage_noise(problem: Problem, fit: LeastSquaresFit) -> LeastSquaresFit:
    """The fit moved back by what the noise of its voltages has shifted it."""
    found = _winding_part(problem)
    if found is None:
        return fit
    place, part = found
    x = np.concatenate([fit.point, fit.offsets])
    line = Linearisation(problem, Cost(problem), weights=fit.weights)
    p = fit.point.size
    residuals, jacobian = fit.residuals, fit.jacobian
    for _ in range(_ROUNDS):
        excess = np.zeros(x.size)
        excess[:p] = _excess(problem.space, part, x[:p], line.weights[place])
        information = jacobian.T @ jacobian
        information[np.diag_indices_from(information)] += np.where(np.arange(x.size) < p, BOX_STD**-2, 1e-12)
        x = x + np.linalg.solve(information, excess - jacobian.T @ residuals)
        x[:p] = np.clip(x[:p], 0.0, 1.0)
        residuals, jacobian = line.residuals(x), line.jacobian(x)
    return replace(fit, point=x[:p], offsets=x[p:], residuals=residuals, jacobian=jacobian, moved_from=None)


def _winding_part(problem: Problem) -> tuple[int, WindingCurrents] | None:
    """The part with phase voltages and its place, None where there is none."""
    return next(((k, part) for k, part in enumerate(problem.parts) if isinstance(part, WindingCurrents)), None)


def noise_curvature(problem: Problem, fit: LeastSquaresFit) -> Array:
    """Second derivatives (p, p) of half the noise's weighted square: information in search coordinates that only the
    voltages' noise feigns.

    Zeros where no voltages were fitted.
    """
    point = fit.point
    out = np.zeros((point.size, point.size))
    found = _winding_part(problem)
    if found is None:
        return out
    place, part = found
    weights = fit.weights[place]
    names = [searched.name for searched in problem.space.parameters]
    for name in (q.name for q in PARAMETERS[problem.space.model.winding] if q.name in names):
        step = np.zeros(point.size)
        step[names.index(name)] = 10.0 * _STEP
        high = _excess(problem.space, part, point + step, weights)
        low = _excess(problem.space, part, point - step, weights)
        out[names.index(name)] = (high - low) / (20.0 * _STEP)
    return np.asarray(0.5 * (out + out.T))


def _excess(space: SearchSpace, part: WindingCurrents, point: Array, weights: Array) -> Array:
    """Gradient (p,) of half the weighted square that the voltages' noise has in the simulated currents.

    Along a measured motion the windings are a linear filter, so its gain is all that is needed.
    weights: (N,) of the part's residuals.
    """
    names = [searched.name for searched in space.parameters]
    excess = np.zeros(point.size)
    for name in (p.name for p in PARAMETERS[space.model.winding]):
        if name in names:
            column = names.index(name)
            moved = np.repeat(point[None], 2, axis=0)
            moved[:, column] += (-_STEP, _STEP)
            low, high = (_noise_square(space.model, vector, part, weights) for vector in space.vectors(moved))
            excess[column] = 0.5 * (high - low) / (2.0 * _STEP)
    return excess


def _noise_square(model: Model, vector: Array, part: WindingCurrents, weights: Array) -> float:
    """Expected weighted square of the noise in the simulated currents of all recordings."""
    total = 0.0
    for index, recording in enumerate(part.recordings):
        variances = _noise_variances(recording)
        gain = noise_gain(model, vector, recording.duration / (recording.y.size - 1))
        for axis, row in enumerate(gain):
            mine = weights[part.classes == len(gain) * index + axis]
            total += float(mine @ mine) * float(row @ variances)
    return total


def _noise_variances(recording: Recording) -> Array:
    """Variance (3,) in V^2 of the white noise in each phase voltage."""
    assert recording.phase_voltages is not None
    return np.array([white_level(channel) ** 2 for channel in recording.phase_voltages])


def noise_gain(model: Model, vector: Array, dt: float) -> Array:
    """Variance (axes, 3) in A^2/V^2 along each current axis by white noise in each sampled voltage;
    vector: (VECTOR_SIZE,), SI; dt: s.

    Sum of squares of the answer of resting windings to a single sample, through the spline that joins the samples.
    """
    return np.asarray(np.sum(_impulse_answers(model, vector, dt) ** 2, axis=2))


def _impulse_answers(model: Model, vector: Array, dt: float) -> Array:
    """Currents (axes, 3, _TAPS) in A/V along each axis after a single sample of each voltage, motor at rest; dt: s."""
    axes = CURRENT_AXES[model.winding]
    out = np.zeros((len(axes), 3, _TAPS))
    t = np.arange(float(_TAPS)) * dt
    for channel in range(3):
        voltages = np.zeros((3, _TAPS))
        voltages[channel, _TAPS // 4] = 1.0
        inputs = pack_inputs([Recording("impulse", t, np.zeros(_TAPS), phase_voltages=voltages)], voltages=True)
        rest = np.zeros(_TAPS)
        out[:, channel] = axes @ currents_along(model, vector[None], inputs, rest, rest, np.zeros((1, 3)))[0]
    return out


def tells_mutual_inductance(vector: Array, part: WindingCurrents) -> bool:
    """Whether the voltages, and not their noise, drive what the currents of separate windings have in common.

    Only that hangs on L + 2 M; all else on L - M, which is held here. vector: (VECTOR_SIZE,) SI, near the truth.
    """
    model = part.model
    moved = np.repeat(vector[None], 2, axis=0)
    for name in ("phase_inductance", "mutual_inductance"):
        moved[:, model.slot(name)] += np.array([-_STEP, _STEP]) * vector[model.slot("phase_inductance")]
    low, high = part.residuals(moved, np.zeros((2, 0)))
    feigned = 0.0
    for recording in part.recordings:
        variances, dt = _noise_variances(recording), recording.duration / (recording.y.size - 1)
        change = np.diff([_impulse_answers(model, one, dt) for one in moved], axis=0)[0]
        feigned += recording.y.size * float(np.sum(change**2, axis=2).sum(axis=0) @ variances)
    return feigned < _FEIGNED * float((high - low) @ (high - low))
