"""Friction drift: friction changes with running time while grease and bearings warm up.

Source: linid's own form.
"""

from __future__ import annotations

import math

from linid.physics.effects.effect import Effect, Outlook, Values, term
from linid.physics.effects.shapes import bounded
from linid.physics.parameter import Parameter

_QUICKEST = 0.3  # s: nothing warms up faster; what changes within a coast-down of that length is a drag


@term
def level(t, y, v, i_1, i_2, i_3, record, elapsed, warm_up, per_campaign, viscous, drift_time, campaign_time):
    """Factor on sliding and breakaway friction."""
    within = 1.0 - math.exp(-max(t, 0.0) / drift_time)
    return bounded(1.0 + warm_up * within + per_campaign * elapsed / campaign_time)


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, warm_up, per_campaign, viscous, drift_time, campaign_time):
    """What viscous friction gains, N: grease need not thin as bearings settle."""
    return -viscous * (1.0 - math.exp(-max(t, 0.0) / drift_time)) * v


def grid(outlook: Outlook) -> tuple[Values, ...]:
    """Time constants around the length of a recording; the running time of the campaign."""
    longest = max(outlook.durations)
    total = max(outlook.campaign_duration, sum(outlook.durations))
    times = [max(share * longest, _QUICKEST) for share in (0.5, 0.15, 2.0)]
    return tuple({"drift_time": one, "drift_campaign_time": total} for one in times)


EFFECT = Effect(
    name="friction_drift",
    slot="FORCE",
    physics="Friction drifts by d_1 (1 - exp(-t/tau)) + d_2 (share of the campaign), "
    "the viscous part by d_v (1 - exp(..)).",
    parameters=(
        Parameter("drift_warm_up", "d_1", "1", -0.9, 2.0, 0.0, meaning="change within each recording"),
        Parameter("drift_per_campaign", "d_2", "1", -0.9, 2.0, 0.0, meaning="change from first to last recording"),
        Parameter(
            "drift_viscous", "d_v", "N s/m", -1e5, 1e5, 0.0, meaning="change of viscous friction within each recording"
        ),
        Parameter("drift_time", "tau_d", "s", _QUICKEST, 1e4, 1.0, log=True, meaning="time constant in a recording"),
        Parameter("drift_campaign_time", "T_c", "s", 1e-2, 1e7, 1.0, log=True, meaning="campaign's running time"),
    ),
    amplitudes=("drift_warm_up", "drift_per_campaign", "drift_viscous"),
    preset=("drift_campaign_time",),
    grid=grid,
    level=level,
    force=force,
    depends_on=(("campaign_time", "direction"), ("time", "direction"), ("recording", "direction")),
    exposed_by="the same slow move at the beginning and at the end of the campaign",
    confused_with=("thermal_derating", "position_dependent_friction"),
)
