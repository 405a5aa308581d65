"""What other packages bring: the objects that their entry points name, in a fixed order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.metadata import EntryPoint
from typing import Any

from linid.errors import ConfigError


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
