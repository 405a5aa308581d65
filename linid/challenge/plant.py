"""The hidden plant: a described axis with withheld effects, run under the commands of one recording."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.challenge import kernel
from linid.challenge.catalogue import ENTRIES, HiddenEffect
from linid.challenge.hidden_axis import HiddenAxis
from linid.challenge.kernel import Loops, Plant
from linid.stand.mode_descriptions import Mode
from linid.stand.modes import Command, command
from linid.stand.plant import motor_harmonics

WALK_STEP = 0.01  # s
_LAW = {"lugre": kernel.LUGRE, "dahl": kernel.DAHL, "maxwell": kernel.MAXWELL}


@dataclass(frozen=True)
class HiddenRun:
    """Exact motion at the logged instants, (n,) arrays in SI.

    reading, currents: what encoder and current sensors show, without noise; currents (3, n), or (1, n) where only the
    q-current is logged; states (n, STATES): of the kernel; acceleration, base_acceleration: the true one, and that of
    the model without effects along this motion under the shown currents; thrust: motor force in N; mass: what the base
    model takes for the moving mass, kg; peak: (lowest, highest) position in m over all integration steps.
    """

    t: Array
    y: Array
    v: Array
    reading: Array
    currents: Array
    states: Array
    acceleration: Array
    base_acceleration: Array
    thrust: Array
    mass: float
    peak: tuple[float, float]


def simulate(
    description: HiddenAxis,
    mode: Mode,
    effects: Sequence[HiddenEffect] = (),
    *,
    index: int = 0,
    substeps: int | None = None,
    told: Command | None = None,
) -> HiddenRun:
    """Run one recording of a described axis with hidden effects.

    index: the recording's place in its campaign (phases and random walks differ between recordings); substeps:
    integration steps per drive loop period, by default steps of the description's integration_step_s; told: the
    recording's command if it is at hand.
    """
    told = told or command(mode, description)
    powered = told.control != 0
    plant = build_plant(description, mode, effects, index=index, powered=powered)
    logged, peak = integrated(description, mode, plant, told, substeps or description.substeps)
    columns = np.ascontiguousarray(logged.T)
    y, v = columns[kernel.Y], columns[kernel.V]
    t = np.arange(len(y), dtype=np.float64) * np.float64(description.measurement.sample_period_s)
    reading = y + sum(reading_errors(plant, effects, t, columns).values())
    if description.kind == "phase":
        currents = _phase_currents(plant, y, columns[kernel.IQ]) + (plant.offsets[:, None] if powered else 0.0)
    else:
        currents = columns[None, kernel.IQ]
    return HiddenRun(
        t,
        y,
        v,
        reading,
        currents,
        logged[:, : kernel.STATES],
        columns[kernel.ACCELERATION],
        columns[kernel.BASE_ACCELERATION],
        columns[kernel.THRUST],
        plant.base_mass,
        peak,
    )


def integrated(
    description: HiddenAxis,
    mode: Mode,
    plant: Plant,
    told: Command,
    substeps: int,
    *,
    every: int | None = None,
    path: Array | None = None,
) -> tuple[Array, tuple[float, float]]:
    """What the kernel logs, (n, LOGGED), and the lowest and highest position in m.

    every: loop periods between what is logged (default: the scope's samples); path: (loops, 4) motion along which the
    plant is led, see `kernel.integrate`.
    """
    drive = description.drive
    loops = Loops(
        drive.loop_period_s,
        drive.current_limit_a,
        drive.position_gain_per_s,
        drive.velocity_gain_a_s_per_m,
        drive.velocity_integral_gain_a_per_m,
        drive.velocity_feedforward,
    )
    base_w0 = w0 = 0.0
    if told.v0:
        # Bristles at their steady deflection.
        w0, base_w0 = (
            math.copysign(kernel.sliding(mode.start_position_m, told.v0, 0.0, 0.0, 0.0, 0.0, p) / p.sigma_0, told.v0)
            for p in (plant, plant._replace(on=0))
        )
    logged, low, high = kernel.integrate(
        plant,
        loops,
        told.control,
        told.current,
        told.y_reference,
        told.v_reference,
        told.push,
        mode.start_position_m,
        told.v0,
        w0,
        base_w0,
        substeps,
        every or description.loops_per_sample,
        np.zeros((0, 4)) if path is None else path,
    )
    return logged, (low, high)


def acts(effect: HiddenEffect, mode: Mode, powered: bool) -> bool:
    """Whether an effect can act in a recording."""
    scope = ENTRIES[effect.name].scope
    return mode.name in effect.recordings if scope == "chosen" else powered or scope == "all"


def build_plant(
    description: HiddenAxis, mode: Mode, effects: Sequence[HiddenEffect], *, index: int, powered: bool
) -> Plant:
    """The kernel's numbers for one recording; effects of amplitude zero, or that do not act in it, are left out."""
    on = 0
    number = np.ones((kernel.ROWS, kernel.COLUMNS))
    number[:, 0] = 0.0
    friction = description.friction
    forcer = description.mass_kg
    payload = load = gear = 0.0
    offsets = np.zeros(3)
    walk = wander = np.zeros(2)
    pushes = np.zeros((0, 3))
    base = field_tables(description, ())
    present = [e for e in effects if e.amplitude != 0.0 and acts(e, mode, powered)]
    for effect in present:
        row = ENTRIES[effect.name].row
        if row is not None:
            on |= 1 << row
            values = [effect.amplitude, *effect.shape.values()]
            number[row, : len(values)] = values
        if effect.name == "payload_change":
            payload = effect.amplitude
        elif effect.name == "flexible_load":
            load = effect.amplitude * forcer
        elif effect.name == "drive_train_backlash":
            gear = effect.amplitude * forcer
        elif effect.name == "external_disturbance":
            pushes = _pushes(effect, mode)
        elif effect.name == "wandering_force":
            wander = _walk(effect, index, mode.duration_s)
        elif effect.name == "current_offset":
            offsets = effect.amplitude * np.array([effect.shape[phase] for phase in "uvw"])
        elif effect.name == "walking_friction":
            walk = _walk(effect, index, mode.duration_s)
        elif effect.name == "floor_vibration":
            number[kernel.VIBRATION, 2] += 2.4 * index  # recordings start at any moment of it
    table = field_tables(description, present)
    motor = motor_harmonics(description.motor)
    return Plant(
        mass=forcer - load - gear + mode.added_mass_kg + payload,
        load_mass=load,
        gear_mass=gear,
        base_mass=forcer + mode.added_mass_kg,
        law=_LAW[description.law],
        shares=np.array(description.shares),
        stiffness=friction.bristle_stiffness_n_per_m * np.array(description.stiffnesses),
        bend=description.bend,
        coulomb=friction.coulomb_force_n,
        static=friction.static_force_n,
        stribeck=friction.stribeck_velocity_m_per_s,
        exponent=friction.stribeck_exponent,
        sigma_0=friction.bristle_stiffness_n_per_m,
        sigma_1=friction.bristle_damping_n_s_per_m,
        sigma_2=friction.viscous_friction_n_s_per_m,
        field=_contracted(table),
        base_field=_contracted(base),
        base_phases=base,
        density=motor[1],
        shift=motor[3],
        polarity=math.copysign(1.0, motor[0][0, 1]),
        current_lag=description.drive.current_time_constant_s,
        offsets=offsets,
        trusted=False,
        on=on,
        number=number,
        walk=walk,
        wander=wander,
        walk_step=WALK_STEP,
        pushes=pushes,
    )


def field_tables(description: HiddenAxis, effects: Sequence[HiddenEffect]) -> Array:
    """The field of each phase, (m, 2, 3): row m has the factors in N/A of sin and cos of (2m+1) times the angle.

    Phase j = -1, 0, 1 of harmonic n: c_n sin(n (angle + p j)). Field harmonics of order 5 and 7 (`force_ripple`, in
    shares of the fundamental) and the phases' gains (`phase_gain_imbalance`) belong to the hidden field.
    """
    harmonics, _, displacement, _ = motor_harmonics(description.motor)
    hidden = {effect.name: effect for effect in effects}
    phases = np.array([-1.0, 0.0, 1.0])
    rows = max(len(harmonics), 4 if "force_ripple" in hidden else 0)
    table = np.zeros((rows, 2, 3))
    for order, strength in harmonics:
        turned = order * displacement * phases
        table[int(order) // 2] += strength * np.stack([np.cos(turned), np.sin(turned)])
    ripple = hidden.get("force_ripple")
    if ripple is not None:
        shares = ((5, 1.0, ripple.shape["fifth_phase"]), (7, ripple.shape["seventh"], ripple.shape["seventh_phase"]))
        for n, share, phase in shares:
            turned = n * displacement * phases + phase
            strength = harmonics[0, 1] * ripple.amplitude * share
            table[n // 2] += strength * np.stack([np.cos(turned), np.sin(turned)])
    gains = hidden.get("phase_gain_imbalance")
    if gains is not None:
        table *= 1.0 + gains.amplitude * np.array([gains.shape[phase] for phase in "uvw"])
    return table


def turned_field(table: Array, turn: Array) -> dict[str, Array]:
    """A field without hidden effects, (m, 2, 3), whose phases are turned by electrical angles (3,) rad, under the names
    that a plant gives it."""
    angles = (2 * np.arange(len(table)) + 1)[:, None] * turn
    sine, cosine = table[:, 0], table[:, 1]
    turned = np.stack(
        [sine * np.cos(angles) - cosine * np.sin(angles), sine * np.sin(angles) + cosine * np.cos(angles)], axis=1
    )
    return {"field": _contracted(turned), "base_field": _contracted(turned), "base_phases": turned}


def _contracted(table: Array) -> Array:
    """Per harmonic the factors of (sin a, sin b, cos a, cos b), a and b the stationary current components."""
    turned = 2 * math.pi / 3 * np.array([-1.0, 0.0, 1.0])
    both = np.stack([np.cos(turned), np.sin(turned)])
    return np.ascontiguousarray(np.einsum("mij,kj->mik", table, both).reshape(len(table), 4))


def _phase_currents(plant: Plant, y: Array, i_q: Array) -> Array:
    angle = plant.density * (y + _encoder(plant, y)) + plant.shift
    return np.stack([plant.polarity * i_q * np.sin(angle + 2 * math.pi / 3 * j) for j in (-1, 0, 1)])


def _walk(effect: HiddenEffect, index: int, duration: float) -> Array:
    """A stationary first-order random process of unit variance at knots WALK_STEP apart."""
    random = np.random.default_rng([int(effect.shape["seed"]), index])
    keep = math.exp(-WALK_STEP / effect.shape["memory"])
    drawn = random.standard_normal(int(duration / WALK_STEP) + 3)
    walk = np.empty_like(drawn)
    walk[0] = drawn[0]
    for k in range(1, len(walk)):
        walk[k] = keep * walk[k - 1] + math.sqrt(1 - keep**2) * drawn[k]
    return walk


def _pushes(effect: HiddenEffect, mode: Mode) -> Array:
    """Size in N, start and length in s of those that meet a recording, (k, 3)."""
    if not effect.pushes:
        return np.array([[effect.amplitude, *effect.shape.values()]])
    mine = [(effect.amplitude * size, *when) for name, size, *when in effect.pushes if name == mode.name]
    return np.array(mine).reshape(-1, 3)


def reading_errors(plant: Plant, effects: Sequence[HiddenEffect], t: Array, columns: Array) -> dict[str, Array]:
    """What each effect makes the encoder read too much at the logged instants, (n,) in m; columns: (LOGGED, n)."""
    y = columns[kernel.Y]
    errors = {}
    if plant.on >> kernel.ENCODER & 1:
        errors["encoder_periodic_error"] = _encoder(plant, y)
    if plant.on >> kernel.PLAY & 1:
        slack = columns[kernel.PLAIN_STATES + kernel.SLACK]
        errors["backlash"] = -0.5 * plant.number[kernel.PLAY, 0] * slack
    for effect in effects:
        if effect.name == "clock_beat" and effect.amplitude:
            errors[effect.name] = _beat(effect, t, columns[kernel.V])
    return errors


def _encoder(plant: Plant, y: Array) -> Array:
    if not plant.on >> kernel.ENCODER & 1:
        return np.zeros_like(y)
    amplitude, period, phase, skew = plant.number[kernel.ENCODER, :4]
    angle = 2 * math.pi * y / period + phase
    return np.asarray(amplitude * np.sin(angle + skew * np.sin(angle)))


def _beat(effect: HiddenEffect, t: Array, v: Array) -> Array:
    """Position read at an instant that wanders about the sampling instant."""
    angle = 2 * math.pi * effect.shape["frequency"] * t + effect.shape["phase"]
    return np.asarray(v * (effect.amplitude * np.sin(angle)))
