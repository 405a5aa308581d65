"""Flexible load: part of the moving mass hangs on a spring and swings.

Source: Newton's law of two masses with spring and damper (Den Hartog 1956, Mechanical Vibrations, ch. 3).
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.parameter import Parameter


@term
def mass(record, load_mass, load_frequency, load_damping):
    """The load no longer moves with the axis: the total stays what it is, kg."""
    return -load_mass


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2, load_mass, load_frequency, load_damping):
    """Spring and damper between load and axis, N; s_1, s_2: position and speed of the load relative to the axis."""
    omega = 2.0 * math.pi * load_frequency
    return load_mass * (omega * omega * s_1 + 2.0 * load_damping * omega * s_2)


@term
def advance(h, t, y, v, a, i_1, i_2, i_3, record, elapsed, s_1, s_2, load_mass, load_frequency, load_damping):
    """States in m and m/s after h seconds: s_1'' = -omega^2 s_1 - 2 zeta omega s_1' - a, exact while the axis
    accelerates evenly.
    """
    omega = 2.0 * math.pi * load_frequency
    rest = -a / (omega * omega)
    damping = min(load_damping, 0.999) * omega
    turning = math.sqrt(omega * omega - damping * damping)
    decay = math.exp(-damping * h)
    cosine, sine = decay * math.cos(turning * h), decay * math.sin(turning * h) / turning
    away = s_1 - rest
    return (
        rest + away * (cosine + damping * sine) + s_2 * sine,
        s_2 * (cosine - damping * sine) - away * omega * omega * sine,
    )


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Frequencies from some swings per recording up to a sixth of the sampling rate, by steps of a fifth."""
    highest = min(200.0, 1.0 / (6.0 * outlook.period))
    out, frequency = [], max(2.0, 3.0 / max(outlook.durations))
    while frequency <= highest:
        out += [{"load_frequency": frequency, "load_damping": damping} for damping in (0.03, 0.15)]
        frequency *= 1.2
    return tuple(out)


EFFECT = Effect(
    name="flexible_load",
    slot="FORCE",
    physics="A part m_l of the moving mass hangs on a spring with the natural frequency f and the damping ratio zeta.",
    parameters=(
        Parameter("load_mass", "m_l", "kg", 0.0, 100.0, 0.0, meaning="part of the moving mass that swings"),
        Parameter("load_frequency", "f_l", "Hz", 1.0, 200.0, 20.0, log=True, meaning="natural frequency, axis held"),
        Parameter("load_damping", "zeta_l", "1", 1e-3, 0.9, 0.03, log=True, meaning="damping ratio, axis held"),
    ),
    amplitudes=("load_mass",),
    grid=grid,
    mass=mass,
    force=force,
    advance=advance,
    # A mass on a spring rings after what the axis does: acceleration, or a wave of its own in time.
    depends_on=(("acceleration",), ("time",), ("motor_force",)),
    exposed_by="current steps and quick reversals, which let the load swing",
    confused_with=("input_delay",),
)
