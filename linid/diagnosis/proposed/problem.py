"""What a fitted model leaves, and what a force would do to it: the rows that a proposed term is sought on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from linid.arrays import Array, Flags, Integers
from linid.diagnosis.balance import Rows
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.locate import pushing_input, recording_masses
from linid.diagnosis.proposed.history import Memory, last_where, memory_of, travelled
from linid.diagnosis.proposed.response import pushed_rows, rates_of, resisted_rows
from linid.diagnosis.seen import field_wavenumber
from linid.diagnosis.unknowns import ACROSS, Coordinate
from linid.errors import ConfigError
from linid.physics.effects.registry import canonical, find_effect
from linid.physics.friction import PARAMETERS, stribeck_levels

# How far a base parameter may be wrong: share of its value, or of a logarithm's unit; what a step of that size costs,
# as a share of all that is left. Without it a direction that these recordings hardly tell, such as the current across
# the thrust, is moved a hundred times its size to imitate something that is missing.
WRONG, COST = 0.3, 0.03
_PROBE, _SHARE = "probe: c*F", 1e-3  # a term that shows the motor's force, and the share of it that it adds
_SMOOTH = 5.0  # usual distances of rows, beyond which two say nothing of a rate between them


@dataclass(frozen=True)
class Problem:
    """Rows (n,) with what a model leaves of them.

    residual: (n,) m/s^2; weights: (n,) s^2/m, a residual times its weight is about 1 where all is left; noise: (n,)
    (m/s^2)^2 by encoder and inputs; base: (n, r) weighted columns of what the model's own parameters can do; ridge:
    (r,) what holds each of these; mass: (n,) kg; push: (n,) motor force in N; friction: (n,) on the mass over its
    steady level, with its presliding; stribeck: (n,) that level over Coulomb's force; blur: (n,) s, deviation of the
    moments that a row is the mean of; relaxed: m of travel in which a bristle forgets a rest; follows: (n,) m in which
    it follows its level; damped: s in which it follows one that rises; held: (n,) judging rows; elapsed: (R,) s of the
    campaign at each recording's start; field: rad/m of the motor's field or None; rotary: whether lengths are angles;
    seed: of the null's draws.
    """

    rows: Rows
    residual: Array
    weights: Array
    noise: Array
    base: Array
    ridge: Array
    mass: Array
    push: Array
    friction: Array
    stribeck: Array
    blur: Array
    relaxed: float
    follows: Array
    damped: float
    held: Flags
    elapsed: Array
    field: float | None
    rotary: bool
    seed: int

    @property
    def rest(self) -> Array:
        """What is left (n,), weighted."""
        return self.residual * self.weights

    @property
    def floor(self) -> float:
        """Share of what is left on the judging rows that is noise, 0 to 1."""
        mine = self.held
        left = float(np.sum(self.rest[mine] ** 2))
        return min(float(np.sum((self.noise * self.weights**2)[mine])) / max(left, 1e-300), 1.0)

    @cached_property
    def memory(self) -> Memory:
        """What the axis remembers at each row."""
        return memory_of(self.rows)

    @cached_property
    def _kept(self) -> Array:
        """The share (n,) of the row before that a bristle still remembers, 0 where a recording begins and at rest."""
        kept = np.exp(-np.gradient(travelled(self.rows)) / self.follows)
        return np.where(np.diff(self.rows.recording, prepend=-1).astype(bool) | self.rows.standstill, 0.0, kept)

    @cached_property
    def _taken_on(self) -> Array:
        """The share (n,) of a level, with its direction, that the bristle takes on from the row before."""
        return np.where(self.rows.standstill, 0.0, (1.0 - self._kept) * self.friction)

    @cached_property
    def rests(self) -> tuple[Integers, Array]:
        """The row of the last rest (n,), and the share of it (n,) that the bristle still remembers."""
        last = last_where(self.rows.standstill, self.rows.recording)
        path = travelled(self.rows)
        place = np.maximum(last, 0)
        return place, np.where(last >= 0, np.exp(-(path - path[place]) / self.relaxed), 0.0)

    @cached_property
    def _inner(self) -> Flags:
        """Rows (n,) with neighbours on either side that tell a rate."""
        t, owner = self.rows.t, self.rows.recording
        out = np.zeros(t.size, dtype=np.bool_)
        out[1:-1] = (owner[2:] == owner[:-2]) & (t[2:] - t[:-2] < _SMOOTH * float(np.median(np.diff(t))))
        return out

    def rates(self, values: Array) -> Array:
        """How fast values (n, k) change, (n, k) per second; 0 where rows are missing between."""
        return rates_of(np.ascontiguousarray(values, dtype=np.float64), self.rows.t, self._inner)

    def pushed(self, forces: Array) -> Array:
        """What forces on the mass (n, k) in N give the rows, (n, k) in m/s^2: at rest the bristle takes them up, and
        forgets that as it slides."""
        return pushed_rows(np.ascontiguousarray(forces, dtype=np.float64), *self.rests, self.mass)

    def resisted(self, levels: Array) -> Array:
        """What higher levels (n, k) of friction in N give the rows, (n, k) in m/s^2: nothing at rest; the bristles bend
        to a new level only as the axis moves, and where it rises, their damping adds to it."""
        rising = np.ascontiguousarray(levels + self.damped * self.rates(levels))
        return resisted_rows(rising, self._taken_on, self._kept, self.mass)


def problem_of(judge: Judge, step: Fitted, seed: int) -> Problem:
    """What a fitted model leaves on the rows of a judge. seed: of the null's draws."""
    balance, values = judge.balance, step.values
    rows, recordings, held = balance.rows, balance.recordings, balance.split
    slopes = judge.fits.slopes(step)
    unknowns = {c.name: c for c in judge.fits.unknowns(step)}
    field = field_wavenumber(step.model.kind, values)
    noise = (judge.noise.encoder + judge.noise.inputs)[rows.bin]
    weights = _weights(rows, step.residual, judge.scale[rows.recording], noise)
    mass = recording_masses(recordings, values["mass"])[rows.recording]
    left = float(np.sum((step.residual * weights)[~held] ** 2))
    # By place, not by name: a law that lacks one of them has set it all the same.
    at = {p.name: float(step.vector[step.model.slot(p.name)]) for p in PARAMETERS}
    coulomb, stiffness = at["coulomb_force"], at["bristle_stiffness"]
    curve = [at[name] for name in ("coulomb_force", "static_force", "stribeck_velocity", "stribeck_exponent")]
    steady = stribeck_levels(rows.v, *curve)
    plausible = np.array([_plausible(c, values, rows) for c in unknowns.values()])
    return Problem(
        rows=rows,
        residual=step.residual,
        weights=weights,
        noise=noise,
        base=weighted_base(slopes, weights),
        ridge=math.sqrt(COST * left) / plausible,
        mass=mass,
        push=_motor_force(judge, step, field),
        friction=-slopes["coulomb_force"] / _counted(unknowns["coulomb_force"], values) * mass * coulomb / steady,
        stribeck=steady / coulomb,
        blur=balance.blur[rows.recording],
        relaxed=coulomb / stiffness,
        follows=steady / stiffness,
        damped=at["bristle_damping"] / stiffness,
        held=held,
        elapsed=np.array([r.elapsed for r in recordings]),
        field=field,
        rotary=recordings[0].axis == "rotary",
        seed=seed,
    )


def weighted_base(slopes: Mapping[str, Array], weights: Array) -> Array:
    """Weighted columns (n, r) of what a model's own parameters can do.

    slopes: d residual / d unknown (n,) by name; weights: (n,) s^2/m.
    """
    return np.array([-slope * weights for slope in slopes.values()]).T


def _motor_force(judge: Judge, step: Fitted, field: float | None) -> Array:
    """The motor's force (n,) in N along the motion: the input along the thrust, in the model's own size and sign."""
    rows = judge.balance.rows
    constant = step.values.get("force_constant", 0.0)
    if not constant:
        return np.zeros(rows.t.size)
    push = constant * pushing_input(rows, judge.balance.recordings, field)
    (probe,) = canonical((_PROBE,))
    try:
        model = step.model.with_effects((*step.model.effects, probe))
    except ConfigError:  # as many own terms as a model can have
        return np.asarray(push)
    (amplitude,) = find_effect(probe).parameters
    vector = model.vector({**step.values, **step.preset, amplitude.name: _SHARE})
    shown = step.residual - judge.balance.residuals(model, vector[None, :])[0]
    moving = ~rows.standstill
    told = shown[moving] * recording_masses(judge.balance.recordings, step.values["mass"])[rows.recording[moving]]
    return np.asarray(push * float(push[moving] @ told) / max(float(push[moving] @ push[moving]), 1e-300) / _SHARE)


def _weights(rows: Rows, residual: Array, scale: Array, noise: Array) -> Array:
    """Weights (n,) in s^2/m: a bin that has more than the mean power of all counts less, so that a few bursts do not
    decide, nor what is quiet everywhere."""
    squares, floors = (residual / scale) ** 2, noise / scale**2
    usual = float(np.mean(squares)) + float(np.mean(floors))
    counts = np.maximum(np.bincount(rows.bin), 1)
    power = (np.bincount(rows.bin, squares) / counts)[rows.bin]
    return np.asarray(1.0 / (scale * np.sqrt(power + usual)))


def _counted(unknown: Coordinate, values: Mapping[str, float]) -> float:
    """What is searched over the parameter's value, for a force."""
    return unknown.for_mass / values["mass"] if unknown.for_mass else 1.0


def _plausible(unknown: Coordinate, values: Mapping[str, float], rows: Rows) -> float:
    """How far an unknown of the base may be wrong, in its own unit."""
    if unknown.deviation > 0.0:
        return unknown.deviation
    name, counted = unknown.name, WRONG * _counted(unknown, values)
    if name in ("force_constant", ACROSS):
        return counted * abs(values["force_constant"])
    if name == "coulomb_force":
        return counted * values[name]
    if name == "viscous_friction":
        top = max(float(np.quantile(np.abs(rows.v), 0.99)), 1e-12)
        return counted * max(values[name], values["coulomb_force"] / top)
    return WRONG * ((unknown.scale if unknown.log else 0.0) or abs(values.get(name, 1.0)) or 1.0)
