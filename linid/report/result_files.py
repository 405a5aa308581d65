"""The result files of a fit, one entry each; other packages add theirs by the entry point `linid.results`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from functools import cache
from importlib.metadata import EntryPoint
from typing import TYPE_CHECKING

from linid.entry_points import loaded, of_group
from linid.errors import ConfigError
from linid.report.files import csv_text

if TYPE_CHECKING:
    from linid.identification.result import FitResult

GROUP = "linid.results"
MODEL_FILE = "parameters.json"
MODEL_AFTER = "model_after.json"  # of a diagnosis, with all that it found


@dataclass(frozen=True)
class ResultFile:
    """One file that a fit leaves behind. name: of the file, with its ending; text: its content for a result, SI;
    empty where there is nothing to tell."""

    name: str
    text: Callable[[FitResult], str]


def _parameters_csv(result: FitResult) -> str:
    from linid.report.tables import parameter_csv

    return parameter_csv(result)


def _parameters_tex(result: FitResult) -> str:
    from linid.report.latex import parameter_latex

    return parameter_latex(result)


def convergence_text(result: FitResult) -> str:
    """The convergence history as CSV."""
    from linid.identification.result import Generation

    names = [f.name for f in fields(Generation)]
    return csv_text(names, ([getattr(line, name) for name in names] for line in result.history))


def profiles_text(result: FitResult) -> str:
    """The profile likelihoods as CSV in SI units; empty where none was asked for."""
    if not result.profiles:
        return ""
    return csv_text(
        ("parameter", "value", "likelihood_ratio"),
        (
            (profile.name, *point)
            for profile in result.profiles
            for point in zip(profile.values, profile.statistic, strict=True)
        ),
    )


def _model(result: FitResult) -> str:
    from linid.identification.model_file import model_to_text

    return model_to_text(result)


# The model last: where it is, all others are.
BUILT_IN = (
    ResultFile("parameters.csv", _parameters_csv),
    ResultFile("parameters.tex", _parameters_tex),
    ResultFile("convergence.csv", convergence_text),
    ResultFile("profiles.csv", profiles_text),
    ResultFile(MODEL_FILE, _model),
)


def collect(built_in: Iterable[ResultFile], others: Iterable[EntryPoint]) -> tuple[ResultFile, ...]:
    """All result files, those of other packages first; raises ConfigError for what is none, or a name twice."""
    own = tuple(built_in)
    taken = {one.name for one in own}
    found = []
    for one, place in loaded(others):
        if not isinstance(one, ResultFile) or not one.name or "/" in one.name or "\\" in one.name:
            raise ConfigError(
                place, "names no linid.report.result_files.ResultFile", "Correct or uninstall the package"
            )
        if one.name in taken:
            raise ConfigError(place, f"the file name {one.name!r} is taken", "Rename it, or uninstall.")
        taken.add(one.name)
        found.append(one)
    return (*found, *own)


@cache
def result_files() -> tuple[ResultFile, ...]:
    """All result files of this installation."""
    return collect(BUILT_IN, of_group(GROUP))
