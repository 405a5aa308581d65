"""The terms of motors, chained into one function per term that asks which motor it is.

A specialised kernel holds only the one motor that it is for.
"""

from __future__ import annotations

from typing import Any

from linid.physics.model import MOTOR_START
from linid.physics.motors.harmonics import phase_constants, phase_force, phase_steps
from linid.physics.motors.motor import PHASE_PARAMETERS, Motor
from linid.physics.motors.registry import MOTORS
from linid.simulation.binding import allocating, compiled, inlined, part, values_at
from linid.simulation.bundle import Bundle

_CONSTANT, _WAVENUMBER, _DISPLACEMENT, _OFFSET = range(MOTOR_START, MOTOR_START + len(PHASE_PARAMETERS))


@inlined
def _no_table(motor, p, table):
    return 0, 0.0, 0.0


@inlined
def _no_thrust(axis, y, currents):
    return 0.0


@inlined
def _no_constants(axis, y):
    return 0.0, 0.0, 0.0


def _prepared(rest: Any, code: int, amplitudes: Any, turns: float, where: Bundle) -> Any:
    """Fill the table of harmonics; returns their number, wavenumber (rad/m) and phase (rad) of the first one."""

    @allocating
    def prepared(motor, p, table):
        if motor != code:
            return rest(motor, p, table)
        count = amplitudes(table[0], *values_at(p, where))
        phase_steps(table, count, p[_CONSTANT], turns, p[_DISPLACEMENT])
        return count, turns * p[_WAVENUMBER], turns * p[_OFFSET]

    return prepared


def _shape(constant: Any, where: Bundle) -> Any:
    """The field's shape that the three windings see: a function of its own, as it is long and rarely needed."""

    @compiled
    def shape(p, y):
        z, step = p[_WAVENUMBER] * y + p[_OFFSET], p[_DISPLACEMENT]
        values = values_at(p, where)
        return constant(z - step, *values), constant(z, *values), constant(z + step, *values)

    return shape


def _shaped(rest: Any, code: int, shape: Any) -> Any:
    """Thrust in N by the field's shape."""

    @inlined
    def thrust(axis, y, currents):
        if axis.motor != code:
            return rest(axis, y, currents)
        s_1, s_2, s_3 = shape(axis.p, y)
        return axis.p[_CONSTANT] * (s_1 * currents[0] + s_2 * currents[1] + s_3 * currents[2])

    return thrust


def _constants(rest: Any, code: int, shape: Any) -> Any:
    """Thrust per phase current in N/A by the field's shape."""

    @inlined
    def constants(axis, y):
        if axis.motor != code:
            return rest(axis, y)
        s_1, s_2, s_3 = shape(axis.p, y)
        constant = axis.p[_CONSTANT]
        return constant * s_1, constant * s_2, constant * s_3

    return constants


def _direct(rest: Any, code: int, term: Any, where: Bundle) -> Any:
    """Thrust in N by a term of its own."""

    @inlined
    def thrust(axis, y, currents):
        if axis.motor != code:
            return rest(axis, y, currents)
        i_1, i_2, i_3 = currents
        return term(y, i_1, i_2, i_3, *values_at(axis.p, where))

    return thrust


def _thrust_with_table(rest: Any) -> Any:
    @inlined
    def thrust(axis, y, currents):
        if axis.harmonics == 0:
            return rest(axis, y, currents)
        i_1, i_2, i_3 = currents
        return phase_force(y, i_1, i_2, i_3, axis.wavenumber, axis.phase, axis.table, axis.harmonics)

    return thrust


def _constants_with_table(rest: Any) -> Any:
    @inlined
    def constants(axis, y):
        if axis.harmonics == 0:
            return rest(axis, y)
        return phase_constants(y, axis.wavenumber, axis.phase, axis.table, axis.harmonics)

    return constants


def motor_terms(motor: int | None) -> Bundle:
    """The terms of all motors (None), or of the one with this code.

    prepare(motor, p, table) -> harmonics, wavenumber, phase; thrust(axis, y, currents) in N; constants(axis, y): thrust
    per phase current in N/A; untabled: the thrust where the table is known to be empty.
    """
    prepare, thrust, constants = _no_table, _no_thrust, _no_constants
    for code, one in enumerate(MOTORS.values()):
        if motor not in (None, code) or not one.inputs:
            continue
        if not one.periodic:
            thrust = _direct(thrust, code, part(one.thrust), _places(one, 0))
            continue
        where = _places(one, len(PHASE_PARAMETERS))
        prepare = _prepared(prepare, code, part(one.amplitudes), one.turns, where)
        if one.constant is not None:
            shape = _shape(part(one.constant), where)
            thrust, constants = _shaped(thrust, code, shape), _constants(constants, code, shape)
    return Bundle(
        prepare=prepare, thrust=_thrust_with_table(thrust), constants=_constants_with_table(constants), untabled=thrust
    )


def _places(motor: Motor, first: int) -> Bundle:
    """Where in the flat vector the parameters from number `first` on are."""
    return Bundle(places=tuple(range(MOTOR_START + first, MOTOR_START + len(motor.parameters))))
