"""Many simulations side by side with their derivatives: windows in lanes, and each lane's columns one after another.

For the models of lockstep.py. What the columns need of a step is computed once for all lanes; a column then costs some
hundred sums and products for eight simulations. Positions have the bits of `lockstep_tasks`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from linid.physics.model import MOTOR_START
from linid.physics.motors.harmonics import phase_force_slopes
from linid.simulation.binding import allocating, compiled, inlined
from linid.simulation.bundle import Bundle
from linid.simulation.course import AxisState, Starts
from linid.simulation.forces import forces_along, motor_axis
from linid.simulation.friction_slopes import level_slopes
from linid.simulation.lane_slopes import level_slopes_lanes, phi_4_lanes, phi_slopes_lanes
from linid.simulation.lanes import LANES, bits_of, gathered, put_lanes, select
from linid.simulation.lockstep import Tasks, simulate_all, way_of
from linid.simulation.lockstep_block import ROWS, row
from linid.simulation.lockstep_lanes import point_at, shares_of, weighted
from linid.simulation.slope_effects import FORCE_STEP
from linid.simulation.slope_steps import (
    Columns,
    Motions,
    Pushes,
    bends,
    bristle_lanes,
    bristle_of_step,
    joined,
    level_lanes,
    linear_lanes,
    matrix_of,
    predicted_lanes,
    predictor_of,
    slid_lanes,
)
from linid.simulation.steps import impulse

PER_COLUMN = 4  # rows of a block: slopes of y, v, w and the outer force


class Beside(NamedTuple):
    """The columns that go along. table: (8, columns) directions of friction and mass; bent: whether alpha is one;
    starts: (S, 3, columns) of the start; movers: (columns,) which change the forces, as rows of `forces`, -1 where not;
    motors: (movers, VECTOR_SIZE) a FORCE_STEP along these, none where forces are told already; moved: (movers, 4,
    MAX_HARMONICS) what they change of its table of harmonics (`phase_force_slopes`); forces: (movers, points) slopes of
    the motor's force; now: (PER_COLUMN columns,) slopes of a simulation that begins; out: (samples, columns) in m."""

    table: Any
    bent: Any
    starts: Any
    movers: Any
    motors: Any
    moved: Any
    forces: Any
    now: Any
    out: Any


@allocating
def moved_tables(terms, motor, params, motors):
    """What directions change of a motor's table of harmonics, per unit: (directions, 4, MAX_HARMONICS). params: the
    candidate; motors: a FORCE_STEP along each."""
    at = motor_axis(terms, motor, params)
    moved = np.zeros((motors.shape[0], 4, at.table.shape[1]))
    for m in range(motors.shape[0]):
        then = motor_axis(terms, motor, motors[m])
        for k in range(at.table.shape[1]):
            amplitude, other = at.table[0, k], then.table[0, k]
            moved[m, 0, k] = (other - amplitude) / FORCE_STEP
            moved[m, 1, k] = (other * then.table[1, k] - amplitude * at.table[1, k]) / FORCE_STEP
            moved[m, 2, k] = (other * then.table[2, k] - amplitude * at.table[2, k]) / FORCE_STEP
        moved[m, 3, 0] = (then.wavenumber - at.wavenumber) / FORCE_STEP
        moved[m, 3, 1] = (then.phase - at.phase) / FORCE_STEP
    return moved


@allocating
def beside_of(terms, candidates, tangents, points, out):
    """Room for the columns. candidates: the one, then those a FORCE_STEP along each direction; points: of all
    recordings' forces."""
    params, count, given = candidates.params, out.shape[1], tangents.forces.size > 0
    movers, kept, bent = np.full(count, -1), 0, bends(tangents.table)
    for c in range(count):
        for k in range(MOTOR_START, params.shape[1]):
            if params[1 + c, k] != params[0, k] and movers[c] < 0:
                movers[c] = kept
                kept += 1
    motors = np.empty((0 if given else kept, params.shape[1]))
    for c in range(count):
        if movers[c] >= 0 and not given:
            motors[movers[c]] = params[1 + c]
    moved = moved_tables(terms, candidates.motor, params[0], motors)
    forces, now = tangents.forces, np.empty(PER_COLUMN * count)
    if not given:
        forces = np.empty((kept, points))
    return Beside(tangents.table, bent, tangents.starts, movers, motors, moved, forces, now, out)


@allocating
def slopes_of_forces(terms, axis, beside, guide, forces, points):
    """Fill in how the motor's forces at points from and to `points` answer the directions that change it; forces: in N,
    known there."""
    begin, end = points
    y, currents = guide[0, begin:end], (guide[1, begin:end], guide[2, begin:end], guide[3, begin:end])
    if axis.harmonics > 0:
        slopes = beside.forces[:, begin:end]
        at = axis.wavenumber, axis.phase, axis.table, axis.harmonics
        phase_force_slopes(y, currents, *at, beside.moved, slopes)
        return
    for m in range(beside.motors.shape[0]):
        slopes = beside.forces[m, begin:end]
        forces_along(terms, motor_axis(terms, axis.motor, beside.motors[m]), y, currents, slopes)
        for k in range(slopes.size):
            slopes[k] = (slopes[k] - forces[begin + k]) / FORCE_STEP


@compiled
def start_slopes(beside, bristles, motion, task, a):
    """The slopes of a simulation that begins, and its first sample's. task: its stretch, its start's bristle (nan: that
    of the model) and the point of its first force (-1: none); a: number of the sample."""
    s, given, point = task
    at = level_slopes(motion.v, *bristles[:4], beside.bent)
    slides, turn = abs(motion.v) > 0.0, math.copysign(1.0, motion.w)
    breaks = not slides and abs(motion.force) >= bristles.static
    for c in range(beside.out.shape[1]):
        y, v, w = beside.starts[s, 0, c], beside.starts[s, 1, c], beside.starts[s, 2, c]
        force, table = 0.0, beside.table
        if point >= 0 and beside.movers[c] >= 0:
            force = beside.forces[beside.movers[c], point]
        if math.isnan(given):
            held = force
            if breaks:
                held = turn * table[1, c]
            elif slides:
                by = at.level_by
                steady = by[0] * v + by[1] * table[0, c] + by[2] * table[1, c] + by[3] * table[2, c]
                held = turn * (steady + by[4] * table[3, c])
            w = (held - motion.w * table[4, c]) / bristles.sigma_0
        now = PER_COLUMN * c
        beside.now[now], beside.now[now + 1], beside.now[now + 2], beside.now[now + 3] = y, v, w, force
        beside.out[a, c] = y


@compiled
def keep_slopes(beside, begin, end):
    """Samples begin..end-1 of a simulation that rests for good."""
    for k in range(begin, end):
        for c in range(beside.out.shape[1]):
            beside.out[k, c] = beside.now[PER_COLUMN * c]


@compiled
def put_slopes(beside, values, place):
    """Put the slopes of a simulation that begins into the pool."""
    for k in range(beside.now.size):
        values[place, ROWS + k] = beside.now[k]


@inlined
def write_slopes(beside, block, lane, begin, end, strayed):
    """Write samples begin..end-1 of a lane."""
    for c in range(beside.out.shape[1]):
        slope = math.nan if strayed else block.values[ROWS + PER_COLUMN * c, lane]
        for k in range(begin, end):
            beside.out[k, c] = slope


@inlined
def columns_of(beside, c):
    """Slopes of friction's parameters and of the mass by column c."""
    t = beside.table
    return Columns(t[0, c], t[1, c], t[2, c], t[3, c], t[4, c], t[5, c], t[6, c], t[7, c])


@inlined
def slopes_at(values, at):
    """Slopes of y, v, w and of the outer force that begin at a row."""
    return Motions(row(values, at), row(values, at + 1), row(values, at + 2)), row(values, at + 3)


@inlined
def put_slopes_at(values, at, motions, force):
    """Put them back."""
    put_lanes(values, at * LANES, motions.y)
    put_lanes(values, (at + 1) * LANES, motions.v)
    put_lanes(values, (at + 2) * LANES, motions.w)
    put_lanes(values, (at + 3) * LANES, force)


@inlined
def carry_slid(way, values, bristles, moving, weights, step, masks):
    """Take the slopes along a step of fast sliding. step: its seconds, finest steps from the sample before to its end,
    and forces in its middle and at its end in N; masks: lanes that take it, and those with a motor."""
    beside, (h, ahead, forces), (took, powered) = way.beside, step, masks
    z = -bristles.sigma_2 * h / bristles.mass
    first, second, third = weights
    by = z * (first - second), z * (second - 2.0 * third), z * (third - 3.0 * phi_4_lanes(z, third))
    mean, rise = impulse(moving.force, *forces)
    driven = bits_of(powered) != 0
    point = select(powered, point_at(way, values, ahead), 1.0)
    points = beside.forces.shape[1]
    for c in range(beside.out.shape[1]):
        at = ROWS + PER_COLUMN * c
        motions, start = slopes_at(values, at)
        middle = end = 0.0 * start
        if driven and beside.movers[c] >= 0:
            of = float(beside.movers[c] * points)
            middle = select(powered, gathered(beside.forces, point + (of - 1.0)), 0.0)
            end = select(powered, gathered(beside.forces, point + of), 0.0)
        both = Pushes(start, middle, end), columns_of(beside, c)
        new = slid_lanes((weights, by), bristles, moving.v, mean, rise, h, motions, both)
        new = Motions(select(took, new.y, motions.y), select(took, new.v, motions.v), select(took, new.w, motions.w))
        put_slopes_at(values, at, new, select(took, end, start))


@inlined
def bound_lanes(bristle):
    """`bound_of` for lanes."""
    rate = bristle.rate
    wished = 1.0 - bristle.load * (1.0 - bristle.share)
    lowest = bristle.by_rate * rate
    held = lowest > -1.0
    lowest = select(held, lowest, -1.0)
    slope = select(lowest > wished, lowest, wished)
    slope = select(slope > 2.0, 2.0, slope)
    free = slope == wished
    moves = select((slope == lowest) & held & ~free, 1.0, 0.0 * rate)
    return slope, select(free, 1.0, 0.0 * rate), moves * lowest, moves * bristle.by_rate


@inlined
def linear_of_lanes(bristles, moving, middle, outer, asked):
    """`linear_of` for lanes; outer: mean and rise of the outer force in N, and the step's seconds."""
    v = middle.v
    turn = select(v == 0.0, 0.0, math.copysign(1.0, v))
    bristle = bristle_of_step(bristles, middle, turn, outer[2])
    bound = bound_lanes(bristle)
    matrix = matrix_of(bristles, moving, middle, outer, bristle, bound[0])
    phi = phi_slopes_lanes(matrix.half_trace, matrix.square, asked)
    return joined(bristle, bound, matrix, phi, outer[1] / bristles.mass)


@inlined
def carry_followed_lanes(way, values, bristles, moving, middle, forces, masks):
    """Take the slopes along a step in which the bristle is followed. masks: lanes that take it, and those with a
    motor."""
    beside, (going, powered), h = way.beside, masks, middle.h
    mean, rise = impulse(moving.force, *forces)
    level = level_slopes_lanes(moving.v, bristles, beside.bent)
    level_mid = level_slopes_lanes(middle.v, bristles, beside.bent)
    spring = bristles.sigma_0, bristles.sigma_1
    motion = AxisState(moving.y, moving.v, moving.w, moving.force, 0.0, spring)
    predictor = predictor_of(bristles, motion, middle, h, level.level)
    linear = linear_of_lanes(bristles, moving, middle, (mean, rise, h), going)
    base = moving.v, moving.w, middle.v
    driven = bits_of(powered) != 0
    point, mid_weights, end_weights = shares_of(way, values, middle)
    point = select(powered, point, 0.0)
    points = beside.forces.shape[1]
    for c in range(beside.out.shape[1]):
        at = ROWS + PER_COLUMN * c
        motions, start = slopes_at(values, at)
        half = end = start
        if driven and beside.movers[c] >= 0:
            of = point + float(beside.movers[c] * points)
            f_1, f_2 = gathered(beside.forces, of), gathered(beside.forces, of + 1.0)
            f_3 = gathered(beside.forces, of + 2.0)
            half = select(powered, weighted(mid_weights, f_1, f_2, f_3), start)
            end = select(powered, weighted(end_weights, f_1, f_2, f_3), start)
        columns = columns_of(beside, c)
        steady = level_lanes(level.level_by, motions.v, columns)
        v_mid, w_mid = predicted_lanes(predictor, motions, start, steady, columns, columns)
        high, fall = level_lanes(level_mid.level_by, v_mid, columns), level_lanes(level_mid.fall_by, v_mid, columns)
        rates = (*bristle_lanes(linear, bristles, middle, (v_mid, w_mid, high, fall), columns), v_mid)
        new = linear_lanes(linear, bristles, base, h, rates, motions, Pushes(start, half, end), columns)
        put_slopes_at(values, at, new, end)


def lockstep_slope_tasks_with(terms: Bundle) -> Any:
    """`lockstep_slope_tasks` with these terms, for Python to call."""
    beside = Bundle(
        pushed=slopes_of_forces,
        begun=start_slopes,
        kept=keep_slopes,
        put_in=put_slopes,
        slid=carry_slid,
        followed=carry_followed_lanes,
        written=write_slopes,
    )
    terms = Bundle(**dict(terms), beside=beside)

    def lockstep_slope_tasks(candidates, inputs, segments, scheme, tangents, begin, end, out):
        """Simulate segments begin..end-1 of the first candidate; results land in `out`: offsets, y (samples,) in m and
        slopes (samples, columns).

        candidates: the one, then those a FORCE_STEP along each direction.
        """
        starts = Starts(tangents.begins.reshape(1, -1, 3), tangents.kept, np.empty((1, 0, 3)))
        tasks = Tasks(candidates, inputs, segments, starts, scheme, out[0])
        beside = beside_of(terms, candidates, tangents, scheme.guide.shape[1], out[2])
        way = way_of(candidates, inputs, scheme, (out[1].reshape(1, -1), np.empty((1, 0))), beside)
        return simulate_all(terms, tasks, begin, end, way, ROWS + beside.now.size)

    return lockstep_slope_tasks
