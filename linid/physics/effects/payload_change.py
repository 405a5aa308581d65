"""Payload change: in some recordings the axis carries a mass that nobody wrote down."""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.parameter import Parameter

_MOST = 50  # recordings that a number can mark by its bits


@term
def mass(record, payload_mass, payload_recordings):
    """The payload in kg where the recording's bit is set."""
    if record < 1.0:
        return 0.0
    shifted = math.floor(payload_recordings / 2.0 ** (record - 1.0))
    return payload_mass * (shifted - 2.0 * math.floor(0.5 * shifted))


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Each recording alone, then all from one on; nothing to be seen in a single recording."""
    numbers = [n for n in outlook.records if 1 <= n <= _MOST]
    if len(numbers) < 2:
        return ()
    alone = [2.0 ** (n - 1) for n in numbers]
    onwards = [sum(alone[k:]) for k in range(1, len(alone) - 1)]
    return tuple({"payload_recordings": bits} for bits in [*alone, *onwards])


EFFECT = Effect(
    name="payload_change",
    slot="FORCE",
    physics="In some recordings the moving mass is larger by m_p.",
    parameters=(
        Parameter("payload_mass", "m_p", "kg", -50.0, 100.0, 0.0, meaning="mass that is not in the campaign file"),
        Parameter(
            "payload_recordings", "b_p", "1", 0.0, 2.0**_MOST, 0.0,
            meaning="the recordings that have it: sum of 2^(number - 1)",
        ),
    ),
    amplitudes=("payload_mass",),
    structural=("payload_recordings",),
    grid=grid,
    mass=mass,
    exposed_by="the same accelerations in every recording",
    confused_with=("external_disturbance", "force_saturation"),
)  # fmt: skip
