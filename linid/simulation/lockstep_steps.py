"""One step of several simulations side by side, of either kind (steps.py): LuGre friction without effects.

Every lane has its own parameters, place in time and length of step; what a lane does not take is masked by the caller.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from linid.simulation.binding import inlined
from linid.simulation.course import FINEST
from linid.simulation.kernel import LARGEST_POSITION, LARGEST_SPEED
from linid.simulation.lane_functions import phi_pairs_lanes, stribeck_lanes
from linid.simulation.lanes import bits_of, select
from linid.simulation.steps import CALM, REVERSAL_WEIGHT, half_step, impulse

WHOLE = float(1 << FINEST)  # finest steps of a base step


class Moving(NamedTuple):
    """Position in m, speed in m/s, bristle in m and outer force in N of each lane."""

    y: Any
    v: Any
    w: Any
    force: Any


class Foreseen(NamedTuple):
    """The predicted middle of a followed step (`Middle`), and its finest steps and seconds."""

    v: Any
    w: Any
    level: Any
    fall: Any
    calm: Any  # mask: the next step may be twice as long
    size: Any
    h: Any


@inlined
def strayed(moving):
    """Where a simulation has run away, or is no number any more: `diverged`."""
    return ~((abs(moving.y) < LARGEST_POSITION) & (abs(moving.v) < LARGEST_SPEED))


@inlined
def slid(bristles, moving, h, weights, forces):
    """A step of fast sliding over h seconds: `sliding_step`. forces: in its middle and at its end, N."""
    y, v = moving.y, moving.v
    drag = math.copysign(bristles.coulomb, v)
    mean, rise = impulse(moving.force, *forces)
    v_rate = (mean - drag - 0.5 * rise - bristles.sigma_2 * v) / bristles.mass
    jerk = rise / bristles.mass
    first, second, third = weights
    v_new = v + h * (first * v_rate + second * jerk)
    return Moving(y + h * (v + h * (second * v_rate + third * jerk)), v_new, drag / bristles.sigma_0, forces[1])


@inlined
def foreseen(bristles, moving, size, tick, tolerance, asked):
    """The middle of a followed step, halved in each lane until the bristle's rate swings little within it: `predicted`.

    size: finest steps to try first; tick: s of one; tolerance: share of friction by which the rate may be off.
    """
    coulomb, static, velocity, exponent, sigma_0, sigma_1 = bristles[:6]
    v = moving.v
    rate = sigma_0 * abs(v) / stribeck_lanes(v, coulomb, static, velocity, exponent)[0]
    while True:
        h = size * tick
        half = 0.5 * h
        v_mid, w_mid = half_step(bristles, moving, (sigma_0, sigma_1), rate, half)
        level, fall = stribeck_lanes(v_mid, coulomb, static, velocity, exponent)
        rate_mid = sigma_0 * abs(v_mid) / level
        change = abs(rate_mid - rate)
        turns = v * (2.0 * v_mid - v) < 0.0
        change = select(turns, REVERSAL_WEIGHT * sigma_0 * abs(v_mid - v) / level, change)
        swing = change * h * abs(1.0 - math.copysign(sigma_0 * w_mid / level, v_mid * w_mid))
        allowed = tolerance * (1.0 + rate_mid * h)
        refused = asked & (size > 1.0) & (swing > allowed)
        if bits_of(refused) == 0:
            return Foreseen(v_mid, w_mid, level, fall, swing < CALM * allowed, size, h)
        size = select(refused, 0.5 * size, size)


@inlined
def followed(bristles, moving, middle, forces, asked):
    """A step in which the bristle is followed: `lugre_step` and `linear_step`. forces: in its middle, at its end, N."""
    sigma_0, sigma_1, sigma_2, mass = bristles[4:]
    y, v, w = moving.y, moving.v, moving.w
    v_mid, level, h = middle.v, middle.level, middle.h
    mean, rise = impulse(moving.force, *forces)
    rate = sigma_0 * abs(v_mid) / level
    load = sigma_0 * middle.w / level
    load = select(v_mid < 0.0, -load, select(v_mid == 0.0, 0.0, load))
    lowest = -0.5 * mass * rate / (h * (sigma_0 + sigma_1 * rate))
    lowest = select(lowest > -1.0, lowest, -1.0)
    slope = 1.0 - load * (1.0 - middle.fall / level)
    slope = select(lowest > slope, lowest, slope)
    slope = select(slope > 2.0, 2.0, slope)
    w_rate = v_mid - rate * w + slope * (v - v_mid)
    per_mass = 1.0 / mass
    v_rate = (mean - 0.5 * rise - sigma_0 * w - sigma_1 * w_rate - sigma_2 * v) * per_mass
    jerk = rise / h * per_mass * h
    damping = (sigma_1 * slope + sigma_2) * per_mass * h
    spring = (sigma_0 - sigma_1 * rate) * per_mass * h
    rate, slope = rate * h, slope * h
    difference = 0.5 * (rate - damping)
    square = difference * difference - spring * slope
    even_1, odd_1, even_2, odd_2, even_3, odd_3 = phi_pairs_lanes(-0.5 * (damping + rate), square, asked)
    v_turn = difference * v_rate - spring * w_rate
    w_turn = slope * v_rate - difference * w_rate
    v_new = v + h * (even_1 * v_rate + odd_1 * v_turn + (even_2 + odd_2 * difference) * jerk)
    w_new = w + h * (even_1 * w_rate + odd_1 * w_turn + odd_2 * slope * jerk)
    gain = even_2 * v_rate + odd_2 * v_turn + (even_3 + odd_3 * difference) * jerk
    return Moving(y + h * (v + h * gain), v_new, w_new, forces[1])
