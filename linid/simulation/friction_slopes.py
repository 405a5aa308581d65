"""Derivatives of what a step of LuGre friction is made of: Stribeck curve and phi functions of a 2 x 2 matrix."""

from __future__ import annotations

import math
from typing import NamedTuple

from linid.physics.friction import DECAYED, exponential
from linid.simulation.binding import compiled, inlined


class LevelSlopes(NamedTuple):
    """Friction level g(v) and its fall v dg/dv, both in N, and their derivatives.

    level, fall: N; level_by, fall_by: (5,) derivatives by speed (N s/m), F_C, F_S (1), v_s (N s/m) and alpha (N).
    """

    level: float
    fall: float
    level_by: tuple[float, float, float, float, float]
    fall_by: tuple[float, float, float, float, float]


class PhiSlopes(NamedTuple):
    """phi_1 to phi_3 of half_trace I + B with B^2 = square I, as even I + odd B, and their derivatives.

    even, odd: (3,) dimensionless; even_by_trace, odd_by_trace: (3,) dimensionless, by half_trace; even_by_square,
    odd_by_square: (3,) dimensionless, by square.
    """

    even: tuple[float, float, float]
    odd: tuple[float, float, float]
    even_by_trace: tuple[float, float, float]
    odd_by_trace: tuple[float, float, float]
    even_by_square: tuple[float, float, float]
    odd_by_square: tuple[float, float, float]


@compiled
def level_slopes(
    v: float, coulomb: float, static: float, stribeck_velocity: float, exponent: float, bent: bool
) -> LevelSlopes:
    """The steady friction curve with its derivatives (eq. 42).

    v, stribeck_velocity: m/s; coulomb, static: N; exponent: alpha, 0.5 to 2; bent: whether its derivative is wanted.
    """
    ratio = abs(v) / stribeck_velocity
    power = ratio * ratio if exponent == 2.0 else ratio**exponent
    decay = math.exp(-power) if power <= DECAYED else 0.0
    excess = (static - coulomb) * decay
    by_speed = exponent * power / v if v != 0.0 else 0.0
    by_velocity = -exponent * power / stribeck_velocity
    by_exponent = power * math.log(ratio) if bent and ratio > 0.0 else 0.0
    bend = -exponent * excess * (1.0 - power)  # of the fall, by the power
    share = exponent * power * decay
    return LevelSlopes(
        coulomb + excess,
        -exponent * power * excess,
        (-excess * by_speed, 1.0 - decay, decay, -excess * by_velocity, -excess * by_exponent),
        (bend * by_speed, share, -share, bend * by_velocity, bend * by_exponent - power * excess),
    )


@compiled
def phi_to_4(z: float) -> tuple[float, float, float, float]:
    """Return phi_1 to phi_4 at z, dimensionless: phi_k(z) = (phi_{k-1}(z) - 1/(k-1)!) / z, phi_0 = exp
    (Hochbruck & Ostermann 2010)."""
    if abs(z) < 0.5:
        fourth, coefficient = 0.0, 1.0 / 355687428096000.0
        for k in range(17, 3, -1):
            fourth = coefficient + z * fourth
            coefficient *= k
        third = 1.0 / 6.0 + z * fourth
        second = 0.5 + z * third
        return 1.0 + z * second, second, third, fourth
    first = (math.exp(z) - 1.0) / z
    second = (first - 1.0) / z
    third = (second - 0.5) / z
    return first, second, third, (third - 1.0 / 6.0) / z


@compiled
def phi_slopes(half_trace: float, square: float) -> PhiSlopes:
    """The phi functions of a 2 x 2 matrix with their derivatives by its half trace and by the square.

    half_trace, square: of half_trace I + B with B^2 = square I, dimensionless. By half_trace, phi_k' = phi_k -
    k phi_{k+1}; by the square, that of the even part is half the odd part of phi_k', that of the odd part (even part of
    phi_k' - odd) / (2 square), or by the recurrence from one phi to the next where the square is small.
    """
    if square > 0.0625:
        return _of_two_eigenvalues(half_trace, square)
    if abs(half_trace) < 0.5 and square > -0.0625:
        return phi_of_small(half_trace, square)
    even, odd = exponential(half_trace, square)
    inverse = 1.0 / (half_trace * half_trace - square)
    e_1, o_1 = next_phi(half_trace, square, inverse, even - 1.0, odd)
    e_2, o_2 = next_phi(half_trace, square, inverse, e_1 - 1.0, o_1)
    e_3, o_3 = next_phi(half_trace, square, inverse, e_2 - 0.5, o_2)
    e_4, o_4 = next_phi(half_trace, square, inverse, e_3 - 1.0 / 6.0, o_3)
    if square < -0.0625:
        scale = 0.5 / square
        by_square = scale * (e_1 - e_2 - o_1), scale * (e_2 - 2.0 * e_3 - o_2), scale * (e_3 - 3.0 * e_4 - o_3)
    else:
        tail = square * (1.0 / 1680.0 + square * (1.0 / 90720.0 + square / 7983360.0))
        before = math.exp(half_trace) * (1.0 / 6.0 + square * (1.0 / 60.0 + tail))
        first = (before - 0.5 * (o_1 - o_2)) / half_trace
        second = (first - 0.5 * (o_2 - 2.0 * o_3)) / half_trace
        by_square = first, second, (second - 0.5 * (o_3 - 3.0 * o_4)) / half_trace
    return joined_phi((e_1, e_2, e_3, e_4), (o_1, o_2, o_3, o_4), by_square)


@inlined
def next_phi(half_trace, square, inverse, even, odd):
    """(even I + odd B) over the matrix; inverse: of its determinant."""
    return inverse * (half_trace * even - square * odd), inverse * (half_trace * odd - even)


@inlined
def joined_phi(even, odd, odd_by_square):
    """All slopes, of phi_1 to phi_4 and the derivatives of the odd parts by the square."""
    turned = odd[0] - odd[1], odd[1] - 2.0 * odd[2], odd[2] - 3.0 * odd[3]
    return PhiSlopes(
        (even[0], even[1], even[2]),
        (odd[0], odd[1], odd[2]),
        (even[0] - even[1], even[1] - 2.0 * even[2], even[2] - 3.0 * even[3]),
        turned,
        (0.5 * turned[0], 0.5 * turned[1], 0.5 * turned[2]),
        odd_by_square,
    )


@inlined
def phi_of_two(slow, fast, root, square):
    """All slopes of a matrix with two real eigenvalues, given phi_1 to phi_4 of both; root: of the square."""
    p_1, p_2, p_3, p_4 = slow
    q_1, q_2, q_3, q_4 = fast
    half, scale = 0.5 / root, 0.5 / square
    e_1, e_2, e_3, e_4 = 0.5 * (p_1 + q_1), 0.5 * (p_2 + q_2), 0.5 * (p_3 + q_3), 0.5 * (p_4 + q_4)
    o_1, o_2, o_3, o_4 = half * (p_1 - q_1), half * (p_2 - q_2), half * (p_3 - q_3), half * (p_4 - q_4)
    by_square = scale * (e_1 - e_2 - o_1), scale * (e_2 - 2.0 * e_3 - o_2), scale * (e_3 - 3.0 * e_4 - o_3)
    return joined_phi((e_1, e_2, e_3, e_4), (o_1, o_2, o_3, o_4), by_square)


@compiled
def _of_two_eigenvalues(half_trace: float, square: float) -> PhiSlopes:
    """`phi_slopes` of a matrix whose two real eigenvalues lie apart."""
    root = math.sqrt(square)
    return phi_of_two(phi_to_4(half_trace + root), phi_to_4(half_trace - root), root, square)


@compiled
def phi_of_small(half_trace, square):
    """All slopes of a small matrix, by the series of phi_4 and from there down."""
    e_4 = o_4 = e_by = o_by = 0.0 * square
    coefficient = 1.0 / 355687428096000.0  # 1 / 17!
    for k in range(17, 3, -1):
        e_by, o_by = half_trace * e_by + o_4 + square * o_by, e_by + half_trace * o_by
        e_4, o_4 = coefficient + half_trace * e_4 + square * o_4, e_4 + half_trace * o_4
        coefficient *= k
    e_3, o_3 = 1.0 / 6.0 + half_trace * e_4 + square * o_4, e_4 + half_trace * o_4
    e_2, o_2 = 0.5 + half_trace * e_3 + square * o_3, e_3 + half_trace * o_3
    e_1, o_1 = 1.0 + half_trace * e_2 + square * o_2, e_2 + half_trace * o_2
    third = e_by + half_trace * o_by
    second = 0.5 * (o_3 - 3.0 * o_4) + half_trace * third
    first = 0.5 * (o_2 - 2.0 * o_3) + half_trace * second
    return joined_phi((e_1, e_2, e_3, e_4), (o_1, o_2, o_3, o_4), (first, second, third))
