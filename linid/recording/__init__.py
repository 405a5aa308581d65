"""Scope exports of servo drives -> recordings and campaigns in SI units. Heavy parts load on first use."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from linid.arrays import Array
from linid.recording.recording import Axis, Kind, Reading, RecordedCampaign, Recording, Split, in_order

if TYPE_CHECKING:
    from linid.recording.campaign import is_campaign, read_campaign
    from linid.recording.check_findings import Finding, RecordingChecks
    from linid.recording.checks import (
        CHECKS_LEGEND,
        all_findings,
        checks_data,
        checks_of,
        checks_table,
        joined_findings,
    )
    from linid.recording.coastdown import CoastDown, find_coast_down
    from linid.recording.inspection import Inspection, inspect_file, starter_mapping
    from linid.recording.mapping import ChannelMapping, ChannelSpec
    from linid.recording.read import check_long_enough, read_recording
    from linid.recording.splines import cubic_spline_coefficients, to_uniform, trim

_WHERE = {
    "is_campaign": "campaign",
    "read_campaign": "campaign",
    "Finding": "check_findings",
    "RecordingChecks": "check_findings",
    "all_findings": "checks",
    "checks_data": "checks",
    "checks_of": "checks",
    "checks_table": "checks",
    "joined_findings": "checks",
    "CHECKS_LEGEND": "checks",
    "CoastDown": "coastdown",
    "find_coast_down": "coastdown",
    "Inspection": "inspection",
    "inspect_file": "inspection",
    "starter_mapping": "inspection",
    "ChannelMapping": "mapping",
    "ChannelSpec": "mapping",
    "check_long_enough": "read",
    "read_recording": "read",
    "cubic_spline_coefficients": "splines",
    "to_uniform": "splines",
    "trim": "splines",
}

__all__ = [
    "CHECKS_LEGEND",
    "Array",
    "Axis",
    "ChannelMapping",
    "ChannelSpec",
    "CoastDown",
    "Finding",
    "Inspection",
    "Kind",
    "Reading",
    "RecordedCampaign",
    "Recording",
    "RecordingChecks",
    "Split",
    "all_findings",
    "check_long_enough",
    "checks_data",
    "checks_of",
    "checks_table",
    "cubic_spline_coefficients",
    "find_coast_down",
    "in_order",
    "inspect_file",
    "is_campaign",
    "joined_findings",
    "read_campaign",
    "read_recording",
    "starter_mapping",
    "to_uniform",
    "trim",
]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_WHERE[name]}"), name)
