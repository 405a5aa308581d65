"""Identification and diagnosis of linear-motor axes from the servo drive's scope recordings.

    campaign = linid.read("campaign.yaml")
    motor = linid.fit(campaign, "theta")
    found = linid.diagnose(campaign, "theta")

Public are the names in `__all__`, with `linid.plot` for figures; everything else may change.
"""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from linid import plot
    from linid.api import (
        Campaign,
        ConfigError,
        DataError,
        Diagnosed,
        Fit,
        Gaps,
        LinidError,
        Recording,
        UsageError,
        compensate,
        diagnose,
        fit,
        follow,
        load,
        read,
        refit_unit,
        simulate,
        simulated_by,
        survey_exports,
        validate,
    )

if _cache := os.environ.get("LINID_CACHE_DIR"):  # numba reads this when it is first imported
    os.environ.setdefault("NUMBA_CACHE_DIR", os.path.join(_cache, "numba"))

__all__ = [
    "Campaign",
    "ConfigError",
    "DataError",
    "Diagnosed",
    "Fit",
    "Gaps",
    "LinidError",
    "Recording",
    "UsageError",
    "compensate",
    "diagnose",
    "fit",
    "follow",
    "load",
    "plot",
    "read",
    "refit_unit",
    "simulate",
    "simulated_by",
    "survey_exports",
    "validate",
]


def __getattr__(name: str) -> Any:
    """Public names, imported when they are first asked for: `linid --help` needs none of them."""
    if name == "__version__":
        from importlib import metadata  # takes as long to load as the rest of `linid --help`

        return metadata.version("linid")
    if name == "plot":
        return import_module("linid.plot")
    if name in __all__:
        return getattr(import_module("linid.api"), name)
    raise AttributeError(f"module 'linid' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
