"""The explicit list of all motors; a motor's place in it is its code in the compiled simulation.

Motors of other packages follow those of linid: an entry point of the group `linid.motors`, called like the motor, names
a `Motor`.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import EntryPoint

from linid.entry_points import loaded, of_group
from linid.errors import ConfigError
from linid.physics.motors import force, sine, theta
from linid.physics.motors.motor import Motor, check_motor
from linid.physics.motors.names import GROUP

FRICTION = Motor("friction", 0)  # free wheels: no motor acts
BUILT_IN: tuple[Motor, ...] = (FRICTION, force.MOTOR, sine.MOTOR, theta.MOTOR)


def collect(built_in: Iterable[Motor], others: Iterable[EntryPoint]) -> dict[str, Motor]:
    """All motors by name, in order; raises ConfigError for a malformed one or a name that is taken already."""
    motors: dict[str, Motor] = {motor.name: check_motor(motor, "linid") for motor in built_in}
    for one, place in loaded(others):
        motor = check_motor(one, place)
        if motor.name in motors:
            raise ConfigError(
                place, f"there is a motor {motor.name!r} already", "Rename it, or uninstall one of the packages"
            )
        if not place.startswith(f"entry point {motor.name!r} "):
            raise ConfigError(place, f"brings the motor {motor.name!r}", "Call the entry point like its motor")
        motors[motor.name] = motor
    return motors


MOTORS = collect(BUILT_IN, of_group(GROUP))
