"""Derivatives of what a step of LuGre friction is made of, many simulations side by side: friction_slopes.py for lanes.

By the same formulas, branch by branch; the exponentials are those of lane_functions.py.
"""

from __future__ import annotations

import math

from linid.physics.friction import DECAYED
from linid.simulation.binding import compiled, inlined
from linid.simulation.friction_slopes import LevelSlopes, PhiSlopes, joined_phi, next_phi, phi_of_small, phi_of_two
from linid.simulation.lane_functions import exp_lanes, exponential_lanes, log_lanes, phi_of_lanes, power_lanes
from linid.simulation.lanes import bits_of, select

_SMALLEST_RATIO = 1e-300  # of speed to the Stribeck velocity, whose logarithm is asked for


@inlined
def level_slopes_lanes(v, bristles, bent):
    """The steady friction curve with its derivatives: `level_slopes` for lanes. bent: whether alpha's is wanted."""
    velocity, exponent = bristles.stribeck_velocity, bristles.exponent
    ratio = abs(v) / velocity
    power = ratio * ratio
    other = exponent != 2.0
    if bits_of(other) != 0:
        power = select(other, power_lanes(ratio, exponent), power)
    decay = select(power > DECAYED, 0.0, exp_lanes(-power))
    excess = (bristles.static - bristles.coulomb) * decay
    rests = v == 0.0
    by_speed = select(rests, 0.0, exponent * power / select(rests, 1.0, v))
    by_velocity = -exponent * power / velocity
    by_exponent = 0.0 * power
    if bent:
        tiny = ratio < _SMALLEST_RATIO
        by_exponent = select(tiny, 0.0, power * log_lanes(select(tiny, 1.0, ratio)))
    bend = -exponent * excess * (1.0 - power)  # of the fall, by the power
    share = exponent * power * decay
    return LevelSlopes(
        bristles.coulomb + excess,
        -exponent * power * excess,
        (-excess * by_speed, 1.0 - decay, decay, -excess * by_velocity, -excess * by_exponent),
        (bend * by_speed, share, -share, bend * by_velocity, bend * by_exponent - power * excess),
    )


@inlined
def phi_4_lanes(z, third):
    """phi_4 at z, given phi_3: `phi_to_4` for lanes."""
    small = abs(z) < 0.5
    series = 1.0 / 39916800.0 + z * (1.0 / 479001600.0 + z * (1.0 / 6227020800.0 + z * (1.0 / 87178291200.0)))
    series = 1.0 / 5040.0 + z * (1.0 / 40320.0 + z * (1.0 / 362880.0 + z * (1.0 / 3628800.0 + z * series)))
    series = 1.0 / 24.0 + z * (1.0 / 120.0 + z * (1.0 / 720.0 + z * series))
    return select(small, series, (third - 1.0 / 6.0) / select(small, 1.0, z))


@inlined
def _apart(half_trace, square, asked):
    """Slopes of a matrix whose two real eigenvalues lie apart."""
    root = math.sqrt(square)
    slow, fast = half_trace + root, half_trace - root
    p, q = phi_of_lanes(slow, asked), phi_of_lanes(fast, asked)
    return phi_of_two((*p, phi_4_lanes(slow, p[2])), (*q, phi_4_lanes(fast, q[2])), root, square)


@inlined
def _near(half_trace, square, asked):
    """Slopes of a matrix with eigenvalues that are together or complex, by its exponential."""
    even, odd = exponential_lanes(half_trace, square, asked)
    inverse = 1.0 / (half_trace * half_trace - square)
    e_1, o_1 = next_phi(half_trace, square, inverse, even - 1.0, odd)
    e_2, o_2 = next_phi(half_trace, square, inverse, e_1 - 1.0, o_1)
    e_3, o_3 = next_phi(half_trace, square, inverse, e_2 - 0.5, o_2)
    e_4, o_4 = next_phi(half_trace, square, inverse, e_3 - 1.0 / 6.0, o_3)
    far = square < -0.0625
    scale = 0.5 / select(far, square, 1.0)
    tail = square * (1.0 / 1680.0 + square * (1.0 / 90720.0 + square * (1.0 / 7983360.0)))
    before = exp_lanes(half_trace) * (1.0 / 6.0 + square * (1.0 / 60.0 + tail))
    per_trace = 1.0 / half_trace
    first = (before - 0.5 * (o_1 - o_2)) * per_trace
    second = (first - 0.5 * (o_2 - 2.0 * o_3)) * per_trace
    third = (second - 0.5 * (o_3 - 3.0 * o_4)) * per_trace
    by_square = (
        select(far, scale * (e_1 - e_2 - o_1), first),
        select(far, scale * (e_2 - 2.0 * e_3 - o_2), second),
        select(far, scale * (e_3 - 3.0 * e_4 - o_3), third),
    )
    return joined_phi((e_1, e_2, e_3, e_4), (o_1, o_2, o_3, o_4), by_square)


@inlined
def _three(mask, a, b):
    return select(mask, a[0], b[0]), select(mask, a[1], b[1]), select(mask, a[2], b[2])


@inlined
def _chosen(mask, a, b):
    return PhiSlopes(
        _three(mask, a.even, b.even),
        _three(mask, a.odd, b.odd),
        _three(mask, a.even_by_trace, b.even_by_trace),
        _three(mask, a.odd_by_trace, b.odd_by_trace),
        _three(mask, a.even_by_square, b.even_by_square),
        _three(mask, a.odd_by_square, b.odd_by_square),
    )


@compiled
def phi_slopes_lanes(half_trace, square, asked):
    """phi_1 to phi_3 of a 2 x 2 matrix with their derivatives where the mask `asked` holds: `phi_slopes` for lanes."""
    apart = square > 0.0625
    small = (abs(half_trace) < 0.5) & (square > -0.0625) & ~apart
    near = ~apart & ~small
    same = square, square, square
    out = PhiSlopes(same, same, same, same, same, same)
    if bits_of(apart & asked) != 0:
        out = _apart(half_trace, square, asked & apart)
    if bits_of(small & asked) != 0:
        out = _chosen(small, phi_of_small(half_trace, square), out)
    if bits_of(near & asked) != 0:
        out = _chosen(near, _near(half_trace, square, asked & near), out)
    return out
