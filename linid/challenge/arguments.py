"""What the effects of the library depend on, as honest answers where one of them is left out of a diagnosis.

Names are those of `linid.challenge.outside.ARGUMENTS`, the main one first; an answer that needs none of them is empty.
Where one answer is as honest as another, both stand: a friction law that differs by direction acts through the sign of
the velocity, and so does an odd function of it.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

Answers = tuple[tuple[str, ...], ...]
_RANK = {"wrong": 0, "related": 1, "exact": 2}

LISTED_ARGUMENTS: dict[str, Answers] = {
    "cogging": (("position",),),
    # The commutation keeps the current's amplitude with the force: both are one argument.
    "force_ripple": (("position", "motor_force"),),
    "phase_gain_imbalance": (("position", "motor_force"),),
    # While the drive is on, offsets push with the field, current or not.
    "current_offset": (("position",), ("position", "motor_force")),
    # In Coulomb friction the direction alone, in viscous friction the speed in one direction.
    "asymmetric_friction": (("direction",), ("velocity",), ("velocity", "direction")),
    "constant_force": ((),),
    # A spring over the stroke; its hysteresis shows after reversals, or as a direction.
    "cable_force": (("position",), ("position", "direction"), ("travel", "position")),
    "position_dependent_friction": (("position", "direction"),),
    "quadratic_drag": (("velocity",),),
    # F(t - T) - F(t): what the force was, seen as its rate, which a motion in time may stand for.
    "input_delay": (("motor_force",), ("acceleration",), ("time", "motor_force")),
    "force_saturation": (("motor_force",),),
    # Heat: a running time, of the recording with a fast part and of the campaign with a slow one.
    "thermal_derating": (("motor_force", "time"), ("motor_force", "campaign_time"), ("motor_force", "recording")),
    "end_effect": (("position", "motor_force"),),
    # A mass on a spring rings after what the axis does: acceleration, or a wave of its own in time.
    "flexible_load": (("acceleration",), ("time",), ("motor_force",)),
    # Force balance: the error's second derivative, a wave in position that grows with the speed's square.
    "encoder_periodic_error": (("position", "velocity"),),
    "external_disturbance": (("time",), ("time", "recording"), ("campaign_time",)),
    "friction_drift": (("time", "direction"), ("campaign_time", "direction"), ("recording", "direction")),
    "payload_change": (("acceleration", "recording"), ("acceleration", "campaign_time")),
    "backlash": (("travel",), ("travel", "direction"), ("acceleration",)),
    "eddy_current_drag": (("velocity",),),
    "dwell_stiction": (("rest_time", "direction"),),
    # A field out of phase: thrust that falls off slowly along the stroke.
    "pole_pitch_error": (("position", "motor_force"),),
    "gravity": (("position",),),
    "friction_level_change": (("recording", "direction"), ("campaign_time", "direction")),
    "drive_train_backlash": (("travel",), ("acceleration",), ("travel", "direction"), ("motor_force",)),
    "load_dependent_friction": (("motor_force", "direction"),),
}


def best_grade(said: Collection[str], answers: Sequence[tuple[str, ...]]) -> str:
    """`exact`, `related` or `wrong`: the best that what is said earns of several honest answers."""
    from linid.challenge.proposals import grade

    known = [grade(said, one) if one else "exact" if not said else "wrong" for one in answers]
    return max(known, key=_RANK.__getitem__)
