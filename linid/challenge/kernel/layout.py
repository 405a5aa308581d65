"""Where everything stands: the columns logged, the hidden states, the rows of the effects' table."""

from __future__ import annotations

# Columns logged: position, velocity, bristle deflection, q-current, work, friction loss, bristle of the base model.
Y, V, W, IQ, WORK, LOSS, BASE_W = range(7)
PLAIN_STATES = 7
# Hidden states, logged after those. The first nine move by rates; the encoder's play, and what is remembered of the
# motion (place of the last reversal, farthest place since, direction; s of the rest that lasts and of the last one, m
# slid since), are set at the end of a step.
HEAT_FAST, HEAT_SLOW, CABLE, LOAD, LOAD_RATE, FELT, DWELT, GEAR, GEAR_RATE = range(9)
RATED = 9
SLACK, ORIGIN, EXTREME, WAY, RESTING, RESTED, SLID = range(9, 16)
HIDDEN = 16
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
    GATED_VIBRATION,
    SOFT_RAIL,
    PLACE_DAMPING,
    CHAIN,
    MAGNET,
    RESONANCE,
    FEED_LINE,
    SUPPLY,
    LOOSE,
    REVERSAL,
    GRIP,
    COOLANT,
    BALL_PASS,
    FILM,
) = range(43)
ROWS, COLUMNS = 43, 7
# Friction laws, and the elements of Maxwell's.
LUGRE, DAHL, MAXWELL, ELASTO_PLASTIC = range(4)
ELEMENTS = 4
# Rows by where they act, as bits of `on`: whole groups are skipped where none is present.
MOTOR_ROWS = 1 << SATURATION | 1 << THERMAL | 1 << END | 1 << SPEED_DERATING
OUTSIDE_FORCE_ROWS = (
    1 << GATED_VIBRATION
    | 1 << SOFT_RAIL
    | 1 << PLACE_DAMPING
    | 1 << CHAIN
    | 1 << MAGNET
    | 1 << RESONANCE
    | 1 << FEED_LINE
    | 1 << SUPPLY
    | 1 << LOOSE
)
OUTSIDE_FRICTION_ROWS = 1 << REVERSAL | 1 << GRIP | 1 << COOLANT | 1 << BALL_PASS | 1 << FILM
FRICTION_ROWS = (
    1 << DRIFT
    | 1 << ASYMMETRY
    | 1 << BUMP
    | 1 << WALK
    | 1 << THRUST_FRICTION
    | 1 << ACCELERATION_FRICTION
    | 1 << DWELL
    | 1 << LEVEL
    | OUTSIDE_FRICTION_ROWS
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
MEMORY_ROWS = 1 << REVERSAL | 1 << FILM
STATE_ROWS = (
    1 << THERMAL
    | 1 << CABLE_FORCE
    | 1 << LOAD_SPRING
    | 1 << ACCELERATION_FRICTION
    | 1 << DWELL
    | 1 << GEAR_PLAY
    | 1 << LOOSE
    | MEMORY_ROWS
)
