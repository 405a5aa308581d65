"""How an own term stands in the flat parameter vector: its program as numbers, then its parameters.

A program is a list of operations for a stack machine (postfix, as in Forth); each operation is a code, followed by its
own numbers. Places are those in the vector with which a simulation works (`linid/physics/model.py`).
"""

from __future__ import annotations

TERMS = 3  # own terms in one model
HEAD = 4  # numbers per term: from where to where its force goes, and from where to where its level of friction
POOL = 384  # numbers for all programs and parameters of one model: room for a surface of 12 x 12 and two formulas
SIZE = TERMS * HEAD + POOL
STACK = 24  # numbers that a program may hold at once

# What a formula may use of the motion and of the drive; after the fifth, what the memory keeps, and what follows from
# friction and mass.
VARIABLES = ("t", "T", "y", "v", "F", "travel", "since_reversal", "rest", "slid", "acceleration", "stribeck")
MEMORY_VARIABLES = VARIABLES[5:9]
# Bits that switch on own forces, own levels of friction, the memory, the acceleration, the Stribeck curve, and the
# motor's force in a level of friction and in a force, beyond those of the library's effects.
FORCE_BIT, LEVEL_BIT, MEMORY_BIT, ACCELERATION_BIT, STRIBECK_BIT, LOAD_BIT = (1 << k for k in (60, 61, 62, 59, 58, 57))
PUSH_BIT = 1 << 56
TIME_BIT = 1 << 55  # what changes though the axis rests
TIMES = ("t", "T", "since_reversal", "rest")  # variables that do
CREEP = 1.0  # Stribeck velocities: slower than about that an axis is held, not sliding

# The memory: direction of motion (-1, 0 before the first, 1), turning point in m, farthest point since in m, s since
# the turning point and since the farthest one, place in m where the axis has been for how many s, the last rest in s,
# and m gone since that, in steps of PLAY.
MEMORY = ("direction", "turn", "far", "since", "since_far", "anchor", "clock", "rest", "slid")
CLOCKS = tuple(MEMORY.index(name) for name in ("since", "since_far", "clock", "rest"))  # those that go on at rest
PLAY = 2e-5  # m (rotary: rad): moving back by less is no reversal, moving by less is rest
LEAST_REST = 0.05  # s: a shorter one is a slow passage

# Operations: those that put a number on the stack first, then curves and waves, those on one number, those on two. The
# last ones come again with their second number behind the code, and with the place of it: formulas are full of such.
LOAD, NUMBER, RAMP, SPLINE, SURFACE, PERIODIC, WAVE = range(7)
NEGATIVE, ABS, SIGN, SIN, COS, EXP, LOG, SQRT, TANH = range(7, 16)
ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, MIN, MAX = range(16, 23)
WITH_NUMBER, WITH_LOAD = (k * (MAX - ADD + 1) for k in (1, 2))  # added to the code

ONE_ARGUMENT = {"abs": ABS, "sign": SIGN, "sin": SIN, "cos": COS, "exp": EXP, "log": LOG, "sqrt": SQRT, "tanh": TANH}
TWO_ARGUMENTS = {"min": MIN, "max": MAX}
EITHER_WAY = ("+", "*", "min", "max")  # whose two numbers may change places
OPERATORS = {"+": ADD, "-": SUBTRACT, "*": MULTIPLY, "/": DIVIDE, "**": POWER}
# Arguments of a curve or surface: how many are expressions (at which places), all others being numbers.
SPLINES = {"spline": (0,), "spline2": (0, 4), "periodic": (0,)}
SPLINE_NUMBERS = {"spline": 4, "spline2": 8, "periodic": 3}
