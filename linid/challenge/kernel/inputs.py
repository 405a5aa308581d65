"""What the kernel is given: the numbers of a plant, and what it is told in one recording."""

from __future__ import annotations

from typing import NamedTuple

from linid.arrays import Array


class Plant(NamedTuple):
    """Numbers of one recording's plant, SI.

    mass: of the forcer with everything rigidly on it; load_mass: hangs on a spring, gear_mass: behind a play;
    base_mass: what the base model takes for their sum. field, base_field: (m, 4), base_phases: (m, 2, 3), see
    `linid.challenge.plant.field_tables`. offsets: (3,) what the current sensors read too much, A; trusted: a model that
    lacks these offsets, and takes the shown currents for true. on: bit k is set while the hidden effect of row k acts;
    number: (ROWS, COLUMNS). law: of friction; shares, stiffness: (ELEMENTS,) of Maxwell's elements, shares of the
    sliding force and N/m; bend: exponent of Dahl's law. walk, wander: (k,) random walks of friction and force at knots
    walk_step s apart. begun: s of the campaign that passed before the recording. pushes: (k, 3) size in N, start
    and length in s.
    """

    mass: float
    load_mass: float
    gear_mass: float
    base_mass: float
    law: int
    shares: Array
    stiffness: Array
    bend: float
    coulomb: float
    static: float
    stribeck: float
    exponent: float
    sigma_0: float
    sigma_1: float
    sigma_2: float
    field: Array
    base_field: Array
    base_phases: Array
    density: float
    shift: float
    polarity: float
    current_lag: float
    offsets: Array
    trusted: bool
    on: int
    number: Array
    walk: Array
    wander: Array
    walk_step: float
    begun: float
    pushes: Array


class Orders(NamedTuple):
    """What a plant is told in one recording, per loop period.

    control: 0 power stage off, 1 current command, 2 position loop; current (loops,) in A, y_reference in m, v_reference
    in m/s and push in N are held over a period. path: (0, 4), or (loops, 4) position, velocity, acceleration and
    q-current at each loop: the axis is then led along it, whatever acts.
    """

    control: int
    current: Array
    y_reference: Array
    v_reference: Array
    push: Array
    path: Array


class PlantState(NamedTuple):
    """Where the axis stands: y in m, v in m/s, bristle w in m, q-current in A, and the bristle of the base model in m;
    work done on the axis and loss by friction in J."""

    y: float
    v: float
    w: float
    i_q: float
    base_w: float
    work: float
    loss: float


class Memory(NamedTuple):
    """Arrays that a recording's steps write: hidden: (HIDDEN,) states; stage, rate, total: (HIDDEN,) theirs within a
    step; slips, base_slips: (ELEMENTS,) m; history: (2, k) lagged current components of the last steps in A.
    """

    hidden: Array
    stage: Array
    rate: Array
    total: Array
    slips: Array
    base_slips: Array
    history: Array
