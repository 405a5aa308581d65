"""What other packages bring: the objects that their entry points name, in a fixed order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Any

from linid.errors import ConfigError


@cache
def _installed() -> Any:
    """All entry points of this installation; to look them up reads files of every package."""
    return entry_points()


def of_group(group: str) -> EntryPoints:
    """The entry points of a group, as they were when this process first asked for any."""
    found: EntryPoints = _installed().select(group=group)
    return found


def loaded(points: Iterable[EntryPoint]) -> Iterator[tuple[Any, str]]:
    """Each named object and the place to blame in messages; raises ConfigError for one that cannot be loaded."""
    for point in sorted(points, key=lambda other: (other.name, other.value)):
        source = point.dist.name if point.dist is not None else "unknown package"
        place = f"entry point {point.name!r} of {source}"
        try:
            yield point.load(), place
        except Exception as error:
            raise ConfigError(
                place, f"cannot be loaded: {type(error).__name__}: {error}", "Correct or uninstall the package"
            ) from error
