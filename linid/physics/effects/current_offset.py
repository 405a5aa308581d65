"""Current offset: the current sensors read a constant too much, and the drive controls what they read.

Source: Chen, Namuduri and Mir 2002, IEEE Trans. Ind. Appl. 38, 1273.
"""

from __future__ import annotations

from linid.physics.effects.effect import MOTORS, Effect, term
from linid.physics.parameter import Parameter


@term
def drive(t, y, v, i_1, i_2, i_3, record, elapsed, current_offset_1, current_offset_3):
    """Currents plus their offsets, A; the three offsets sum to zero like the currents."""
    return i_1 + current_offset_1, i_2 - current_offset_1 - current_offset_3, i_3 + current_offset_3


EFFECT = Effect(
    name="current_offset",
    slot="DRIVE",
    physics="The motor gets the logged currents plus constants o_1, -o_1 - o_3, o_3 while the drive is on.",
    parameters=(
        Parameter("current_offset_1", "o_1", "A", -5.0, 5.0, 0.0, meaning="offset of phase 1 (or of the only input)"),
        Parameter("current_offset_3", "o_3", "A", -5.0, 5.0, 0.0, meaning="offset of phase 3"),
    ),
    amplitudes=("current_offset_1", "current_offset_3"),
    phase_only=("current_offset_3",),
    kinds=MOTORS,
    drive=drive,
    # While the drive is on, offsets push with the field, current or not.
    depends_on=(("position",), ("position", "motor_force")),
    exposed_by="slow moves with the drive on, beside free wheels over the same stroke",
    confused_with=("cogging", "constant_force"),
)
