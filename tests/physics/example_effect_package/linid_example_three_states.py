"""An effect with three hidden states, in one file: a load on a rubber coupling (spring beside spring and damper)."""

import math

from linid.physics.effects.effect import Effect, term
from linid.physics.parameter import Parameter

_PER_RADIAN = 40.0  # steps of fourth order per radian of the load's swing


@term
def mass(record, load, frequency, relaxing, relaxation):
    """The load no longer moves with the axis, kg."""
    return -load


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2, s_3, load, frequency, relaxing, relaxation):
    """Force of both springs on the axis, N; s_1, s_2: the load's place and speed, s_3: relaxing force per mass."""
    return load * ((2.0 * math.pi * frequency) ** 2 * s_1 + s_3)


@term
def rates(x, u, q, a, stiffness, relaxing, relaxation):
    """Time derivatives of the three states; stiffness: per mass in 1/s^2."""
    return u, -stiffness * x - q - a, relaxing * stiffness * u - q / relaxation


@term
def advance(h, t, y, v, a, i_1, i_2, i_3, record, elapsed, s_1, s_2, s_3, load, frequency, relaxing, relaxation):
    """The states h seconds later, by steps of Runge and Kutta's."""
    omega = 2.0 * math.pi * frequency
    steps = max(1, math.ceil(_PER_RADIAN * h * max(omega, 1.0 / relaxation)))
    d, k = h / steps, omega * omega
    x, u, q = s_1, s_2, s_3
    for _ in range(steps):
        x_1, u_1, q_1 = rates(x, u, q, a, k, relaxing, relaxation)
        x_2, u_2, q_2 = rates(x + 0.5 * d * x_1, u + 0.5 * d * u_1, q + 0.5 * d * q_1, a, k, relaxing, relaxation)
        x_3, u_3, q_3 = rates(x + 0.5 * d * x_2, u + 0.5 * d * u_2, q + 0.5 * d * q_2, a, k, relaxing, relaxation)
        x_4, u_4, q_4 = rates(x + d * x_3, u + d * u_3, q + d * q_3, a, k, relaxing, relaxation)
        x += d * (x_1 + 2.0 * x_2 + 2.0 * x_3 + x_4) / 6.0
        u += d * (u_1 + 2.0 * u_2 + 2.0 * u_3 + u_4) / 6.0
        q += d * (q_1 + 2.0 * q_2 + 2.0 * q_3 + q_4) / 6.0
    return x, u, q


def grid(outlook):
    """Frequencies that the recordings can show."""
    highest = min(100.0, 0.1 / outlook.period)
    values = {"coupling_relaxing": 0.5, "coupling_relaxation": 0.01}
    return tuple({"coupling_frequency": share * highest, **values} for share in (0.2, 0.5, 1.0))


EFFECT = Effect(
    name="rubber_coupling",
    slot="FORCE",
    physics="A part of the moving mass hangs on a spring beside a second one that relaxes.",
    parameters=(
        Parameter("coupling_load", "m_r", "kg", 0.0, 100.0, 0.0, meaning="part of the moving mass that swings"),
        Parameter("coupling_frequency", "f_r", "Hz", 1.0, 200.0, 20.0, log=True, meaning="by the lasting spring alone"),
        Parameter("coupling_relaxing", "k_r", "1", 0.0, 10.0, 0.5, meaning="relaxing stiffness per lasting one"),
        Parameter("coupling_relaxation", "tau_r", "s", 1e-4, 1.0, 0.01, log=True, meaning="time of relaxation"),
    ),
    amplitudes=("coupling_load",),
    grid=grid,
    mass=mass,
    force=force,
    advance=advance,
    exposed_by="quick reversals and the calm after them",
    confused_with=("flexible_load",),
)
