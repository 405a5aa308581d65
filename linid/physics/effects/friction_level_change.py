"""Changed level of friction between recordings: in some of them the guideway runs heavier or easier by a factor.

Source: linid's own form, a factor.
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import MOST_MARKED, bounded, marked, recording_sets
from linid.physics.parameter import Parameter


@term
def level(t, y, v, i_1, i_2, i_3, record, elapsed, friction_change, friction_change_recordings):
    """Factor on sliding and breakaway friction where the recording's bit is set: the bristles' stiffness stays."""
    return bounded(1.0 + friction_change) if marked(record, friction_change_recordings) else 1.0


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Each recording alone, then all from one on; nothing to be seen in a single recording."""
    return recording_sets("friction_change_recordings", outlook)


EFFECT = Effect(
    name="friction_level_change",
    slot="FORCE",
    physics="In some recordings sliding and breakaway friction are larger (c > 0) or smaller: factor 1 + c.",
    parameters=(
        Parameter("friction_change", "c_f", "1", -0.95, 10.0, 0.0, meaning="relative change of the friction level"),
        Parameter(
            "friction_change_recordings",
            "b_f",
            "1",
            0.0,
            2.0**MOST_MARKED,
            0.0,
            meaning="the recordings that have it: sum of 2^(number - 1)",
        ),
    ),
    amplitudes=("friction_change",),
    preset=("friction_change_recordings",),
    acts="some",
    mark="friction_change_recordings",
    grid=grid,
    level=level,
    changes="coulomb_force",
    depends_on=(("recording", "direction"), ("campaign_time", "direction")),
    exposed_by="the same slow move or free wheel in every recording",
    confused_with=("friction_drift", "payload_change"),
)
