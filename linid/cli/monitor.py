"""The command `monitor`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from linid.cli.console import make_reporter, print_outcome
from linid.cli.options import make_request, run_options, scheduler_option, settings_options


@click.command(short_help="Say what has changed since a model, over many recordings.")
@click.argument("model", type=click.Path(path_type=Path), metavar="MODEL.json")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="CAMPAIGN.yaml...")
@settings_options
@run_options
@scheduler_option
def monitor(model: Path, files: tuple[Path, ...], json_output: bool, **options: Any) -> None:
    """Lay campaigns of one machine over time beside the model of its commissioning.

    Each campaign is diagnosed against the model as it stands (`linid diagnose --since`), in the order of their
    `recorded:` days, else as given. One table and one page show what has changed, with intervals: parameters, effects
    with their shares of the gap, and errors. Exit code 6 where anything has; the last campaign that could be read
    decides.

    \b
    Example:
      linid monitor commissioned/parameters.json may/campaign.yaml november/campaign.yaml --out health
    """
    from linid.workflow.commands.monitor import monitor as run

    reporter = make_reporter(options)
    print_outcome(run(make_request(files, options), reporter, model=model), json_output)
