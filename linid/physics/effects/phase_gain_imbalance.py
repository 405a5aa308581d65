"""Phase gain imbalance: the three phases do not push equally (windings, sensors or amplifiers differ).

Source: Chen, Namuduri and Mir 2002, IEEE Trans. Ind. Appl. 38, 1273.
"""

from __future__ import annotations

from linid.physics.effects.effect import PHASE_MOTORS, Effect, term
from linid.physics.parameter import Parameter


@term
def drive(t, y, v, i_1, i_2, i_3, record, elapsed, phase_gain_1, phase_gain_3):
    """Currents times their gains 1 + g_j, A; the gains' mean belongs to the force constant, so g_2 = -g_1 - g_3."""
    return i_1 * (1.0 + phase_gain_1), i_2 * (1.0 - phase_gain_1 - phase_gain_3), i_3 * (1.0 + phase_gain_3)


EFFECT = Effect(
    name="phase_gain_imbalance",
    slot="DRIVE",
    physics="Phase j pushes 1 + g_j times as much as it should, with g_1 + g_2 + g_3 = 0.",
    parameters=(
        Parameter("phase_gain_1", "g_1", "1", -0.45, 0.45, 0.0, meaning="gain error of phase 1"),
        Parameter("phase_gain_3", "g_3", "1", -0.45, 0.45, 0.0, meaning="gain error of phase 3"),
    ),
    amplitudes=("phase_gain_1", "phase_gain_3"),
    kinds=PHASE_MOTORS,
    drive=drive,
    depends_on=(("position", "motor_force"),),
    exposed_by="strong accelerations over several pole pitches",
    confused_with=("current_offset", "force_ripple"),
)
