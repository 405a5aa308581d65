"""Drive-train backlash: a part of the moving mass hangs behind a gap and hits its sides.

Source: the physical model of Nordin and Gutman 2002, Automatica 38, 1633, with a contact that never pulls.
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.parameter import Parameter

_LEAST, _MOST = 1e-7, 1.0  # m, of the gap
_EVENTS = 1000  # contacts made and lost within one step, at most
_TURNS = 60  # of the bisection: more than the digits of a double


@term
def push(side, s_1, s_2, gap, omega, damping):
    """Force per mass of the load on the motor by the side +1 or -1 of the gap, m/s^2: spring and damper, no pull.

    s_1, s_2: m and m/s; gap: m; omega: rad/s; damping: ratio.
    """
    depth = side * s_1 - 0.5 * gap
    return side * max(omega * omega * depth + 2.0 * damping * omega * side * s_2, 0.0) if depth > 0.0 else 0.0


@term
def mass(record, backlash_load_mass, backlash_load_gap, backlash_load_frequency, backlash_load_damping):
    """The load no longer moves with the axis: the total stays what it is, kg."""
    return -backlash_load_mass


@term
def force(
    t,
    y,
    v,
    i_1,
    i_2,
    i_3,
    record,
    elapsed,
    s_1,
    s_2,
    backlash_load_mass,
    backlash_load_gap,
    backlash_load_frequency,
    backlash_load_damping,
):
    """Contact force on the motor, N; s_1, s_2: position and speed of the load relative to the gap's middle."""
    omega = 2.0 * math.pi * backlash_load_frequency
    return backlash_load_mass * (
        push(1.0, s_1, s_2, backlash_load_gap, omega, backlash_load_damping)
        + push(-1.0, s_1, s_2, backlash_load_gap, omega, backlash_load_damping)
    )


@term
def initial(
    t,
    y,
    v,
    i_1,
    i_2,
    i_3,
    record,
    elapsed,
    s_1,
    s_2,
    backlash_load_mass,
    backlash_load_gap,
    backlash_load_frequency,
    backlash_load_damping,
):
    """States at the start, m and m/s: where friction alone brakes the motor, the load leans on it from behind; else it
    is in the middle.
    """
    if v == 0.0 or i_1 != 0.0 or i_2 != 0.0 or i_3 != 0.0:
        return 0.0, 0.0
    return math.copysign(0.5 * backlash_load_gap, v), 0.0


@term
def rising_root(rest, rate, bend):
    """Least t > 0 in s at which rest + rate t + bend t^2 rises through 0, infinite if there is none; by the stable
    formula.

    rest, rate, bend: in any unit, that unit per s and per s^2.
    """
    if bend == 0.0:
        return -rest / rate if rate > 0.0 and rest < 0.0 else math.inf
    square = rate * rate - 4.0 * bend * rest
    if square <= 0.0:
        return math.inf
    root = math.sqrt(square)
    found = (root - rate) / (2.0 * bend) if rate <= 0.0 else -2.0 * rest / (rate + root)
    return found if found > 0.0 else math.inf


@term
def swing(e, u, omega, decay, turning, h):
    """Distance (m) from rest and speed (m/s) h seconds on of a damped oscillator that swings freely.

    e, u: distance and speed now; omega: natural angular frequency, decay: damping rate, turning: damped frequency, all
    in rad/s.
    """
    fading = math.exp(-decay * h)
    cosine, sine = fading * math.cos(turning * h), fading * math.sin(turning * h) / turning
    return e * (cosine + decay * sine) + u * sine, u * (cosine - decay * sine) - e * omega * omega * sine


@term
def time_in_contact(e, u, a, omega, decay, turning, h):
    """Time in s until the contact pushes no more, infinite if it does so for h seconds.

    Push per mass: p - a, where p = omega^2 e + 2 decay u swings as e does: monotone from extreme to extreme. e, u,
    omega, decay, turning, h: as in `swing`; a: m/s^2, acceleration of the axis towards the contact's side.
    """
    before = 0.0
    # p' = omega^2 (u + 2 decay/omega^2 e'') vanishes where its own damped wave does.
    rate = omega * omega * u - 2.0 * decay * (omega * omega * e + 2.0 * decay * u)
    bend = -omega * omega * (omega * omega * e + 2.0 * decay * u) - 2.0 * decay * rate  # p'' by the same equation
    extreme = math.atan2(-rate * turning, bend + decay * rate) / turning
    while extreme <= 0.0:
        extreme += math.pi / turning
    while before < h:
        after = min(extreme, h)
        e_then, u_then = swing(e, u, omega, decay, turning, after)
        if omega * omega * e_then + 2.0 * decay * u_then < a:  # it falls through a between the two
            for _ in range(_TURNS):
                middle = 0.5 * (before + after)
                e_then, u_then = swing(e, u, omega, decay, turning, middle)
                if omega * omega * e_then + 2.0 * decay * u_then < a:
                    after = middle
                else:
                    before = middle
            return after
        before = after
        extreme += math.pi / turning
    return math.inf


@term
def time_to_contact(side, s_1, s_2, a, half, omega, decay):
    """Time in s until the load that swings free meets or catches up with the side +1 or -1 of the gap.

    s_1, s_2: m and m/s, of the load; a: m/s^2, of the axis; half: m, of the gap; omega, decay: rad/s.
    """
    depth, rate, bend = side * s_1 - half, side * s_2, -0.5 * side * a
    meets = rising_root(depth, rate, bend)
    # Away from the side faster than its spring relaxes: it may catch up with the load.
    catches = rising_root(
        omega * omega * depth + 2.0 * decay * rate, omega * omega * rate + 4.0 * decay * bend, omega * omega * bend
    )
    if depth + (rate + bend * catches) * catches < 0.0:
        catches = math.inf
    return min(meets, catches)


@term
def advance(
    h,
    t,
    y,
    v,
    a,
    i_1,
    i_2,
    i_3,
    record,
    elapsed,
    s_1,
    s_2,
    backlash_load_mass,
    backlash_load_gap,
    backlash_load_frequency,
    backlash_load_damping,
):
    """States in m and m/s after h seconds: s_1'' = -a - contact force per mass, exact while the axis accelerates
    evenly, from one event to the next.
    """
    omega = 2.0 * math.pi * backlash_load_frequency
    decay = min(backlash_load_damping, 0.999) * omega
    turning = math.sqrt(omega * omega - decay * decay)
    half = 0.5 * backlash_load_gap
    side = 0.0  # on which the load is in contact
    for sign in (-1.0, 1.0):
        depth, rate = sign * s_1 - half, sign * s_2
        pressing = omega * omega * depth + 2.0 * decay * rate
        if depth >= 0.0 and (pressing > 0.0 or (pressing == 0.0 and omega * omega * rate > 2.0 * decay * sign * a)):
            side = sign
    for _ in range(_EVENTS):
        if h <= 0.0:
            break
        if side != 0.0:
            push_less = -side * a / (omega * omega)  # depth at which the contact carries the load along
            e, u = side * s_1 - half - push_less, side * s_2
            span = time_in_contact(e, u, side * a, omega, decay, turning, h)
            e, u = swing(e, u, omega, decay, turning, min(span, h))
            s_1, s_2 = side * (e + push_less + half), side * u
            side = 0.0
            if span >= h:
                break
        else:
            span = math.inf
            for sign in (-1.0, 1.0):
                until = time_to_contact(sign, s_1, s_2, a, half, omega, decay)
                if until < span:
                    span, side = until, sign
            passed = min(span, h)
            s_1, s_2 = s_1 + (s_2 - 0.5 * a * passed) * passed, s_2 - a * passed
            if span >= h:
                break
        h -= span
    return s_1, s_2


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Gaps from a ten-thousandth to a hundredth of the stroke, each with contacts of four stiffnesses.

    Damped so well that the load hardly bounces: where it does, no measured motion says where it is for long.
    """
    highest = min(200.0, 1.0 / (6.0 * outlook.period))
    return tuple(
        {
            "backlash_load_gap": min(max(share * outlook.stroke, _LEAST), _MOST),
            "backlash_load_frequency": max(part * highest, 1.0),
            "backlash_load_damping": 0.3,
        }
        for share in (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2)
        for part in (1.0, 0.5, 0.25, 0.12)
    )


EFFECT = Effect(
    name="drive_train_backlash",
    slot="FORCE",
    physics="A part m_b of the moving mass has play b and hits its ends: spring (f_b, motor held), damper, no pull.",
    parameters=(
        Parameter("backlash_load_mass", "m_b", "kg", 0.0, 100.0, 0.0, meaning="part of the mass that has the play"),
        Parameter("backlash_load_gap", "b_b", "m", _LEAST, _MOST, 1e-4, log=True, meaning="play from end to end"),
        Parameter(
            "backlash_load_frequency",
            "f_b",
            "Hz",
            1.0,
            200.0,
            50.0,
            log=True,
            meaning="natural frequency in contact, motor held",
        ),
        Parameter("backlash_load_damping", "zeta_b", "1", 1e-3, 0.9, 0.3, log=True, meaning="damping ratio in contact"),
    ),
    amplitudes=("backlash_load_mass",),
    grid=grid,
    mass=mass,
    force=force,
    initial=initial,
    advance=advance,
    depends_on=(("acceleration",), ("travel",), ("travel", "direction"), ("motor_force",)),
    exposed_by="quick reversals with the drive on, and braking after a steady move",
    includes=("flexible_load",),
    confused_with=("flexible_load", "backlash"),
)
