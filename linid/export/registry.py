"""The explicit list of all targets; those of other packages follow, by the entry point `linid.exports`."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib.metadata import EntryPoint

from linid.entry_points import loaded, of_group
from linid.errors import ConfigError, UsageError
from linid.export.target import Target, check_target
from linid.export.targets import isaac, matlab, mujoco, python, ros2, twincat, urdf
from linid.export.targets.c import target as c
from linid.export.targets.fmu import target as fmu
from linid.export.targets.modelica import target as modelica

GROUP = "linid.exports"

BUILT_IN: tuple[Target, ...] = (
    python.TARGET,
    c.TARGET,
    fmu.TARGET,
    matlab.TARGET,
    modelica.TARGET,
    mujoco.TARGET,
    urdf.TARGET,
    isaac.TARGET,
    ros2.TARGET,
    twincat.TARGET,
)


def collect(built_in: Iterable[Target], others: Iterable[EntryPoint]) -> dict[str, Target]:
    """All targets by name, in order; raises ConfigError for what is none, or a name that is taken already."""
    targets: dict[str, Target] = {}
    for one, place in (*((target, "linid") for target in built_in), *loaded(others)):
        target = check_target(one, place)
        if target.name in targets:
            raise ConfigError(place, f"there is a target {target.name!r} already", "Rename it, or uninstall one.")
        targets[target.name] = target
    return targets


@cache
def all_targets() -> dict[str, Target]:
    """The targets of this installation by name."""
    return collect(BUILT_IN, of_group(GROUP))


def find_target(name: str) -> Target:
    """The target called `name`; raises UsageError, which lists all, for one that nobody has."""
    targets = all_targets()
    if name not in targets:
        known = ", ".join(targets)
        raise UsageError("--to", f"there is no target {name!r}", f"Choose of {known}.")
    return targets[name]
