"""Errors that a user can act on: each states the place, the fact and the remedy."""

from __future__ import annotations


class LinidError(Exception):
    """Base of all expected failures; `exit_code` is what the command line returns."""

    exit_code = 1

    def __init__(self, place: str, fact: str, remedy: str) -> None:
        self.place = place
        self.fact = fact
        self.remedy = remedy
        super().__init__(f"{place}: {fact}. {remedy}")

    def __reduce__(self) -> tuple[type[LinidError], tuple[str, str, str]]:
        # Worker processes send errors back pickled; the default would pass one argument only.
        return (type(self), (self.place, self.fact, self.remedy))


class UsageError(LinidError):
    """The command line asks for something that cannot be (exit code 2)."""

    exit_code = 2


class ConfigError(LinidError):
    """A YAML file or a setting is wrong (exit code 3)."""

    exit_code = 3


class DataError(LinidError):
    """A recording cannot be used (exit code 4)."""

    exit_code = 4
