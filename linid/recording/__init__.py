"""Scope exports of servo drives -> recordings and campaigns in SI units. Heavy parts load on first use."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from linid.recording.recording import Array, Axis, Campaign, Kind, Reading, Recording, Split, in_order

if TYPE_CHECKING:
    from linid.recording.campaign import is_campaign, read_campaign
    from linid.recording.coastdown import CoastDown, find_coast_down
    from linid.recording.inspection import Inspection, inspect_file, starter_mapping
    from linid.recording.mapping import ChannelMapping, ChannelSpec
    from linid.recording.read import check_long_enough, read_recording
    from linid.recording.splines import cubic_spline_coefficients, to_uniform, trim

_WHERE = {
    "is_campaign": "campaign", "read_campaign": "campaign",
    "CoastDown": "coastdown", "find_coast_down": "coastdown",
    "Inspection": "inspection", "inspect_file": "inspection", "starter_mapping": "inspection",
    "ChannelMapping": "mapping", "ChannelSpec": "mapping",
    "check_long_enough": "read", "read_recording": "read",
    "cubic_spline_coefficients": "splines", "to_uniform": "splines", "trim": "splines",
}  # fmt: skip

__all__ = [
    "Array",
    "Axis",
    "Campaign",
    "ChannelMapping",
    "ChannelSpec",
    "CoastDown",
    "Inspection",
    "Kind",
    "Reading",
    "Recording",
    "Split",
    "check_long_enough",
    "cubic_spline_coefficients",
    "find_coast_down",
    "in_order",
    "inspect_file",
    "is_campaign",
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
