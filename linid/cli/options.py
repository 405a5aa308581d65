"""Options of the command line, each stated once, and the way from options to settings."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.shell_completion import CompletionItem

from linid.cli.search import SEARCH_NAMES, SEARCH_OPTIONS
from linid.physics.laws.names import LAW_CHOICES

if TYPE_CHECKING:
    from linid.workflow.run.request import Request

Command = TypeVar("Command", bound=Callable[..., Any])


class MotorName(click.ParamType):  # type: ignore[type-arg,unused-ignore]
    """A motor by name; others: names besides. What packages bring is looked for only when it is asked for."""

    name = "motor"

    def __init__(self, *others: str) -> None:
        self._others = others

    def _choice(self) -> click.Choice[str]:
        from linid.physics.motors.names import driven_motors

        return click.Choice([*driven_motors(), *self._others])

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str | None:
        """The names, as the help shows them."""
        return self._choice().get_metavar(param, ctx)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The name itself; raises BadParameter for one that nobody has."""
        return self._choice().convert(value, param, ctx)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Names that begin so."""
        return self._choice().shell_complete(ctx, param, incomplete)


CONTROLLER = click.option(
    "--controller",
    type=click.Path(path_type=Path),
    metavar="CONTROLLER.yaml",
    help="The drive's loops, as configs/controller.yaml describes them: the model follows commanded positions.",
)


def _remember(ctx: click.Context, parameter: click.Parameter, value: Any) -> Any:
    # Seen by the error handling of the whole program.
    ctx.meta[f"linid.{parameter.name}"] = value
    return value


def apply_options(options: list[Callable[[Command], Command]]) -> Callable[[Command], Command]:
    """Options as one decorator, in the order in which help shows them."""

    def decorate(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


debug_option = click.option(
    "--debug", is_flag=True, expose_value=False, callback=_remember, help="Show the traceback of an error."
)
json_option = click.option(
    "--json", "json_output", is_flag=True, callback=_remember, help="Print a machine-readable summary on stdout."
)
verbosity_options = apply_options(
    [
        click.option("-q", "--quiet", is_flag=True, help="No progress on stderr, warnings only."),
        click.option("-v", "--verbose", is_flag=True, help="Also notes of the reader and the fit on stderr."),
    ]
)


def usable_cores() -> int:
    """Processor cores that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def jobs_option(text: str) -> Callable[[Command], Command]:
    """`--jobs`, by default as many as there are cores; text: its help."""
    return click.option(
        "--jobs",
        type=click.IntRange(min=1),
        default=usable_cores,
        show_default=False,
        metavar="N",
        help=f"{text} [all cores].",
    )


run_options = apply_options(
    [
        click.option(
            "--out", type=click.Path(path_type=Path), metavar="DIR", help="Folder for the results [a fresh dated one]."
        ),
        click.option("--overwrite", is_flag=True, help="Replace an earlier run in the --out folder."),
        click.option(
            "--resume",
            is_flag=True,
            help="Go on with the interrupted run in --out DIR, or in the newest unfinished folder here.",
        ),
        jobs_option("Threads (batch: jobs at a time); never changes a result"),
        click.option("--dry-run", is_flag=True, help="Say what would be done and write nothing."),
        json_option,
        verbosity_options,
        debug_option,
    ]
)
scheduler_option = click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Work on the dask cluster at this address, such as tcp://host:8786; `local`: with --jobs worker processes "
    'here. Needs the extra: pip install "linid[cluster]".',
)
figures_options = apply_options(
    [
        click.option(
            "--figures",
            type=click.Choice(["few", "all", "none"]),
            help="few: overviews and the worst recordings; all: every recording too [few].",
        ),
        click.option("--no-figures", is_flag=True, help="The same as --figures none."),
    ]
)
settings_options = apply_options(
    [
        click.option(
            "--config",
            type=click.Path(path_type=Path),
            metavar="FILE",
            help="Settings as YAML, such as config.yaml of an earlier run.",
        ),
        click.option(
            "--set",
            "assignments",
            multiple=True,
            metavar="KEY=VALUE",
            help="Set a key of the settings (those of config.yaml in a run folder); repeatable.",
        ),
        click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Seed of everything random [1]."),
        click.option(
            "--axis",
            type=click.Choice(["linear", "rotary"]),
            help="Kind of axis, for recordings given without a campaign [linear].",
        ),
        click.option(
            "--channels",
            type=click.Path(path_type=Path),
            metavar="YAML",
            help="Column mapping, for recordings given without a campaign (see `linid inspect`).",
        ),
        click.option("--window", metavar="T0:T1", help="Part to use in s, for recordings given without a campaign."),
        click.option("--period", type=float, metavar="SECONDS", help="Sampling period where no time column exists."),
        click.option(
            "--added-mass",
            multiple=True,
            metavar="[FILE=]KG",
            help="Known added mass, without a campaign: 0.5 for all, or run_4.csv=0.5 for one; repeatable.",
        ),
        figures_options,
    ]
)
_MODEL = [
    click.option("--mass", type=float, metavar="KG", help="Known moving mass (rotary: kg m^2)."),
    click.option(
        "--known", multiple=True, metavar="NAME=VALUE", help="Parameter held at this value, in SI; repeatable."
    ),
    click.option("--effect", multiple=True, metavar="NAME", help="Effect to identify too (see `linid effects`)."),
]


def _print_schema(ctx: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        import json

        from linid.config import json_schema
        from linid.workflow.batch.file import BatchFile

        click.echo(json.dumps(json_schema(BatchFile), indent=1))
        ctx.exit()


schema_option = click.option(
    "--schema",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_schema,
    help="Print the JSON schema of a batch file and exit.",
)


def start_option(otherwise: str) -> Callable[[Command], Command]:
    """`--friction`; otherwise: what happens without it, for its help."""
    return click.option(
        "--friction",
        type=click.Path(path_type=Path),
        metavar="MODEL",
        help="Start from this result: a MODEL.json, or the folder of a fit or diagnosis; --effect learned takes the "
        f"term that a diagnosis has put into its model_after.json [else {otherwise}].",
    )


model_options = apply_options(
    [
        *_MODEL,
        click.option(
            "--without",
            multiple=True,
            metavar="EFFECT",
            help="Leave an effect of the library out of consideration: do the data ask for it themselves? Repeatable.",
        ),
    ]
)
fit_options = apply_options(
    [
        *_MODEL,
        click.option(
            "--bound",
            multiple=True,
            metavar="NAME=LO:HI",
            help="Search range of a parameter, in SI, e.g. mass=1:5; repeatable.",
        ),
        click.option(
            "--objective",
            type=click.Choice(["auto", "free_run", "ahead", "acceleration"]),
            help="What is fitted: position of the whole run, position 0.1 s ahead, or acceleration "
            "[auto: free_run for free wheels, ahead for driven runs].",
        ),
        *SEARCH_OPTIONS,
        click.option("--free-exponent", is_flag=True, help="Identify the Stribeck exponent alpha too [fixed at 2]."),
        click.option("--no-stribeck", is_flag=True, help="Tie F_S to F_C: Coulomb and viscous friction only."),
        click.option(
            "--law",
            type=click.Choice(LAW_CHOICES),
            help="Friction law; auto: the one that the recordings prefer [that of --friction, else lugre].",
        ),
        click.option("--substeps", type=int, metavar="N", help="Internal steps per sample [from the data]."),
        click.option("--profile", multiple=True, metavar="NAME", help="Profile likelihood of a parameter; repeatable."),
    ]
)

SETTINGS_NAMES = (
    "config",
    "assignments",
    "seed",
    "axis",
    "channels",
    "window",
    "period",
    "added_mass",
    "figures",
    "no_figures",
    "mass",
    "known",
    "bound",
    "effect",
    "without",
    "objective",
    *SEARCH_NAMES,
    "free_exponent",
    "no_stribeck",
    "law",
    "substeps",
    "profile",
)
RUN_NAMES = ("out", "overwrite", "resume", "jobs", "scheduler", "dry_run", "json_output", "quiet", "verbose")


def overrides(options: dict[str, Any]) -> dict[str, Any]:
    """The options that were given, as raw settings keys; raises click's BadParameter for one that cannot be read."""
    from linid.workflow.run.settings import parse_assignment, read_mapping

    raw: dict[str, Any] = {}
    for name in ("seed", "axis", "period", "mass", "objective", *SEARCH_NAMES, "substeps", "law", "figures"):
        if options.get(name) is not None:
            raw[name] = options[name]
    if options.get("channels") is not None:
        raw["channels"] = read_mapping(options["channels"])
    if options.get("window"):
        raw["window"] = _range("--window", options["window"])
    if options.get("effect"):
        raw["effects"] = list(options["effect"])
    if options.get("without"):
        raw["without"] = list(options["without"])
    if options.get("profile"):
        raw["profiles"] = list(options["profile"])
    if options.get("free_exponent"):
        raw["free_exponent"] = True
    if options.get("no_stribeck"):
        raw["stribeck"] = False
    if options.get("no_figures"):
        raw["figures"] = "none"
    if options.get("known"):
        raw["known"] = dict(_pair("--known", text) for text in options["known"])
    if options.get("bound"):
        raw["bounds"] = {
            name: _range("--bound", span) for name, span in (_split("--bound", text) for text in options["bound"])
        }
    if options.get("added_mass"):
        raw["added_mass"] = dict(_mass(text) for text in options["added_mass"])
    for text in options.get("assignments", ()):
        for key, value in parse_assignment(text).items():
            below = raw.get(key)
            raw[key] = {**below, **value} if isinstance(below, dict) and isinstance(value, dict) else value
    return raw


def make_request(files: tuple[Path, ...], options: dict[str, Any]) -> Request:
    """The request that a command hands to the workflow; takes its names out of `options`."""
    from linid.interface.settings import make_settings
    from linid.workflow.run.request import Request
    from linid.workflow.run.settings import read_settings

    chosen = {name: options.pop(name) for name in SETTINGS_NAMES if name in options}
    run = {name: options.pop(name) for name in RUN_NAMES if name in options}
    below = read_settings(chosen["config"]) if chosen.get("config") is not None else {}
    return Request(
        files=files,
        settings=make_settings(below, overrides(chosen)),
        out=run.get("out"),
        overwrite=run.get("overwrite", False),
        resume=run.get("resume", False),
        jobs=run.get("jobs", 1),
        scheduler=run.get("scheduler"),
        dry_run=run.get("dry_run", False),
        line=command_line(),
    )


def command_line() -> str:
    """The command as typed, for the record."""
    import shlex
    import sys

    return shlex.join(["linid", *sys.argv[1:]])


def _split(option: str, text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name or not value:
        raise click.BadParameter(f"found {text!r}, expected NAME=VALUE", param_hint=option)
    return name.strip(), value.strip()


def _number(option: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise click.BadParameter(f"found {text!r}, expected a number such as 0.5", param_hint=option) from None


def _pair(option: str, text: str) -> tuple[str, float]:
    name, value = _split(option, text)
    return name, _number(option, value)


def _mass(text: str) -> tuple[str, float]:
    name, _, value = text.rpartition("=")
    return name or "*", _number("--added-mass", value)


def _range(option: str, text: str) -> tuple[float, float]:
    low, colon, high = text.partition(":")
    if not colon:
        raise click.BadParameter(f"found {text!r}, expected two numbers such as 0.2:1.5", param_hint=option)
    return _number(option, low), _number(option, high)
