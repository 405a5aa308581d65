"""Functions of lanes that no instruction computes: exponential, powers, sine and cosine, phi functions.

By polynomials in plain sums and products, so that no library decides their bits.
"""

from __future__ import annotations

import math

from linid.physics.friction import DECAYED
from linid.physics.motors.harmonics import HALF_PI
from linid.simulation.binding import compiled, inlined
from linid.simulation.lanes import LANES, bits_of, has_bit, lanes_at, parts_of, scaled, select

_NEAREST = 6755399441055744.0  # 1.5 2^52: what is added to it is rounded to a whole number, found in the last bits
_LN_2 = (0.6931471803691238, 1.9082149292705877e-10)  # 32 bits and the rest
_PER_LN_2, _PER_RIGHT_ANGLE, _ROOT_2 = 1.0 / math.log(2.0), 2.0 / math.pi, math.sqrt(2.0)
_LEAST, _LARGEST = -708.0, 708.0  # arguments beyond which the exponential leaves the normal numbers
_SMALLEST = 2.2250738585072014e-308  # normal number


@inlined
def exp_lanes(x):
    """e^x, within 1e-15; held at both ends of the normal numbers. By Taylor's series for |x| < ln(2)/2."""
    x = select(x < _LEAST, _LEAST, select(x > _LARGEST, _LARGEST, x))
    shifted = x * _PER_LN_2 + _NEAREST
    n = shifted - _NEAREST
    x = (x - n * _LN_2[0]) - n * _LN_2[1]
    # In pairs (Estrin), as a chain of thirteen would last thrice as long.
    q = x * x
    f = q * q
    a = (1.0 + x) + q * (0.5 + x * (1.0 / 6.0))
    b = (1.0 / 24.0 + x * (1.0 / 120.0)) + q * (1.0 / 720.0 + x * (1.0 / 5040.0))
    c = (1.0 / 40320.0 + x * (1.0 / 362880.0)) + q * (1.0 / 3628800.0 + x * (1.0 / 39916800.0))
    d = 1.0 / 479001600.0 + x * (1.0 / 6227020800.0)
    return scaled(a + f * (b + f * (c + f * d)), shifted)


@inlined
def log_lanes(x):
    """Natural logarithm of normal positive numbers, within 1e-15 beside 1."""
    exponent, x = parts_of(x)
    above = x > _ROOT_2
    exponent, x = select(above, exponent + 1.0, exponent), select(above, 0.5 * x, x)
    s = (x - 1.0) / (x + 1.0)
    q = s * s
    tail = 1.0 / 15.0 + q * (1.0 / 17.0 + q * (1.0 / 19.0 + q * (1.0 / 21.0)))
    tail = 1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0 + q * (1.0 / 13.0 + q * tail)))
    tail = q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * tail))
    return exponent * _LN_2[0] + (2.0 * s + (2.0 * s * tail + exponent * _LN_2[1]))


@compiled
def power_lanes(x, exponent):
    """x to a positive exponent, for x >= 0."""
    tiny = x < _SMALLEST
    raised = exp_lanes(exponent * log_lanes(select(tiny, 1.0, x)))
    return select(tiny, 0.0, select(x == x, raised, x))


@inlined
def sine_cosine_lanes(angle):
    """Sine and cosine of angles in rad, up to 1e6: `sine_cosine` for lanes."""
    shifted = angle * _PER_RIGHT_ANGLE + _NEAREST
    n = shifted - _NEAREST
    x = ((angle - n * HALF_PI[0]) - n * HALF_PI[1]) - n * HALF_PI[2]
    q = x * x
    odd = q * (1.0 / 362880.0 - q * (1.0 / 39916800.0 - q * (1.0 / 6227020800.0 - q * (1.0 / 1307674368000.0))))
    odd = x - x * q * (1.0 / 6.0 - q * (1.0 / 120.0 - q * (1.0 / 5040.0 - odd)))
    even = q * (1.0 / 479001600.0 - q * (1.0 / 87178291200.0 - q * (1.0 / 20922789888000.0)))
    even = q * (1.0 / 40320.0 - q * (1.0 / 3628800.0 - even))
    even = 1.0 - q * (0.5 - q * (1.0 / 24.0 - q * (1.0 / 720.0 - even)))
    turned, back = has_bit(shifted, 1), has_bit(shifted, 2)
    sine, cosine = select(turned, even, odd), select(turned, odd, even)
    flipped = (turned | back) & ~(turned & back)
    return select(back, -sine, sine), select(flipped, -cosine, cosine)


@inlined
def phase_force_lanes(y, currents, field, harmonics):
    """Thrust in N at positions y in m under three phase currents in A each: `phase_force` for lanes.

    field: (rows, LANES), each lane's wavenumber in rad/m, phase in rad, and of `harmonics` harmonics the amplitude in
    N/A, cosine and sine of the phase step.
    """
    u, v, w = currents
    sine, cosine = sine_cosine_lanes(lanes_at(field, 0) * y + lanes_at(field, LANES))
    both, across = u + w, w - u
    at = 2 * LANES
    force = lanes_at(field, at) * (
        sine * (v + lanes_at(field, at + LANES) * both) + cosine * lanes_at(field, at + 2 * LANES) * across
    )
    if harmonics > 1:
        sine_2, cosine_2 = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
        for _ in range(1, harmonics):
            at += 3 * LANES
            sine, cosine = sine * cosine_2 + cosine * sine_2, cosine * cosine_2 - sine * sine_2
            force = force + lanes_at(field, at) * (
                sine * (v + lanes_at(field, at + LANES) * both) + cosine * lanes_at(field, at + 2 * LANES) * across
            )
    return force


@inlined
def stribeck_lanes(v, coulomb, static, velocity, exponent):
    """Steady friction level g(v) and v dg/dv, both in N: `stribeck_fall` for lanes."""
    ratio = abs(v) / velocity
    power = ratio * ratio
    other = exponent != 2.0
    if bits_of(other) != 0:
        power = select(other, power_lanes(ratio, exponent), power)
    decayed = power > DECAYED
    excess = (static - coulomb) * exp_lanes(-power)
    return select(decayed, coulomb, coulomb + excess), select(decayed, 0.0, -exponent * power * excess)


@compiled
def phi_of_lanes(z, asked):
    """phi_1, phi_2 and phi_3 where the mask `asked` holds: the physics module's for lanes."""
    inverse = 1.0 / z
    first = (exp_lanes(z) - 1.0) * inverse
    second = (first - 1.0) * inverse
    third = (second - 0.5) * inverse
    small = abs(z) < 0.5
    if bits_of(small & asked) != 0:
        last = 1.0 / 3628800.0 + z * (1.0 / 39916800.0 + z * (1.0 / 479001600.0 + z * (1.0 / 6227020800.0)))
        last = 1.0 / 5040.0 + z * (1.0 / 40320.0 + z * (1.0 / 362880.0 + z * last))
        last = 1.0 / 6.0 + z * (1.0 / 24.0 + z * (1.0 / 120.0 + z * (1.0 / 720.0 + z * last)))
        before = 0.5 + z * last
        first, second, third = (
            select(small, 1.0 + z * before, first),
            select(small, before, second),
            select(small, last, third),
        )
    return first, second, third


@inlined
def exponential_lanes(half_trace, square, asked):
    """`exponential` for lanes: even and odd part of that of a 2 x 2 matrix, square up to 0.0625."""
    decay = exp_lanes(half_trace)
    even = 1.0 + square * (0.5 + square * (1.0 / 24.0 + square * (1.0 / 720.0 + square * (1.0 / 40320.0))))
    tail = square * (1.0 / 5040.0 + square * (1.0 / 362880.0))
    odd = 1.0 + square * (1.0 / 6.0 + square * (1.0 / 120.0 + tail))
    turns = square < 0.0
    if bits_of(turns & asked) != 0:
        root = math.sqrt(select(turns, -square, 1.0))
        sine, cosine = sine_cosine_lanes(root)
        even, odd = select(turns, cosine, even), select(turns, sine / root, odd)
    return decay * even, decay * odd


@inlined
def _small_phi_pairs(half_trace, square):
    """phi_1 to phi_3 of a small matrix, even and odd parts, by the series of phi_3."""
    even = odd = 0.0 * square
    factor = 1.0 / 20922789888000.0  # 1 / 16!
    for k in range(16, 2, -1):
        even, odd = factor + half_trace * even + square * odd, even + half_trace * odd
        factor *= k
    even_2, odd_2 = 0.5 + half_trace * even + square * odd, even + half_trace * odd
    return 1.0 + half_trace * even_2 + square * odd_2, even_2 + half_trace * odd_2, even_2, odd_2, even, odd


@inlined
def _near_phi_pairs(half_trace, square, asked):
    """The same of a matrix with eigenvalues that are together or complex, by its exponential."""
    even, odd = exponential_lanes(half_trace, square, asked)
    inverse = 1.0 / (half_trace * half_trace - square)
    even = even - 1.0
    even_1, odd_1 = inverse * (half_trace * even - square * odd), inverse * (half_trace * odd - even)
    even = even_1 - 1.0
    even_2, odd_2 = inverse * (half_trace * even - square * odd_1), inverse * (half_trace * odd_1 - even)
    even = even_2 - 0.5
    even_3, odd_3 = inverse * (half_trace * even - square * odd_2), inverse * (half_trace * odd_2 - even)
    return even_1, odd_1, even_2, odd_2, even_3, odd_3


@inlined
def _apart_phi_pairs(half_trace, square, asked):
    """The same of a matrix with real eigenvalues that lie apart."""
    root = math.sqrt(square)
    slow_1, slow_2, slow_3 = phi_of_lanes(half_trace + root, asked)
    fast_1, fast_2, fast_3 = phi_of_lanes(half_trace - root, asked)
    odd = 0.5 / root
    return (
        0.5 * (slow_1 + fast_1),
        odd * (slow_1 - fast_1),
        0.5 * (slow_2 + fast_2),
        odd * (slow_2 - fast_2),
        0.5 * (slow_3 + fast_3),
        odd * (slow_3 - fast_3),
    )


@inlined
def _chosen(mask, a, b):
    return (
        select(mask, a[0], b[0]),
        select(mask, a[1], b[1]),
        select(mask, a[2], b[2]),
        select(mask, a[3], b[3]),
        select(mask, a[4], b[4]),
        select(mask, a[5], b[5]),
    )


@inlined
def phi_pairs_lanes(half_trace, square, asked):
    """phi_1, phi_2, phi_3 of the 2 x 2 matrix half_trace I + B with B^2 = square I, even and odd parts of each."""
    apart = square > 0.0625
    small = (abs(half_trace) < 0.5) & (square > -0.0625) & ~apart
    near = ~apart & ~small
    out = (square, square, square, square, square, square)
    if bits_of(apart & asked) != 0:
        out = _apart_phi_pairs(half_trace, square, asked & apart)
    if bits_of(small & asked) != 0:
        out = _chosen(small, _small_phi_pairs(half_trace, square), out)
    if bits_of(near & asked) != 0:
        out = _chosen(near, _near_phi_pairs(half_trace, square, asked & near), out)
    return out
