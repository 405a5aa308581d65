"""The command `export`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from linid.cli.console import make_reporter, print_outcome
from linid.cli.options import make_request, run_options, settings_options


def _print_targets(ctx: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        from linid.export.registry import all_targets

        for target in all_targets().values():
            click.echo(f"{target.name:10} {target.purpose}")
        ctx.exit()


@click.command(short_help="Write a model in another program's form.")
@click.argument("model", type=click.Path(path_type=Path), metavar="MODEL.json")
@click.argument("files", nargs=-1, type=click.Path(path_type=Path), metavar="[FILE]...")
@click.option("--to", multiple=True, required=True, metavar="TARGET", help="Form to write; repeatable.")
@click.option(
    "--list",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_targets,
    help="List the targets and exit.",
)
@click.option("--name", metavar="WORD", help="Name of the axis in the files [that of the model's file or folder].")
@click.option(
    "--base",
    type=click.Path(path_type=Path),
    metavar="MODEL.json",
    help="Model from which the closed gap counts [the model without its effects].",
)
@settings_options
@run_options
def export(
    model: Path,
    files: tuple[Path, ...],
    to: tuple[str, ...],
    name: str | None,
    base: Path | None,
    json_output: bool,
    **options: Any,
) -> None:
    """Write an identified model in the form that another program takes, with what that form costs.

    `linid export --list` shows the targets. A form that cannot hold all effects keeps less of the gap that the model
    closes: on the held-out recordings of FILE (a campaign, or recordings) the share is measured, printed and written
    beside the files.

    \b
    Examples:
      linid export --list
      linid export motor/parameters.json --to python
      linid export diagnosis/model_after.json campaign.yaml --to python --out axis
    """
    from linid.workflow.commands.export import ExportOptions
    from linid.workflow.commands.export import export as run

    reporter = make_reporter(options)
    request = make_request(files, options)
    print_outcome(run(request, reporter, model=model, options=ExportOptions(to, name, base)), json_output)
