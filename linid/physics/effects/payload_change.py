"""Payload change: in some recordings the axis carries a mass that nobody wrote down.

Source: Newton's law.
"""

from __future__ import annotations

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import MOST_MARKED, marked, recording_sets
from linid.physics.parameter import Parameter


@term
def mass(record, payload_mass, payload_recordings):
    """The payload in kg where the recording's bit is set."""
    return payload_mass if marked(record, payload_recordings) else 0.0


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Each recording alone, then all from one on; nothing to be seen in a single recording."""
    return recording_sets("payload_recordings", outlook)


EFFECT = Effect(
    name="payload_change",
    slot="FORCE",
    physics="In some recordings the moving mass is larger by m_p.",
    parameters=(
        Parameter("payload_mass", "m_p", "kg", -50.0, 100.0, 0.0, meaning="mass that is not in the campaign file"),
        Parameter(
            "payload_recordings",
            "b_p",
            "1",
            0.0,
            2.0**MOST_MARKED,
            0.0,
            meaning="the recordings that have it: sum of 2^(number - 1)",
        ),
    ),
    amplitudes=("payload_mass",),
    preset=("payload_recordings",),
    acts="some",
    mark="payload_recordings",
    grid=grid,
    mass=mass,
    changes="mass",
    depends_on=(("acceleration", "recording"), ("acceleration", "campaign_time")),
    exposed_by="the same accelerations in every recording",
    confused_with=("external_disturbance", "force_saturation"),
)
