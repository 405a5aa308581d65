"""`linid field`: a motor from its dimensions."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from linid.cli.console import make_reporter, print_outcome
from linid.cli.options import debug_option, json_option, verbosity_options

if TYPE_CHECKING:
    from linid.workflow.run.outcome import Outcome
    from linid.workflow.run.reporter import Reporter


def _numbers(count: int) -> Any:
    """A callback that turns `20,12,4` into numbers."""

    def parse(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, ...] | None:
        if value is None:
            return None
        try:
            found = tuple(float(part) for part in value.split(","))
        except ValueError:
            found = ()
        if len(found) != count:
            example = ",".join(("24", "10", "4")[:count])
            raise click.BadParameter(f"found {value!r}, expected {count} numbers such as {example}")
        return found

    return parse


@click.command(short_help="Derive the motor from its magnets and coils.")
@click.argument("geometry", required=False, type=click.Path(path_type=Path), metavar="[GEOMETRY.yaml]")
@click.option(
    "--magnet",
    callback=_numbers(3),
    metavar="X,Y,Z",
    help="Bar magnet in mm: across the guideway, along it, through its thickness.",
)
@click.option("--remanence", type=float, metavar="T", help="Remanence of the magnets.")
@click.option("--gap", type=float, metavar="MM", help="Air gap between facing magnets.")
@click.option("--pitch", type=float, metavar="MM", help="Pole pitch.")
@click.option("--coil", callback=_numbers(2), metavar="X,Y", help="Winding in mm: across the guideway, along it.")
@click.option("--turns", type=int, metavar="N", help="Turns of a winding.")
@click.option("--phase-spacing", type=float, metavar="MM", help="Distance of neighbouring windings.")
@click.option("--k", type=float, metavar="K", help="Judge the sine model at this k [the motor's own].")
@click.option(
    "--model",
    type=click.Path(path_type=Path),
    metavar="MODEL.json",
    help="Sine or theta model of a fit, to be laid beside the dimensions.",
)
@click.option(
    "--friction",
    type=click.Path(path_type=Path),
    metavar="MODEL.json",
    help="Take friction and mass from this model, for a model that can be simulated.",
)
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="Folder [a fresh dated one].")
@click.option("--overwrite", is_flag=True, help="Replace an earlier run in the --out folder.")
@click.option("--no-figures", is_flag=True, help="Write no figures.")
@click.option("--dry-run", is_flag=True, help="Check everything and write nothing.")
@json_option
@verbosity_options
@debug_option
def field(geometry: Path | None, json_output: bool, quiet: bool, verbose: bool, **given: Any) -> None:
    """Derive the motor from its magnets and coils: field, force constants, model, and whether a sine will do.

    The dimensions stand in a YAML file (configs/motor_geometry.yaml explains its keys), or are given by options, which
    override the file. With mass and friction there it writes models that `linid simulate` runs. With --model a fit is
    laid beside the dimensions. Without any dimensions it shows the scope of the sine model over k.

    \b
    Examples:
      linid field configs/motor_geometry.yaml
      linid field configs/motor_geometry.yaml --model motor/parameters.json
      linid field --k 0.42
    """
    chosen = {each.name: given.pop(each.name) for each in fields(FieldOptions)}
    outcome = _run(geometry, FieldOptions(**chosen), given, make_reporter({"quiet": quiet, "verbose": verbose}))
    print_outcome(outcome, json_output)


@dataclass(frozen=True)
class FieldOptions:
    """The options besides the dimensions. k: to judge the sine model at; model, friction: MODEL files."""

    k: float | None
    model: Path | None
    friction: Path | None
    out: Path | None
    overwrite: bool
    no_figures: bool
    dry_run: bool


def _run(geometry: Path | None, options: FieldOptions, sizes: dict[str, Any], reporter: Reporter) -> Outcome:
    """Hand the dimensions, of the file and of the options above it, to the workflow."""
    from linid.interface.settings import Settings
    from linid.workflow.commands.field import field as run
    from linid.workflow.commands.geometry_file import read_geometry
    from linid.workflow.run.request import Request

    described = read_geometry(geometry, sizes)
    request = Request(
        files=() if geometry is None else (geometry,),
        settings=Settings(figures="none" if options.no_figures else "all"),
        out=options.out,
        overwrite=options.overwrite,
        dry_run=options.dry_run,
    )
    return run(request, reporter, geometry=described, k=options.k, model=options.model, friction=options.friction)
