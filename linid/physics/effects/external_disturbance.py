"""External disturbance: something pushes the axis at some moments, each of one recording.

Source: linid's own form, pulses of a raised cosine.
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.parameter import Parameter

_PUSHES = 6


@term
def push(t, record, size, start, duration, recording):
    """A raised-cosine pulse, N; 0 outside its recording and time.

    t: s; size: N; start, duration: s; recording: its number.
    """
    if size == 0.0 or record != recording or record < 1.0:
        return 0.0
    share = (t - start) / duration
    if not 0.0 < share < 1.0:
        return 0.0
    return 0.5 * size * (1.0 - math.cos(2.0 * math.pi * share))


@term
def force(
    t,
    y,
    v,
    i_1,
    i_2,
    i_3,
    record,
    elapsed,
    size_1,
    start_1,
    duration_1,
    recording_1,
    size_2,
    start_2,
    duration_2,
    recording_2,
    size_3,
    start_3,
    duration_3,
    recording_3,
    size_4,
    start_4,
    duration_4,
    recording_4,
    size_5,
    start_5,
    duration_5,
    recording_5,
    size_6,
    start_6,
    duration_6,
    recording_6,
):
    """Sum of six pulses, N."""
    return (
        push(t, record, size_1, start_1, duration_1, recording_1)
        + push(t, record, size_2, start_2, duration_2, recording_2)
        + push(t, record, size_3, start_3, duration_3, recording_3)
        + push(t, record, size_4, start_4, duration_4, recording_4)
        + push(t, record, size_5, start_5, duration_5, recording_5)
        + push(t, record, size_6, start_6, duration_6, recording_6)
    )


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """One push, of two lengths in every recording, each half over the one before."""
    out = []
    for length in (0.3, 0.12):
        for record, duration in zip(outlook.records, outlook.durations, strict=True):
            for k in range(int(2.0 * duration / length) if record >= 1 else 0):
                out.append(
                    {
                        "disturbance_start_1": 0.5 * k * length,
                        "disturbance_duration_1": length,
                        "disturbance_recording_1": float(record),
                    }
                )
    return tuple(out)


def _parameters(k: int) -> tuple[Parameter, ...]:
    """Those of push k."""
    return (
        Parameter(f"disturbance_force_{k}", f"F_d{k}", "N", -500.0, 500.0, 0.0, meaning=f"peak of push {k}"),
        Parameter(
            f"disturbance_start_{k}",
            f"t_d{k}",
            "s",
            -10.0,
            1e4,
            0.0,
            reach=0.3,
            meaning="its start on the recording's clock",
        ),
        Parameter(f"disturbance_duration_{k}", f"T_d{k}", "s", 5e-3, 10.0, 0.2, log=True, meaning="its duration"),
        Parameter(
            f"disturbance_recording_{k}", f"n_d{k}", "1", 0.0, 1e4, 0.0, meaning="number of its recording, 0: no push"
        ),
    )


EFFECT = Effect(
    name="external_disturbance",
    slot="FORCE",
    physics="Up to six smooth pushes act, each of size F_d from t_d on for T_d seconds of one recording.",
    parameters=tuple(p for k in range(1, _PUSHES + 1) for p in _parameters(k)),
    amplitudes=tuple(f"disturbance_force_{k}" for k in range(1, _PUSHES + 1)),
    preset=tuple(f"disturbance_recording_{k}" for k in range(1, _PUSHES + 1)),
    acts="one",
    mark="disturbance_recording_1",
    parts=_PUSHES,
    grid=grid,
    force=force,
    depends_on=(("time", "recording"), ("time",), ("campaign_time",)),
    exposed_by="the same motion once more",
    confused_with=("payload_change", "friction_drift"),
)
