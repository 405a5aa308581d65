"""The stand's plant: fine-step integration of forcer, bristles and current loop under a sampled drive.

Kept free of `linid.simulation` on purpose, so that each can be checked against the other: here every step is a
plain fourth-order Runge-Kutta step, short enough for the bristles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from linid.arrays import Array
from linid.kernel_cache import kept

if TYPE_CHECKING:
    from linid.stand.description import AxisDescription, SineMotor, ThetaMotor
    from linid.stand.modes import Command


# Harmonics below this share of the fundamental cannot change a double-precision sum.
NEGLIGIBLE = 1e-17


class PlantParameters(NamedTuple):
    """Numbers the kernel needs, SI.

    harmonics: (h, 2) order n and force per current c_n in N/A; polarity: sign that the drive's commutation has
    learned, so that positive q-current pushes forward.
    """

    mass: float
    constant_force: float
    coulomb: float
    static: float
    stribeck: float
    exponent: float
    sigma_0: float
    sigma_1: float
    sigma_2: float
    harmonics: Array
    density: float
    displacement: float
    shift: float
    polarity: float
    current_lag: float


class Given(NamedTuple):
    """What is asked of the axis at each of n loops: current (n,) A, y_reference (n,) m, v_reference (n,) m/s, and push
    (n,) N from outside."""

    current: Array
    y_reference: Array
    v_reference: Array
    push: Array


class DriveParameters(NamedTuple):
    """Numbers of the sampled loops, SI."""

    period: float
    limit: float
    position_gain: float
    velocity_gain: float
    integral_gain: float
    feedforward: float


@dataclass(frozen=True)
class PlantRun:
    """Exact motion at the logged instants; (n,) arrays in SI units, phase_currents (3, n).

    q_current_rate: in A/s; it jumps where the current loop is updated, the mean of both sides is given;
    work: work done on the forcer by motor, push and constant force in J; loss: energy dissipated by friction in J;
    peak: (lowest, highest) position in m over all integration steps, not only the logged ones.
    """

    t: Array
    y: Array
    v: Array
    w: Array
    q_current: Array
    q_current_rate: Array
    phase_currents: Array
    work: Array
    loss: Array
    peak: tuple[float, float]


def motor_harmonics(motor: SineMotor | ThetaMotor) -> tuple[Array, float, float, float]:
    """A motor as F = sum_j sum_n c_n sin(n (omega y + p (j-2) + s)) I_j: ((h, 2) n and c_n in N/A, omega, p, s).

    theta: Theta0(z, q) = 8 sum over odd n of q^(n^2) sin(2 n z_L) sin(2 n z), hence omega = 2 z_0, p = 2 z_p,
    s = 2 z_S; sine: the single harmonic K_f. omega in 1/m, p and s in rad.
    """
    if motor.kind == "sine":
        return (
            np.array([[1.0, motor.force_constant_n_per_a]]),
            motor.electrical_wavenumber_per_m,
            motor.winding_displacement_rad,
            motor.commutation_offset_rad,
        )
    rows, n = [], 1
    while motor.nome ** (n * n - 1) > NEGLIGIBLE:
        field = 8 * motor.nome ** (n * n) * math.sin(2 * n * motor.winding_length_rad)
        rows.append((float(n), motor.force_constant_n_per_a * field))
        n += 2
    return (
        np.array(rows),
        2 * motor.electrical_wavenumber_per_m,
        2 * motor.winding_displacement_rad,
        2 * motor.commutation_offset_rad,
    )


def plant_parameters(description: AxisDescription, added_mass: float = 0.0) -> PlantParameters:
    """The kernel's numbers of a described axis; added_mass in kg."""
    friction = description.friction
    harmonics, density, displacement, shift = motor_harmonics(description.motor)
    return PlantParameters(
        mass=description.mass_kg + added_mass,
        constant_force=description.constant_force_n,
        coulomb=friction.coulomb_force_n,
        static=friction.static_force_n,
        stribeck=friction.stribeck_velocity_m_per_s,
        exponent=friction.stribeck_exponent,
        sigma_0=friction.bristle_stiffness_n_per_m,
        sigma_1=friction.bristle_damping_n_s_per_m,
        sigma_2=friction.viscous_friction_n_s_per_m,
        harmonics=harmonics,
        density=density,
        displacement=displacement,
        shift=shift,
        polarity=math.copysign(1.0, harmonics[0, 1]),
        current_lag=description.drive.current_time_constant_s,
    )


def drive_parameters(description: AxisDescription) -> DriveParameters:
    """The sampled loops' numbers of a described axis."""
    drive = description.drive
    return DriveParameters(
        drive.loop_period_s,
        drive.current_limit_a,
        drive.position_gain_per_s,
        drive.velocity_gain_a_s_per_m,
        drive.velocity_integral_gain_a_per_m,
        drive.velocity_feedforward,
    )


def simulate(
    description: AxisDescription,
    command: Command,
    *,
    start_position: float,
    added_mass: float = 0.0,
    substeps: int | None = None,
) -> PlantRun:
    """Integrate the described axis under a command and return its exact motion at the logged instants.

    start_position in m, added_mass in kg; substeps: integration steps per drive loop period (default: as described).
    A start in motion begins with the bristles at their steady deflection g(v) sign(v) / sigma_0 (free wheel).
    """
    parameters = plant_parameters(description, added_mass)
    v0 = command.v0
    w0 = math.copysign(stribeck(v0, parameters) / parameters.sigma_0, v0) if v0 else 0.0
    given = Given(command.current, command.y_reference, command.v_reference, command.push)
    steps = (substeps or description.substeps, description.loops_per_sample)
    drive, start = drive_parameters(description), (start_position, v0, w0)
    logged, low, high = _integrate(parameters, drive, command.control, given, start, *steps)
    y, v, w, q_current, work, loss, rate = logged.T.copy()
    t: Array = np.arange(len(y), dtype=np.float64) * np.float64(description.measurement.sample_period_s)
    return PlantRun(t, y, v, w, q_current, rate, phase_currents(parameters, y, q_current), work, loss, (low, high))


def phase_currents(parameters: PlantParameters, y: Array, q_current: Array) -> Array:
    """Balanced phase currents (3, n) in A of q-currents (n,) in A at positions y (n,) in m: I_j = +-i_q sin(omega y + 2
    pi/3 (j-2) + s), along the field.
    """
    return np.stack([parameters.polarity * q_current * np.sin(angle) for angle in commutation_angles(parameters, y)])


def commutation_angles(parameters: PlantParameters, y: Array) -> Array:
    """The drive's angles (3, n) in rad of the three phases at y (n,) in m."""
    angle = parameters.density * y + parameters.shift
    return np.stack([angle + 2 * math.pi / 3 * (j - 2) for j in (1, 2, 3)])


@kept()
def stribeck(v: float, p: PlantParameters) -> float:
    """g(v) = F_C + (F_S - F_C) exp(-|v/v_s|^alpha) in N; v in m/s."""
    return p.coulomb + (p.static - p.coulomb) * math.exp(-(abs(v / p.stribeck) ** p.exponent))


@kept()
def phase_constant(y: float, j: int, p: PlantParameters) -> float:
    """Thrust per current in N/A of phase j (-1, 0, 1) at y in m: in V s/m its back-EMF per speed."""
    field = 0.0
    for h in range(p.harmonics.shape[0]):
        field += p.harmonics[h, 1] * math.sin(p.harmonics[h, 0] * (p.density * y + p.shift + p.displacement * j))
    return field


@kept()
def phase_constants(y: Array, p: PlantParameters) -> Array:
    """`phase_constant` of the three phases (3, n) at y (n,) in m."""
    constants = np.empty((3, y.size))
    for k in range(y.size):
        for j in range(3):
            constants[j, k] = phase_constant(y[k], j - 1, p)
    return constants


@kept()
def thrust(y: float, i_q: float, p: PlantParameters) -> float:
    """Motor force in N of the commutated q-current i_q in A at y in m."""
    base = p.density * y + p.shift
    force = 0.0
    for j in range(-1, 2):
        current = p.polarity * i_q * math.sin(base + 2 * math.pi / 3 * j)
        force += phase_constant(y, j, p) * current
    return force


@kept()
def friction_rates(v: float, w: float, p: PlantParameters) -> tuple[float, float, float]:
    """The bristles' rate in m/s, the force against the motion in N and the power lost in W; v in m/s, w in m."""
    pull = p.sigma_0 * abs(v) * w / stribeck(v, p)
    w_rate = v - pull
    resist = p.sigma_0 * w + p.sigma_1 * w_rate + p.sigma_2 * v
    # What friction takes beyond the energy stored in the bristles, sigma_0 w w'.
    loss = p.sigma_0 * w * pull + p.sigma_1 * w_rate * v + p.sigma_2 * v * v
    return w_rate, resist, loss


@kept()
def _rates(s: Any, i_reference: float, push: float, p: PlantParameters) -> Any:
    """Time derivatives of (y, v, w, i_q, work, loss)."""
    y, v, w, i_q = s[0], s[1], s[2], s[3]
    w_rate, resist, loss = friction_rates(v, w, p)
    drive = thrust(y, i_q, p) + push + p.constant_force
    return v, (drive - resist) / p.mass, w_rate, (i_reference - i_q) / p.current_lag, drive * v, loss


@kept()
def _along(s: Any, k: Any, h: float) -> Any:
    return (s[0] + h * k[0], s[1] + h * k[1], s[2] + h * k[2], s[3] + h * k[3], s[4] + h * k[4], s[5] + h * k[5])


@kept()
def _step(s: Any, h: float, i_reference: float, push: float, p: PlantParameters) -> Any:
    """One classical Runge-Kutta step of h seconds."""
    a = _rates(s, i_reference, push, p)
    b = _rates(_along(s, a, h / 2), i_reference, push, p)
    c = _rates(_along(s, b, h / 2), i_reference, push, p)
    d = _rates(_along(s, c, h), i_reference, push, p)
    return _along(_along(_along(_along(s, a, h / 6), b, h / 3), c, h / 3), d, h / 6)


@kept()
def _control(
    y: float, v: float, y_reference: float, v_reference: float, integral: float, d: DriveParameters
) -> tuple[float, float]:
    """q-current reference in A and the new integral in A; the integral stops while the current is limited."""
    error = d.position_gain * (y_reference - y) + d.feedforward * v_reference - v
    wanted = d.velocity_gain * error + integral
    if abs(wanted) <= d.limit or wanted * error < 0:
        integral += d.integral_gain * error * d.period
    return min(max(wanted, -d.limit), d.limit), integral


@kept()
def _integrate(
    p: PlantParameters,
    d: DriveParameters,
    control: int,
    given: Given,
    start: tuple[float, float, float],
    substeps: int,
    loops_per_sample: int,
) -> tuple[Array, float, float]:
    """Kernel: the sampled loops and the steps between them; (n, 7) state and rate of the q-current, extremes of y."""
    loops = given.push.shape[0]
    y0, v0, w0 = start
    logged = np.empty((loops // loops_per_sample, 7))
    state = (y0, v0, w0, 0.0, 0.0, 0.0)
    low, high, integral, i_reference = y0, y0, 0.0, 0.0
    h = d.period / substeps
    for loop in range(loops):
        i_before = i_reference
        if control == 1:
            i_reference = min(max(given.current[loop], -d.limit), d.limit)
        elif control == 2:
            wanted = (given.y_reference[loop], given.v_reference[loop])
            i_reference, integral = _control(state[0], state[1], wanted[0], wanted[1], integral, d)
        if loop % loops_per_sample == 0:
            row = loop // loops_per_sample
            for column in range(6):
                logged[row, column] = state[column]
            logged[row, 6] = ((i_before + i_reference) / 2 - state[3]) / p.current_lag
        for _ in range(substeps):
            state = _step(state, h, i_reference, given.push[loop], p)
            low, high = min(low, state[0]), max(high, state[0])
    return logged, low, high
