"""What each hidden effect truly contributes to the gap: the shares that a diagnosis' budget is scored against.

Definition. Along the hidden plant's own motion, under the currents that its sensors show, r = a - a_base is the
acceleration that the base model with its true parameters misses (as in `linid.challenge.strength`: smoothed by the same
bump; what the encoder reads too much counts by the bump's second derivative). It is the sum of what the effects cause:

    r = sum of r_e,    r_e = (a(e) - a(none) + a(all) - a(all but e)) / 2  + what e does to the reading

a(S): acceleration of a plant with the effects S alone that is led along that motion, its bristles, windings, loads and
delays included. r_e is the Shapley value of e as long as effects act on each other in pairs only; what threefold
interplay and rounding leave is dealt out evenly. What the base can absorb does not count: its parameters (thrust,
bristle force, viscous friction, mass; stiffness and damping of the bristles, static force, Stribeck velocity; phase,
wavenumber and winding displacement of the field) are fitted to r on the fitted recordings, to first order about the
true ones, and r~ = r - (that fit) is judged on the held-out ones, each in units of its sensors' noise. With <., .> the
mean over held-out rows

    share of e = <r~_e, r~> / <r~, r~>

which is the Shapley value of e in the game "mean square of what is still missing when the effects S are in the model",
for all orders at once and in one pass: for a sum of contributions that game is quadratic, and the value of e in it is
its covariance with the sum. Shares sum to 1; one is negative where an effect hides what others cause. They depend
on plant and motion only, not on anybody's functional forms, and are what a joint fit of base and effects converges to.

Rows that touch a step of the command are left out, as no balance can resolve them. Of a plant with another friction law
than LuGre's, what LuGre's misses counts as unexplained, as do effects outside the library: an upper bound, since a
search may find parameters of LuGre's that are better than those to first order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.challenge.catalogue import LISTED
from linid.challenge.entries import HiddenEffect
from linid.challenge.hidden_axis import HiddenAxis, thrust_per_ampere
from linid.challenge.kernel import layout
from linid.challenge.kernel.inputs import Plant
from linid.challenge.plant import acts, build_plant, field_tables, integrated, reading_errors, turned_field
from linid.challenge.strength import bump, half_width
from linid.stand.mode_descriptions import Mode
from linid.stand.modes import Command, command

SUBSTEPS = 2  # integration steps per loop period; the motion need not be the recorded one to the last bit
_STEP = 0.02  # of the current limit: a larger change of the command from one loop to the next is a step
_TOLD = 1e-6  # of the strongest combination of the base's columns: weaker ones are noise of the integration
_TURN = 1e-3  # rad, by which the field is turned for a difference
_LEAST_FLOOR = 0.3  # of the median: no recording counts more than that however quiet it is


@dataclass(frozen=True)
class Truth:
    """gap: held-out mean square of what the base misses after its linear refit, in floors of the sensors' noise;
    shares: effect -> its share of the gap; unexplained: share that no listed effect has. gap None: not told."""

    gap: float | None
    shares: dict[str, float]
    unexplained: float


@dataclass(frozen=True)
class Rows:
    """One recording's rows: causes (effects and law, n) and columns of the base (k, n); scale: noise, m/s^2."""

    causes: Array
    base: Array
    scale: float
    held_out: bool


def true_shares(description: HiddenAxis, effects: Sequence[HiddenEffect], *, first_index: int = 0) -> Truth:
    """The gap of a campaign and each effect's share of it, as in this module's definition.

    first_index: see `index` of `plant.simulate`.
    """
    parts = [
        _rows(description, mode, effects, first_index + index, command(mode, description))
        for index, mode in enumerate(description.campaign)
    ]
    least = _LEAST_FLOOR * float(np.median([part.scale for part in parts]))
    scaled = [(part, 1 / max(part.scale, least)) for part in parts]
    fit = [(part.base * w, part.causes * w) for part, w in scaled if not part.held_out]
    base, causes = (np.hstack(group) for group in zip(*fit, strict=True))
    norms = np.linalg.norm(base, axis=1) + 1e-300
    taken = np.linalg.lstsq((base / norms[:, None]).T, causes.T, rcond=_TOLD)[0] / norms[:, None]
    left = np.hstack([(part.causes - taken.T @ part.base) * w for part, w in scaled if part.held_out])
    whole = left.sum(axis=0)
    gap = float(np.mean(whole**2))
    values = left @ whole / max(float(whole @ whole), 1e-300)
    shares = dict(zip([effect.name for effect in effects], map(float, values), strict=False))
    outside = sum(share for name, share in shares.items() if name not in LISTED)
    return Truth(gap, shares, outside + float(values[-1]))


@dataclass(frozen=True)
class _Led:
    """One recording's true motion, along which plants are led: whole has all effects; path: see `kernel.inputs.Orders`;
    columns: (LOGGED, n) what the whole plant logs."""

    description: HiddenAxis
    mode: Mode
    index: int
    told: Command
    whole: Plant
    path: Array
    columns: Array

    @property
    def base_law(self) -> int:
        """The friction law of the base: LuGre, of which Coulomb's is the limit that these steps cannot follow."""
        return self.whole.law if self.description.law == "coulomb" else layout.LUGRE

    def along(self, present: Sequence[HiddenEffect], **changes: Any) -> Array:
        """What a plant with these effects logs along the motion, (LOGGED, n); changes: of its numbers."""
        powered = self.told.control != 0
        plant = build_plant(self.description, self.mode, present, index=self.index, powered=powered)
        # The shown currents are what they are: commutated by the true reading, with the true offsets in them.
        seen = 1 << layout.ENCODER & self.whole.on
        number = plant.number.copy()
        number[layout.ENCODER] = self.whole.number[layout.ENCODER]
        plant = plant._replace(
            on=plant.on | seen,
            number=number,
            offsets=self.whole.offsets,
            base_phases=field_tables(self.description, present),
            trusted=not any(effect.name == "current_offset" for effect in present),
        )
        plant = plant._replace(**changes)
        return integrated(self.description, self.mode, plant, self.told, 1, path=self.path)[0].T

    def acceleration(self, present: Sequence[HiddenEffect], **changes: Any) -> Array:
        """The acceleration alone, (n,) in m/s^2."""
        row: Array = self.along(present, **changes)[layout.ACCELERATION]
        return row


def contributions(
    description: HiddenAxis, mode: Mode, effects: Sequence[HiddenEffect], index: int, told: Command
) -> tuple[Array, Array, Array]:
    """What each effect, and last the friction law, causes at the logged instants of one recording.

    Returns accelerations (effects + 1, n) in m/s^2, reading errors (effects + 1, n) in m, and the base's columns
    (11, n): thrust, bristle force, viscous friction and inertia per mass, and what other bristle stiffness, bristle
    damping, static force, Stribeck velocity, field phase, wavenumber and winding displacement change.
    """
    whole = build_plant(description, mode, effects, index=index, powered=told.control != 0)
    every = description.loops_per_sample
    fine, _ = integrated(description, mode, whole, told, SUBSTEPS, every=1)
    path = np.ascontiguousarray(fine[:, [layout.Y, layout.V, layout.ACCELERATION, layout.IQ]])
    columns = np.ascontiguousarray(fine[::every].T)
    led = _Led(description, mode, index, told, whole, path, columns)
    none = led.along(())
    base = none if led.base_law == whole.law else led.along((), law=led.base_law)
    caused = _caused(led, effects, none[layout.ACCELERATION])
    if base is not none:
        caused[-1] = none[layout.ACCELERATION] - base[layout.ACCELERATION]
    errors = np.zeros_like(caused)
    t = np.arange(columns.shape[1], dtype=np.float64) * np.float64(description.measurement.sample_period_s)
    for name, error in reading_errors(whole, effects, t, columns).items():
        errors[[effect.name for effect in effects].index(name)] = error
    return caused, errors, _base_columns(led, base)


def _caused(led: _Led, effects: Sequence[HiddenEffect], none: Array) -> Array:
    """What each effect causes along a motion, and a row of zeros, (effects + 1, n) in m/s^2; none: (n,) acceleration
    without effects."""
    acting = [effect for effect in effects if acts(effect, led.mode, led.told.control != 0)]
    whole = led.columns[layout.ACCELERATION]
    true = whole - none
    caused = np.zeros((len(effects) + 1, true.size))
    for k, effect in enumerate(effects):
        if effect not in acting:
            continue
        others = [other for other in acting if other is not effect]
        alone = led.acceleration([effect]) - none if others else true
        last = whole - led.acceleration(others) if others else true
        caused[k] = 0.5 * (alone + last)
    if acting:
        caused[[effect in acting for effect in effects] + [False]] += (true - caused.sum(axis=0)) / len(acting)
    return caused


def _base_columns(led: _Led, base: Array) -> Array:
    """The base's columns, see `contributions`; base: (LOGGED, n) what the base logs along the motion."""
    whole, columns = led.whole, led.columns
    damping = whole.sigma_1 + 0.2 * math.sqrt(whole.sigma_0 * whole.base_mass)
    changes: list[dict[str, Any]] = [
        {"sigma_0": 0.8 * whole.sigma_0},
        {"sigma_1": damping},
        {"static": whole.static + 0.1 * whole.coulomb},
        {"stribeck": 0.8 * whole.stribeck},
    ]
    changes += [turned_field(whole.base_phases, turn) for turn in _TURN * np.array([[1.0, 1.0, 1.0], [-1.0, 0.0, 1.0]])]
    a = base[layout.ACCELERATION]
    bends = [led.acceleration((), law=led.base_law, **change) - a for change in changes]
    bends.append(bends[4] * columns[layout.Y])
    thrust, viscous = base[layout.THRUST] / whole.base_mass, columns[layout.V] / whole.base_mass
    bristle = thrust - a - whole.sigma_2 * viscous
    return np.stack([thrust, bristle, viscous, a / whole.base_mass, *bends])


def _rows(description: HiddenAxis, mode: Mode, effects: Sequence[HiddenEffect], index: int, told: Command) -> Rows:
    caused, errors, base = contributions(description, mode, effects, index, told)
    period = description.measurement.sample_period_s
    width = half_width(period)
    smooth, curve = bump(width, period)

    def smoothed(rows: Array, weights: Array) -> Array:
        return np.stack([np.convolve(row, weights, "valid") for row in rows])

    causes = smoothed(caused, smooth) + smoothed(errors, curve)
    keep = _without_steps(description, told, width, causes.shape[1])
    return Rows(
        causes[:, keep],
        smoothed(base, smooth)[:, keep],
        _noise(description, mode, told.control != 0, smooth, curve),
        mode.split == "held_out",
    )


def _without_steps(description: HiddenAxis, told: Command, width: int, rows: int) -> NDArray[np.bool_]:
    """(rows,) false where the bump touches a step of the commanded current; row k is centred on sample
    k + width - 1."""
    every = description.loops_per_sample
    jumps = np.flatnonzero(np.abs(np.diff(told.current)) > _STEP * description.drive.current_limit_a) // every
    keep = np.ones(rows + 2 * (width - 1), dtype=bool)
    for jump in jumps:
        keep[max(0, jump - width) : jump + width + 3] = False
    kept = keep[width - 1 : width - 1 + rows]
    return kept if kept.mean() > 0.2 else np.ones(rows, dtype=bool)


def _noise(description: HiddenAxis, mode: Mode, powered: bool, smooth: Array, curve: Array) -> float:
    """Standard deviation in m/s^2 that noise and resolution of encoder and currents give a smoothed row."""
    seen = description.measurement
    position = seen.position_noise_rms_m**2 + seen.position_resolution_m**2 / 12
    current = (seen.current_noise_rms_a**2 + seen.current_resolution_a**2 / 12) * powered
    push = thrust_per_ampere(description) / (description.mass_kg + mode.added_mass_kg)
    sensors = 1.5 if description.kind == "phase" else 1.0  # three currents, each with a share of the thrust
    return math.sqrt(position * float(curve @ curve) + current / sensors * push**2 * float(smooth @ smooth))
