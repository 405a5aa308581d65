"""`linid challenge`: make, run, oracle, score; export, answer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from linid.cli.console import make_reporter, print_outcome
from linid.cli.options import debug_option, jobs_option, json_option, verbosity_options

FOLDER = click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
JOBS = jobs_option("Campaigns at a time; never changes a result")
KEYS = click.option("--keys", type=click.Path(path_type=Path), metavar="FILE", help="The keys [DIR/keys.yaml].")
KINDS = ("single", "pair", "none", "unknown")


@click.group()
def challenge() -> None:
    """Prove the diagnosis on campaigns of an independent plant with withheld effects.

    `make` writes campaigns and, in a file of its own, the keys; `run` diagnoses the campaigns without opening the
    keys; `oracle` opens them and fits the true effects, for comparison; `score` compares. `export` writes a fixed suite
    that others can enter, `answer` enters it with linid's own diagnoses, and `score` also scores such submissions.

    \b
    Example:
      linid challenge make --count 40 --seed 1 --out proof
      linid challenge run proof
      linid challenge oracle proof
      linid challenge score proof
      linid challenge export suite
      linid challenge answer suite --out linid.json
      linid challenge score linid.json --suite suite
    """


def _names(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[str, ...]:
    return tuple(name.strip() for name in (value or "").split(",") if name.strip())


def _span(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, float] | None:
    if value is None:
        return None
    try:
        low, high = (float(part) for part in value.split(","))
    except ValueError:
        raise click.BadParameter(f"found {value!r}, expected two numbers such as 0.05,1") from None
    return low, high


def _metres(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, float] | None:
    """A span given in um."""
    span = _span(ctx, parameter, value)
    return None if span is None else (1e-6 * span[0], 1e-6 * span[1])


def _numbers(ctx: click.Context, parameter: click.Parameter, value: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in value.split(",") if part.strip())
    except ValueError:
        raise click.BadParameter(f"found {value!r}, expected numbers such as 500,1000") from None


@challenge.command()
@click.option("--count", type=click.IntRange(min=1), required=True, metavar="N", help="How many campaigns.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Seed of everything random.")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="Folder [a fresh dated one].")
@click.option("--keys", type=click.Path(path_type=Path), metavar="FILE", help="Where the keys go [DIR/keys.yaml].")
@click.option(
    "--effects",
    callback=_names,
    metavar="A,B",
    help="Effects to hide, or `all` [crowds: all; else the first eighteen, as older seeds had].",
)
@click.option(
    "--strength",
    callback=_span,
    default="0.05,1",
    show_default=True,
    metavar="LOW,HIGH",
    help="Range of strength; at 1 the base model misses 10 % of the total force.",
)
@click.option(
    "--kinds",
    callback=_names,
    default=",".join(KINDS),
    show_default=True,
    metavar="A,B",
    help="Kinds of campaigns; also: crowd (three to six effects at once), changed (recorded twice).",
)
@click.option(
    "--laws",
    callback=_names,
    default="lugre",
    show_default=True,
    metavar="A,B",
    help="Friction laws of the plants: lugre, maxwell, dahl, elasto_plastic, coulomb.",
)
@click.option(
    "--axes",
    callback=_names,
    default="phase",
    show_default=True,
    metavar="A,B",
    help="Axes: phase (three phase currents), q_linear, q_rotary (q-current only).",
)
@click.option(
    "--rates",
    callback=_numbers,
    default="1000",
    show_default=True,
    metavar="HZ,HZ",
    help="Logging rates: 250, 500, 1000, 2000, 4000 Hz.",
)
@click.option(
    "--encoders",
    callback=_metres,
    metavar="LOW,HIGH",
    help="Range of the encoders' resolution in um, such as 0.1,10 [all 0.1].",
)
@JOBS
@json_option
@verbosity_options
@debug_option
def make(
    count: int,
    out: Path | None,
    keys: Path | None,
    jobs: int,
    json_output: bool,
    quiet: bool,
    verbose: bool,
    **plan: Any,
) -> None:
    """Make campaigns that hide one effect, two, none, one outside the library, or a crowd of three to six.

    Those of the kind `changed` are recorded twice: as commissioned, and later, when parameters have changed, an effect
    has come, or nothing has.

    \b
    Example:
      linid challenge make --count 20 --seed 7 --effects cogging,cable_force --kinds single,none --out proof
    """
    from linid.challenge.make import Plan
    from linid.workflow.commands.challenge import make as work

    reporter = make_reporter({"quiet": quiet, "verbose": verbose})
    print_outcome(work(Plan(**plan), count, out, reporter, keys=keys, jobs=jobs), json_output)


@challenge.command()
@FOLDER
@JOBS
@click.option("--resume", is_flag=True, help="Keep the results that are there, diagnose the rest.")
@json_option
@verbosity_options
@debug_option
def run(folder: Path, json_output: bool, quiet: bool, verbose: bool, **options: Any) -> None:
    """Diagnose every campaign of a challenge, without its keys.

    \b
    Example:
      linid challenge run proof
    """
    from linid.workflow.commands.challenge import run as work

    print_outcome(work(folder, make_reporter({"quiet": quiet, "verbose": verbose}), **options), json_output)


@challenge.command()
@FOLDER
@KEYS
@JOBS
@click.option("--resume", is_flag=True, help="Keep what is there, do the rest.")
@json_option
@verbosity_options
@debug_option
def oracle(folder: Path, json_output: bool, quiet: bool, verbose: bool, **options: Any) -> None:
    """Fit the true effects to every campaign: how far a diagnosis that knew them would close the gap.

    \b
    Example:
      linid challenge oracle proof
    """
    from linid.workflow.commands.challenge import oracle as work

    print_outcome(work(folder, make_reporter({"quiet": quiet, "verbose": verbose}), **options), json_output)


@challenge.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR|SUBMISSION.json")
@click.option(
    "--keys", type=click.Path(path_type=Path), metavar="FILE", help="The keys [DIR/keys.yaml, or SUITE_keys.yaml]."
)
@click.option("--suite", type=click.Path(path_type=Path), metavar="SUITE", help="Suite that the submission answers.")
@click.option("--no-figures", is_flag=True, help="Write no figures.")
@json_option
@verbosity_options
@debug_option
def score(
    folder: Path, keys: Path | None, suite: Path | None, no_figures: bool, json_output: bool, quiet: bool, verbose: bool
) -> None:
    """Score the diagnoses of a challenge, or a submission to a suite, against the keys.

    A submission is a JSON file; its score is printed and nothing is written.

    \b
    Examples:
      linid challenge score proof
      linid challenge score submission.json --suite suite --keys suite_keys.yaml
    """
    from linid.workflow.commands import challenge as proof
    from linid.workflow.commands import suite as entry

    reporter = make_reporter({"quiet": quiet, "verbose": verbose})
    if suite is not None or folder.is_file():
        outcome = entry.score_submission(folder, reporter, suite=suite, keys=keys)
    else:
        outcome = proof.score(folder, reporter, keys=keys, figures=not no_figures)
    print_outcome(outcome, json_output)


@challenge.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="SUITE")
@click.option("--size", type=click.IntRange(min=1), metavar="N", help="How many campaigns in all [60].")
@click.option("--seed", type=click.IntRange(min=0), help="Seed of everything random [2026].")
@click.option("--groups", callback=_names, metavar="A,B", help="Groups of campaigns [all].")
@click.option("--keys", type=click.Path(path_type=Path), metavar="FILE", help="Where the keys go [SUITE_keys.yaml].")
@click.option("--secret-seed", is_flag=True, help="Keep the seed with the keys: whoever knows it can make them again.")
@JOBS
@json_option
@verbosity_options
@debug_option
def export(folder: Path, json_output: bool, quiet: bool, verbose: bool, **options: Any) -> None:
    """Write a fixed suite of campaigns that others can enter, and, beside it, the keys.

    Groups: single, pairs, crowds (four effects), outside (causes outside the library), laws (other friction laws),
    coarse (coarse encoders), none. The suite's README.md says what entrants hand in.

    \b
    Example:
      linid challenge export suite --keys sealed/suite_keys.yaml
    """
    from linid.workflow.commands.suite import export as work

    print_outcome(work(folder, make_reporter({"quiet": quiet, "verbose": verbose}), **options), json_output)


@challenge.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="SUITE")
@click.option("--out", type=click.Path(path_type=Path), required=True, metavar="FILE", help="The submission (JSON).")
@JOBS
@click.option("--resume", is_flag=True, help="Keep the diagnoses that are there, do the rest.")
@json_option
@verbosity_options
@debug_option
def answer(folder: Path, out: Path, json_output: bool, quiet: bool, verbose: bool, **options: Any) -> None:
    """Enter a suite with linid's own diagnoses: all campaigns, as one submission.

    \b
    Example:
      linid challenge answer suite --out linid.json --jobs 2
    """
    from linid.workflow.commands.suite import answer as work

    print_outcome(work(folder, out, make_reporter({"quiet": quiet, "verbose": verbose}), **options), json_output)
