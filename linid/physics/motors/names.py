"""The motors' names, without loading what they compile: for the command line's help and the checks of settings."""

from __future__ import annotations

from functools import cache

from linid.entry_points import of_group

GROUP = "linid.motors"
_BUILT_IN = ("sine", "theta", "force")


@cache
def driven_motors() -> tuple[str, ...]:
    """The names of all motors with inputs: the built-in ones, then those of other packages."""
    return (*_BUILT_IN, *sorted(point.name for point in of_group(GROUP)))
