"""The hidden plant: a described axis with withheld effects, run under the commands of one recording."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array
from linid.challenge.catalogue import ENTRIES
from linid.challenge.entries import HiddenEffect
from linid.challenge.hidden_axis import HiddenAxis
from linid.challenge.kernel import layout
from linid.challenge.kernel.inputs import Orders, Plant
from linid.challenge.kernel.integration import load_integrate
from linid.stand.mode_descriptions import Mode
from linid.stand.modes import Command, command
from linid.stand.plant import drive_parameters, motor_harmonics, plant_parameters

WALK_STEP = 0.01  # s
_LAW = {
    "lugre": layout.LUGRE,
    "dahl": layout.DAHL,
    "maxwell": layout.MAXWELL,
    # One spring far stiffer than any encoder sees.
    "coulomb": layout.MAXWELL,
    "elasto_plastic": layout.ELASTO_PLASTIC,
}


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
    y, v = columns[layout.Y], columns[layout.V]
    t = np.arange(len(y), dtype=np.float64) * np.float64(description.measurement.sample_period_s)
    reading = y + sum(reading_errors(plant, effects, t, columns).values())
    if description.kind == "phase":
        currents = _phase_currents(plant, y, columns[layout.IQ]) + (plant.offsets[:, None] if powered else 0.0)
    else:
        currents = columns[None, layout.IQ]
    return HiddenRun(
        t,
        y,
        v,
        reading,
        currents,
        logged[:, : layout.STATES],
        columns[layout.ACCELERATION],
        columns[layout.BASE_ACCELERATION],
        columns[layout.THRUST],
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
    plant is led, see `kernel.inputs.Orders`.
    """
    none = np.zeros((0, 4))
    orders = Orders(
        told.control, told.current, told.y_reference, told.v_reference, told.push, none if path is None else path
    )
    logged, low, high = load_integrate()(
        plant,
        drive_parameters(description),
        orders,
        mode.start_position_m,
        told.v0,
        substeps,
        every or description.loops_per_sample,
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
    present = [e for e in effects if e.amplitude != 0.0 and acts(e, mode, powered)]
    named = {effect.name: effect for effect in present}
    amplitude = {effect.name: effect.amplitude for effect in present}
    on, number = _table(present, index)
    load = amplitude.get("flexible_load", 0.0) * description.mass_kg
    gear = amplitude.get("drive_train_backlash", 0.0) * description.mass_kg
    walks = {
        name: _walk(named[name], index, mode.duration_s) if name in named else np.zeros(2)
        for name in ("walking_friction", "wandering_force")
    }
    push = named.get("external_disturbance")
    base = field_tables(description, ())
    stand = plant_parameters(description, mode.added_mass_kg)
    return Plant(
        mass=description.mass_kg - load - gear + mode.added_mass_kg + amplitude.get("payload_change", 0.0),
        load_mass=load,
        gear_mass=gear,
        base_mass=stand.mass,
        law=_LAW[description.law],
        shares=np.array(description.shares),
        stiffness=stand.sigma_0 * np.array(description.stiffnesses),
        bend=description.bend,
        coulomb=stand.coulomb,
        static=stand.static,
        stribeck=stand.stribeck,
        exponent=stand.exponent,
        sigma_0=stand.sigma_0,
        sigma_1=stand.sigma_1,
        sigma_2=stand.sigma_2,
        field=_contracted(field_tables(description, present)),
        base_field=_contracted(base),
        base_phases=base,
        density=stand.density,
        shift=stand.shift,
        polarity=stand.polarity,
        current_lag=stand.current_lag,
        offsets=_offsets(named.get("current_offset")),
        trusted=False,
        on=on,
        number=number,
        walk=walks["walking_friction"],
        wander=walks["wandering_force"],
        walk_step=WALK_STEP,
        begun=begun(description, mode),
        pushes=np.zeros((0, 3)) if push is None else _pushes(push, mode),
    )


def begun(description: HiddenAxis, mode: Mode) -> float:
    """Running time in s of a campaign before one of its recordings, which follow each other without a break."""
    names = [one.name for one in description.campaign]
    before = names.index(mode.name) if mode.name in names else 0
    return sum(one.duration_s for one in description.campaign[:before])


def _table(effects: Sequence[HiddenEffect], index: int) -> tuple[int, Array]:
    """`on` and `number` of a plant with these effects in recording `index` of its campaign."""
    on, number = 0, np.ones((layout.ROWS, layout.COLUMNS))
    number[:, 0] = 0.0
    for effect in effects:
        row = ENTRIES[effect.name].row
        if row is not None:
            on |= 1 << row
            values = [effect.amplitude, *effect.shape.values()]
            number[row, : len(values)] = values
        if effect.name == "floor_vibration":
            number[layout.VIBRATION, 2] += 2.4 * index  # recordings start at any moment of it
    return on, number


def _offsets(effect: HiddenEffect | None) -> Array:
    """What the three current sensors read too much, (3,) in A."""
    return np.zeros(3) if effect is None else effect.amplitude * np.array([effect.shape[phase] for phase in "uvw"])


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
    """A field without hidden effects, its table (m, 2, 3) with phases turned by electrical angles, turn (3,) rad, under
    the names that a plant gives it.
    """
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
    """What each effect makes the encoder read too much at the logged instants t (n,) in s, (n,) in m;
    columns: (LOGGED, n).
    """
    y = columns[layout.Y]
    errors = {}
    if plant.on >> layout.ENCODER & 1:
        errors["encoder_periodic_error"] = _encoder(plant, y)
    if plant.on >> layout.PLAY & 1:
        slack = columns[layout.PLAIN_STATES + layout.SLACK]
        errors["backlash"] = -0.5 * plant.number[layout.PLAY, 0] * slack
    for effect in effects:
        if effect.name == "clock_beat" and effect.amplitude:
            errors[effect.name] = _beat(effect, t, columns[layout.V])
    return errors


def _encoder(plant: Plant, y: Array) -> Array:
    if not plant.on >> layout.ENCODER & 1:
        return np.zeros_like(y)
    amplitude, period, phase, skew = plant.number[layout.ENCODER, :4]
    angle = 2 * math.pi * y / period + phase
    return np.asarray(amplitude * np.sin(angle + skew * np.sin(angle)))


def _beat(effect: HiddenEffect, t: Array, v: Array) -> Array:
    """Position read at an instant that wanders about the sampling instant."""
    angle = 2 * math.pi * effect.shape["frequency"] * t + effect.shape["phase"]
    return np.asarray(v * (effect.amplitude * np.sin(angle)))
