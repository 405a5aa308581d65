"""Where everything stands: the columns logged, the hidden states, the rows of the effects' table."""

from __future__ import annotations

# Columns logged: position, velocity, bristle deflection, q-current, work, friction loss, bristle of the base model.
Y, V, W, IQ, WORK, LOSS, BASE_W = range(7)
PLAIN_STATES = 7
# Hidden states, logged after those: the last is of the encoder's play.
HEAT_FAST, HEAT_SLOW, CABLE, LOAD, LOAD_RATE, FELT, DWELT, GEAR, GEAR_RATE, SLACK = range(10)
HIDDEN = 10
STATES = PLAIN_STATES + HIDDEN
# Then acceleration, acceleration the base model would have, motor force in N.
ACCELERATION, BASE_ACCELERATION, THRUST = STATES, STATES + 1, STATES + 2
LOGGED = STATES + 3
# Rows of `Plant.number` (amplitude first, then the shape), and bits of `Plant.on`.
(
    COGGING,
    CABLE_FORCE,
    DRAG,
    SATURATION,
    THERMAL,
    END,
    LOAD_SPRING,
    ENCODER,
    DISTURBANCE,
    DRIFT,
    ASYMMETRY,
    BUMP,
    DELAY,
    VIBRATION,
    WALK,
    SPEED_DERATING,
    THRUST_FRICTION,
    ACCELERATION_FRICTION,
    SPEED_COGGING,
    RELUCTANCE,
    CONSTANT,
    EDDY,
    DWELL,
    LEVEL,
    GRAVITY,
    WANDER,
    PITCH,
    GEAR_PLAY,
    PLAY,
) = range(29)
ROWS, COLUMNS = 29, 7
# Friction laws, and the elements of Maxwell's.
LUGRE, DAHL, MAXWELL, ELASTO_PLASTIC = range(4)
ELEMENTS = 4
# Rows by where they act, as bits of `on`: whole groups are skipped where none is present.
MOTOR_ROWS = 1 << SATURATION | 1 << THERMAL | 1 << END | 1 << SPEED_DERATING
FRICTION_ROWS = (
    1 << DRIFT
    | 1 << ASYMMETRY
    | 1 << BUMP
    | 1 << WALK
    | 1 << THRUST_FRICTION
    | 1 << ACCELERATION_FRICTION
    | 1 << DWELL
    | 1 << LEVEL
)
FORCE_ROWS = (
    1 << CONSTANT
    | 1 << COGGING
    | 1 << CABLE_FORCE
    | 1 << DRAG
    | 1 << DISTURBANCE
    | 1 << VIBRATION
    | 1 << SPEED_COGGING
    | 1 << RELUCTANCE
    | 1 << EDDY
    | 1 << GRAVITY
    | 1 << WANDER
)
STATE_ROWS = (
    1 << THERMAL | 1 << CABLE_FORCE | 1 << LOAD_SPRING | 1 << ACCELERATION_FRICTION | 1 << DWELL | 1 << GEAR_PLAY
)
