"""Derivatives of a step by parameters, start and forces, many columns side by side: LuGre friction.

A step is differentiated as the simulation takes it, its length and branches held. What it takes of the base run is
computed once; the columns then cost some hundred sums and products each, as lanes (lanes.py), and no exponential.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from linid.physics.friction import glide_weights
from linid.simulation.binding import inlined
from linid.simulation.forces import Bristles
from linid.simulation.friction_slopes import level_slopes, phi_slopes, phi_to_4
from linid.simulation.lanes import lanes_at


class Columns(NamedTuple):
    """Slopes of the parameters of friction and of the mass by the columns, lanes each."""

    coulomb: Any
    static: Any
    velocity: Any
    exponent: Any
    sigma_0: Any
    sigma_1: Any
    sigma_2: Any
    mass: Any


class Motions(NamedTuple):
    """Slopes of position, speed and bristle by the columns."""

    y: Any
    v: Any
    w: Any


class Pushes(NamedTuple):
    """Slopes of the outer force at a step's start, middle and end by the columns."""

    start: Any
    middle: Any
    end: Any


class Predictor(NamedTuple):
    """What the half step by implicit Euler is made of; level: of friction at the start, N."""

    level: Any
    v: Any
    w: Any
    v_mid: Any
    force: Any
    mass: Any
    sigma_0: Any
    stiffness: Any  # of the bristle as it was last, N/m
    damping: Any  # likewise, N s/m
    turn: Any  # sign of the speed
    rate: Any
    half: Any
    relax: Any
    pull: Any
    inverse: Any


class AtMiddle(NamedTuple):
    """The bristle in the middle of a step, in the names of `Linear`; by_rate: how the bound that moves hangs on the
    bristle's rate."""

    turn: Any
    rate: Any
    load: Any
    share: Any
    over: Any
    by_rate: Any


class Matrix(NamedTuple):
    """The linearised step, in the names of `Linear`; half_trace, square: of its matrix (`phi_slopes`)."""

    w_rate: Any
    v_rate: Any
    damping: Any
    spring: Any
    difference: Any
    v_turn: Any
    w_turn: Any
    half_trace: Any
    square: Any


class Linear(NamedTuple):
    """What the step of the linearised equations is made of, in the names of `lugre_step` and `linear_step`."""

    turn: Any
    rate: Any
    load: Any
    share: Any  # fall over level
    free: Any  # 1 where no bound holds the bristle's slope
    lowest: Any  # the bound that moves, or 0
    lowest_by_rate: Any
    over: Any  # 1 / (sigma_0 + sigma_1 rate)
    slope: Any
    w_rate: Any
    v_rate: Any
    jerk: Any
    damping: Any
    spring: Any
    difference: Any
    v_turn: Any
    w_turn: Any
    phi: Any


@inlined
def columns_at(table, width, block):
    """The parameters' slopes of one block of lanes; table: (8, width)."""
    at = block
    return Columns(
        lanes_at(table, at),
        lanes_at(table, at + width),
        lanes_at(table, at + 2 * width),
        lanes_at(table, at + 3 * width),
        lanes_at(table, at + 4 * width),
        lanes_at(table, at + 5 * width),
        lanes_at(table, at + 6 * width),
        lanes_at(table, at + 7 * width),
    )


@inlined
def curve_at(bristles, v, bent):
    """`level_slopes` of an axis at v m/s."""
    return level_slopes(v, bristles.coulomb, bristles.static, bristles.stribeck_velocity, bristles.exponent, bent)


@inlined
def predictor_of(bristles, motion, middle, h, level):
    """What the predicted middle (`predicted`) of a step of h seconds hangs on; level: of friction at its start, N."""
    sigma_0, _, sigma_2, mass = bristles[4:]
    stiffness, damping = motion.spring
    rate = sigma_0 * abs(motion.v) / level
    half = 0.5 * h
    relax = 1.0 / (1.0 + half * rate)
    pull = half * (stiffness - damping * rate) * relax
    inverse = 1.0 / (mass + half * (damping + sigma_2 + pull))
    turn = math.copysign(1.0, motion.v)
    return Predictor(
        level, motion.v, motion.w, middle.v, motion.force, mass, sigma_0, stiffness, damping, turn, rate, half, relax,
        pull, inverse,
    )  # fmt: skip


@inlined
def level_lanes(by, v, columns):
    """Slopes of friction's level or fall: by speed, and by its parameters."""
    steady = by[1] * columns.coulomb + by[2] * columns.static
    return by[0] * v + steady + by[3] * columns.velocity + by[4] * columns.exponent


@inlined
def scaled_bristles(bristles, factor):
    """A bristle that is so many times as strong."""
    coulomb, static, stribeck_velocity, exponent, sigma_0, sigma_1, sigma_2, mass = bristles
    sigma_0, sigma_1 = factor * sigma_0, factor * sigma_1
    return Bristles(coulomb, static, stribeck_velocity, exponent, sigma_0, sigma_1, sigma_2, mass)


@inlined
def scaled_columns(bristles, columns, factor, factor_by):
    """The slopes of a bristle that is so many times as strong; factor_by: slopes of that."""
    sigma_0 = factor * columns.sigma_0 + bristles.sigma_0 * factor_by
    sigma_1 = factor * columns.sigma_1 + bristles.sigma_1 * factor_by
    return Columns(
        columns.coulomb, columns.static, columns.velocity, columns.exponent, sigma_0, sigma_1, columns.sigma_2,
        columns.mass,
    )  # fmt: skip


@inlined
def predicted_lanes(p, motion, force, level, columns, spring):
    """Slopes of the predicted middle, of speed and bristle; force, level: of these at the step's start; spring: columns
    of the bristle as it was last."""
    stiff = abs(p.v) * columns.sigma_0 + (p.sigma_0 * p.turn) * motion.v
    rate = (1.0 / p.level) * (stiff - p.rate * level)
    relax = (-p.half * p.relax * p.relax) * rate
    softer = spring.sigma_0 - p.rate * spring.sigma_1 - p.damping * rate
    pull = (p.half * p.relax) * softer + (p.half * (p.stiffness - p.damping * p.rate)) * relax
    held = columns.mass + p.half * (spring.sigma_1 + columns.sigma_2 + pull)
    pushed = p.mass * motion.v + p.v * columns.mass + p.half * force - p.w * pull - p.pull * motion.w
    v_mid = p.inverse * (pushed - p.v_mid * held)
    w_mid = p.relax * (motion.w + p.half * v_mid) + (p.w + p.half * p.v_mid) * relax
    return v_mid, w_mid


@inlined
def bound_of(load, share, by_rate, rate):
    """The bristle's slope by speed and what holds it: `Linear`'s slope, free, lowest and lowest_by_rate."""
    wished = 1.0 - load * (1.0 - share)
    lowest = max(-1.0, by_rate * rate)
    slope = min(max(wished, lowest), 2.0)
    free = 1.0 if slope == wished else 0.0
    moves = 1.0 if slope == lowest and lowest > -1.0 and free == 0.0 else 0.0
    return slope, free, moves * lowest, moves * by_rate


@inlined
def linear_of(bristles, motion, middle, mean, rise, h):
    """What the linearised step (`lugre_step`) of h seconds hangs on; mean, rise: of the outer force, in N."""
    turn = 0.0 if middle.v == 0.0 else math.copysign(1.0, middle.v)
    bristle = bristle_of_step(bristles, middle, turn, h)
    bound = bound_of(bristle.load, bristle.share, bristle.by_rate, bristle.rate)
    matrix = matrix_of(bristles, motion, middle, (mean, rise, h), bristle, bound[0])
    return joined(bristle, bound, matrix, phi_slopes(matrix.half_trace, matrix.square), rise / bristles.mass)


@inlined
def bristle_of_step(bristles, middle, turn, h):
    """The bristle in the middle of a step of h seconds; turn: sign of the speed then, or 0."""
    sigma_0, sigma_1, _, mass = bristles[4:]
    rate = sigma_0 * abs(middle.v) / middle.level
    over = 1.0 / (sigma_0 + sigma_1 * rate)
    load = turn * sigma_0 * middle.w / middle.level
    return AtMiddle(turn, rate, load, middle.fall / middle.level, over, -0.5 * mass * over / h)


@inlined
def matrix_of(bristles, motion, middle, outer, bristle, slope):
    """The linearised step's matrix and rates; outer: mean and rise of the outer force in N, and the step's seconds."""
    sigma_0, sigma_1, sigma_2, mass = bristles[4:]
    mean, rise, h = outer
    v, w, rate = motion.v, motion.w, bristle.rate
    w_rate = middle.v - rate * w + slope * (v - middle.v)
    v_rate = (mean - 0.5 * rise - sigma_0 * w - sigma_1 * w_rate - sigma_2 * v) / mass
    damping = (sigma_1 * slope + sigma_2) / mass * h
    spring = (sigma_0 - sigma_1 * rate) / mass * h
    difference = 0.5 * (rate * h - damping)
    v_turn, w_turn = difference * v_rate - spring * w_rate, slope * h * v_rate - difference * w_rate
    half_trace, square = -0.5 * (damping + rate * h), difference * difference - spring * slope * h
    return Matrix(w_rate, v_rate, damping, spring, difference, v_turn, w_turn, half_trace, square)


@inlined
def joined(bristle, bound, matrix, phi, jerk):
    """All of it together."""
    turn, rate, load, share, over, _ = bristle
    slope, free, lowest, lowest_by_rate = bound
    w_rate, v_rate, damping, spring, difference, v_turn, w_turn, _, _ = matrix
    return Linear(
        turn, rate, load, share, free, lowest, lowest_by_rate, over, slope, w_rate, v_rate, jerk, damping, spring,
        difference, v_turn, w_turn, phi,
    )  # fmt: skip


@inlined
def bristle_lanes(linear, bristles, middle, at_middle, columns):
    """Slopes of the bristle's rate sigma_0 |v|/g and of its slope by speed; at_middle: those of the middle."""
    sigma_0, sigma_1, mass = bristles.sigma_0, bristles.sigma_1, bristles.mass
    v_mid, w_mid, level, fall = at_middle
    per_level = 1.0 / middle.level
    rate = per_level * (abs(middle.v) * columns.sigma_0 + (sigma_0 * linear.turn) * v_mid - linear.rate * level)
    bent = middle.w * columns.sigma_0 + sigma_0 * w_mid
    load = (per_level * linear.turn) * bent - (per_level * linear.load) * level
    bound = (1.0 / mass) * columns.mass - linear.over * (
        columns.sigma_0 + sigma_1 * rate + linear.rate * columns.sigma_1
    )
    slope = (-linear.free * (1.0 - linear.share)) * load
    slope = slope + (linear.free * linear.load * per_level) * (fall - linear.share * level)
    return rate, slope + linear.lowest * bound + linear.lowest_by_rate * rate


@inlined
def linear_lanes(linear, bristles, base, h, rates, motion, pushes, columns):
    """Slopes after the linearised step. base: v and w at its start, v in the middle; rates: slopes of the bristle's
    rate, of its slope and of the speed in the middle."""
    sigma_0, sigma_1, sigma_2, mass = bristles[4:]
    v, w, v_mid = base
    rate, slope, v_mid_by = rates
    x, phi, per_mass = linear, linear.phi, 1.0 / mass
    rise = pushes.end - pushes.start
    force = (1.0 / 6.0) * (pushes.start + 4.0 * pushes.middle + pushes.end) - 0.5 * rise
    jerk = per_mass * (rise - x.jerk * columns.mass)
    w_rate = v_mid_by - w * rate - x.rate * motion.w + (v - v_mid) * slope + x.slope * (motion.v - v_mid_by)
    held = w * columns.sigma_0 + sigma_0 * motion.w + x.w_rate * columns.sigma_1 + sigma_1 * w_rate
    v_rate = per_mass * (force - held - v * columns.sigma_2 - sigma_2 * motion.v - x.v_rate * columns.mass)
    per_mass_h = per_mass * h
    damping = per_mass_h * (x.slope * columns.sigma_1 + sigma_1 * slope + columns.sigma_2)
    damping = damping - (x.damping * per_mass) * columns.mass
    spring = per_mass_h * (columns.sigma_0 - x.rate * columns.sigma_1 - sigma_1 * rate)
    spring = spring - (x.spring * per_mass) * columns.mass
    rate, slope, rising = h * rate, h * slope, h * x.slope
    difference, trace = 0.5 * (rate - damping), -0.5 * (rate + damping)
    square = (2.0 * x.difference) * difference - rising * spring - x.spring * slope
    v_turn = x.v_rate * difference + x.difference * v_rate - x.w_rate * spring - x.spring * w_rate
    w_turn = x.v_rate * slope + rising * v_rate - x.w_rate * difference - x.difference * w_rate
    e_1, e_2, e_3 = phi.even
    o_1, o_2, o_3 = phi.odd
    jerky = x.jerk * rising
    v_by, w_by, y_by = phi_lanes(x, jerky, phi.even_by_trace, phi.odd_by_trace)
    v_square, w_square, y_square = phi_lanes(x, jerky, phi.even_by_square, phi.odd_by_square)
    v_new = e_1 * v_rate + o_1 * v_turn + (e_2 + o_2 * x.difference) * jerk + (x.jerk * o_2) * difference
    w_new = e_1 * w_rate + o_1 * w_turn + (o_2 * x.jerk) * slope + (o_2 * rising) * jerk
    gain = e_2 * v_rate + o_2 * v_turn + (e_3 + o_3 * x.difference) * jerk + (x.jerk * o_3) * difference
    gain = gain + y_by * trace + y_square * square
    return Motions(
        motion.y + h * (motion.v + h * gain),
        motion.v + h * (v_new + v_by * trace + v_square * square),
        motion.w + h * (w_new + w_by * trace + w_square * square),
    )


@inlined
def phi_lanes(linear, jerky, even, odd):
    """How speed, bristle and displacement change with the phi functions, whose derivatives are even and odd."""
    x = linear
    v = even[0] * x.v_rate + odd[0] * x.v_turn + (even[1] + odd[1] * x.difference) * x.jerk
    w = even[0] * x.w_rate + odd[0] * x.w_turn + odd[1] * jerky
    y = even[1] * x.v_rate + odd[1] * x.v_turn + (even[2] + odd[2] * x.difference) * x.jerk
    return v, w, y


@inlined
def bends(table):
    """Whether a direction changes the curve's exponent; table: (8, width) of friction's parameters and the mass."""
    found = False
    for c in range(table.shape[1]):  # numba's own any would have a tenth of a second of Python loaded with the kernel
        found = found or table[3, c] != 0.0
    return found


@inlined
def slid_weights(bristles, h):
    """Weights of fast sliding over h seconds (`glide_weights`), and their derivatives by log(sigma_2 / mass)."""
    z = -bristles.sigma_2 * h / bristles.mass
    glide = glide_weights(bristles.sigma_2, bristles.mass, h)
    first, second, third = glide
    return glide, (z * (first - second), z * (second - 2.0 * third), z * (third - 3.0 * phi_to_4(z)[3]))


@inlined
def slid_lanes(weights, bristles, v, mean, rise, h, motion, pushes_and_columns):
    """Slopes after a step of fast sliding (`sliding_step`) from speed v; mean, rise: of the outer force, in N."""
    pushes, columns = pushes_and_columns
    first, second, third = weights[0]
    first_by, second_by, third_by = weights[1]
    sigma_0, sigma_2, mass = bristles.sigma_0, bristles.sigma_2, bristles.mass
    turn, per_mass = math.copysign(1.0, v), 1.0 / mass
    drag = turn * bristles.coulomb
    rate, jerk = (mean - drag - 0.5 * rise - sigma_2 * v) * per_mass, rise * per_mass
    rises = pushes.end - pushes.start
    force = (1.0 / 6.0) * (pushes.start + 4.0 * pushes.middle + pushes.end) - 0.5 * rises - turn * columns.coulomb
    rates = per_mass * (force - sigma_2 * motion.v - v * columns.sigma_2 - rate * columns.mass)
    jerks = per_mass * (rises - jerk * columns.mass)
    decay = (1.0 / sigma_2) * columns.sigma_2 - per_mass * columns.mass
    v_new = first * rates + second * jerks + (first_by * rate + second_by * jerk) * decay
    gain = second * rates + third * jerks + (second_by * rate + third_by * jerk) * decay
    w = (turn / sigma_0) * columns.coulomb - (drag / (sigma_0 * sigma_0)) * columns.sigma_0
    return Motions(motion.y + h * (motion.v + h * gain), motion.v + h * v_new, w)
