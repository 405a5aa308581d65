"""What simulations side by side hold, in rows of blocks, and what they share."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from linid.physics.motors.motor import MAX_HARMONICS
from linid.simulation.binding import inlined
from linid.simulation.forces import Bristles
from linid.simulation.lanes import LANES, lanes_at, put_lanes
from linid.simulation.lockstep_steps import Moving

# Rows of what a block holds of its simulations. SIZE: finest steps of the next step; DONE: of them since the sample
# before; INTERVAL: of the recordings' that it is in; LEFT: samples still to come; RECORDING: its number; GOING, ALONE:
# 1 where a lane is taken, and where no force acts; GLIDE: three weights of fast sliding, over GLIDE_H seconds; LEAPS: 1
# where inputs differ before and after a sample.
# Python's own integers would be types of their own, for each of which all is compiled.
_ROWS = np.arange(27)
Y, V, W, FORCE, SIZE, DONE, INTERVAL, LEFT, RECORDING, GOING, ALONE, TICK, FAST, SLOWEST, GLIDE_H = _ROWS[:15]
GLIDE, GLIDE_2, GLIDE_3, BRISTLES = _ROWS[15:19]
LEAPS = _ROWS[26]
ROWS = 27
# Whole numbers: which candidate, and of the next sample in its results and of that behind the last.
CANDIDATE, NEXT, END = np.arange(3)
PLACES = 3
SPLINES = 17  # rows: of which interval, and its four splines' coefficients
# Rows: wavenumber, phase, of each harmonic its amplitude and phase step, 1 where that is the field, and which
# candidate's all that is.
TABLED = np.int64(2 + 3 * MAX_HARMONICS)
FIELD = OWNER = TABLED + 1


class Block(NamedTuple):
    """What `LANES` simulations side by side are: values (ROWS or more, LANES); places (PLACES, LANES); splines
    (SPLINES, LANES); field (OWNER + 1, LANES) of the motor; room (4, LANES)."""

    values: Any
    places: Any
    splines: Any
    field: Any
    room: Any


class Way(NamedTuple):
    """What all simulations share: params of the candidates; the recordings' coefficients; powered: whether any has
    inputs; free: whether the motor's force acts at the simulated position, in place of the measured one; fields:
    (candidates, FIELD) as in `Block`; forces in N at all points, `pieces` per sample, where they are known beforehand;
    given: whether these are told already; whole: finest steps per sample; tolerance of a followed step; y_out, v_out:
    where results go, (candidates, samples) in m and m/s, v_out (1, 0) if not wanted; beside: what goes along with
    simulations."""

    params: Any
    coefficients: Any
    powered: Any
    free: Any
    fields: Any
    forces: Any
    given: Any
    pieces: Any
    whole: Any
    tolerance: Any
    y_out: Any
    v_out: Any
    beside: Any


@inlined
def row(values, number):
    """One row of what a block holds."""
    return lanes_at(values, number * LANES)


@inlined
def put_row(values, number, lanes):
    """Put it back."""
    put_lanes(values, number * LANES, lanes)


@inlined
def moving_in(values):
    """The motion of all lanes."""
    return Moving(row(values, Y), row(values, V), row(values, W), row(values, FORCE))


@inlined
def bristles_in(values):
    """Friction and mass of all lanes."""
    at = BRISTLES
    return Bristles(
        row(values, at),
        row(values, at + 1),
        row(values, at + 2),
        row(values, at + 3),
        row(values, at + 4),
        row(values, at + 5),
        row(values, at + 6),
        row(values, at + 7),
    )
