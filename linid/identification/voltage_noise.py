"""The bias that noise of the logged voltages leaves in a winding's parameters, taken off.

A larger inductance smooths the voltages' noise and so lessens the residual: least squares prefers it. What the noise
adds to the sum of squares is known, for the windings are linear, and is subtracted (corrected score: Nakamura 1990,
Biometrika 77).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from linid.identification.genes import BOX_STD, SearchSpace
from linid.identification.polish import Linearisation, PolishResult
from linid.identification.problem import Cost, Problem
from linid.identification.winding_currents import WindingCurrents
from linid.physics.electrical import PARAMETERS
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.currents import currents_along
from linid.simulation.inputs import pack_inputs

Array = NDArray[np.float64]
_ROUNDS = 3
_STEP = 1e-4  # of a gene
_TAPS = 256  # samples of an impulse's answer


def without_voltage_noise(problem: Problem, fit: PolishResult) -> PolishResult:
    """The fit moved back by what the noise of its voltages has shifted it."""
    found = _winding_part(problem)
    if found is None:
        return fit
    place, part = found
    x = np.concatenate([fit.genes, fit.offsets])
    line = _weighted(problem, x)
    p = fit.genes.size
    residuals, jacobian = fit.residuals, fit.jacobian
    for _ in range(_ROUNDS):
        excess = np.zeros(x.size)
        excess[:p] = _excess(problem.space, part, x[:p], line.weights[place])
        information = jacobian.T @ jacobian
        information[np.diag_indices_from(information)] += np.where(np.arange(x.size) < p, BOX_STD**-2, 1e-12)
        x = x + np.linalg.solve(information, excess - jacobian.T @ residuals)
        x[:p] = np.clip(x[:p], 0.0, 1.0)
        residuals, jacobian = line.residuals(x), line.jacobian(x)
    return replace(fit, genes=x[:p], offsets=x[p:], residuals=residuals, jacobian=jacobian)


def _winding_part(problem: Problem) -> tuple[int, WindingCurrents] | None:
    """The part with phase voltages and its place, None where there is none."""
    return next(((k, part) for k, part in enumerate(problem.parts) if isinstance(part, WindingCurrents)), None)


def _weighted(problem: Problem, x: Array) -> Linearisation:
    """The linearisation with its weights taken at x, genes and offsets."""
    line = Linearisation(problem, Cost(problem))
    line.reweight(x)
    return line


def noise_curvature(problem: Problem, fit: PolishResult) -> Array:
    """Second derivatives (p, p) of half the noise's weighted square: information that only the voltages' noise feigns.

    Zeros where no voltages were fitted.
    """
    genes = fit.genes
    out = np.zeros((genes.size, genes.size))
    found = _winding_part(problem)
    if found is None:
        return out
    place, part = found
    weights = _weighted(problem, np.concatenate([genes, fit.offsets])).weights[place]
    names = [gene.name for gene in problem.space.genes]
    for name in (q.name for q in PARAMETERS[problem.space.model.winding] if q.name in names):
        step = np.zeros(genes.size)
        step[names.index(name)] = 10.0 * _STEP
        high = _excess(problem.space, part, genes + step, weights)
        low = _excess(problem.space, part, genes - step, weights)
        out[names.index(name)] = (high - low) / (20.0 * _STEP)
    return np.asarray(0.5 * (out + out.T))


def _excess(space: SearchSpace, part: WindingCurrents, genes: Array, weights: Array) -> Array:
    """Gradient (p,) of half the weighted square that the voltages' noise has in the simulated currents.

    Along a measured motion the windings are a linear filter, so its gain is all that is needed.
    weights: (N,) of the part's residuals.
    """
    names = [gene.name for gene in space.genes]
    excess = np.zeros(genes.size)
    for name in (p.name for p in PARAMETERS[space.model.winding]):
        if name in names:
            column = names.index(name)
            moved = np.repeat(genes[None], 2, axis=0)
            moved[:, column] += (-_STEP, _STEP)
            low, high = (_noise_square(space.model, vector, part, weights) for vector in space.vectors(moved))
            excess[column] = 0.5 * (high - low) / (2.0 * _STEP)
    return excess


def _noise_square(model: Model, vector: Array, part: WindingCurrents, weights: Array) -> float:
    """Expected weighted square of the noise in the simulated currents of all recordings."""
    total = 0.0
    for index, recording in enumerate(part.recordings):
        assert recording.phase_voltages is not None
        variances = np.array([voltage_noise_level(channel) ** 2 for channel in recording.phase_voltages])
        gain = noise_gain(model, vector, float(part.inputs.dts[index]))
        for phase in range(3):
            mine = weights[part.classes == 3 * index + phase]
            total += float(mine @ mine) * float(gain[phase] @ variances)
    return total


def noise_gain(model: Model, vector: Array, dt: float) -> Array:
    """Variance (3, 3) in A^2/V^2 of each phase current by white noise in each sampled voltage; dt: s.

    Sum of squares of the answer of resting windings to a single sample, through the spline that joins the samples.
    """
    gain = np.zeros((3, 3))
    t = np.arange(float(_TAPS)) * dt
    for channel in range(3):
        voltages = np.zeros((3, _TAPS))
        voltages[channel, _TAPS // 4] = 1.0
        inputs = pack_inputs([Recording("impulse", t, np.zeros(_TAPS), phase_voltages=voltages)], voltages=True)
        rest = np.zeros(_TAPS)
        answer = currents_along(model, vector[None], inputs, rest, rest, np.zeros((1, 3)))[0]
        gain[:, channel] = np.sum(answer**2, axis=1)
    return gain


def voltage_noise_level(samples: Array) -> float:
    """Standard deviation in V of white noise in a phase voltage (n,), from eighth differences.

    Commutated voltages turn by a third of a radian per sample; only that many differences leave next to nothing of
    them (gain (2 sin(x / 2))^8). The variance of the noise grows by 16 over 8.
    """
    if samples.size < 16:
        return 0.0
    differences = np.diff(samples, 8)
    usual = float(np.median(np.abs(differences))) / 0.6745
    kept = differences[np.abs(differences) <= 4.0 * usual]  # nearly all of the noise, none of a step
    return float(np.sqrt(np.mean(kept**2) / math.comb(16, 8)))
