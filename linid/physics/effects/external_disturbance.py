"""External disturbance: something pushes the axis at some moment of one recording."""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.parameter import Parameter


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2, size, start, duration, recording):
    """A raised-cosine pulse, N."""
    share = (t - start) / duration
    if record != recording or not 0.0 < share < 1.0:
        return 0.0
    return 0.5 * size * (1.0 - math.cos(2.0 * math.pi * share))


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Pulses of two lengths in every recording, each half over the one before."""
    out = []
    for length in (0.3, 0.12):
        for record, duration in zip(outlook.records, outlook.durations, strict=True):
            for k in range(int(2.0 * duration / length)):
                out.append(
                    {
                        "disturbance_start": 0.5 * k * length,
                        "disturbance_duration": length,
                        "disturbance_recording": float(record),
                    }
                )
    return tuple(out)


EFFECT = Effect(
    name="external_disturbance",
    slot="FORCE",
    physics="A smooth push of size F_d, from t_d on for T_d seconds, acts in one recording.",
    parameters=(
        Parameter("disturbance_force", "F_d", "N", -500.0, 500.0, 0.0, meaning="peak of the push"),
        Parameter(
            "disturbance_start", "t_d", "s", -10.0, 1e4, 0.0, meaning="its start on the recording's clock", reach=0.3
        ),
        Parameter("disturbance_duration", "T_d", "s", 5e-3, 10.0, 0.2, log=True, meaning="its duration"),
        Parameter("disturbance_recording", "n_d", "1", 0.0, 1e4, 1.0, meaning="number of the recording"),
    ),
    amplitudes=("disturbance_force",),
    structural=("disturbance_recording",),
    acts="one",
    mark="disturbance_recording",
    grid=grid,
    force=force,
    exposed_by="the same motion recorded again",
    confused_with=("payload_change", "friction_drift"),
)
