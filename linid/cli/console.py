"""What a command says: progress on stderr, its outcome on stdout."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from linid.workflow.run.outcome import Outcome
    from linid.workflow.run.reporter import Reporter


def make_reporter(options: dict[str, Any]) -> Reporter:
    """Progress as loud as asked for."""
    from linid.workflow.run.reporter import Reporter

    verbosity = -1 if options.get("quiet") else int(bool(options.get("verbose")))
    as_json = click.get_current_context().params.get("json_output", False)
    return Reporter(verbosity, on_result=None if as_json else _show_early)


def _show_early(outcome: Outcome) -> Outcome:
    """Tables on stdout before the figures are drawn; a summary as JSON waits, an error would be a second one."""
    from linid.workflow.run.show import show

    show(outcome, as_json=False)
    return replace(outcome, shown=True)


def print_outcome(outcome: Any, json_output: bool) -> None:
    """Tables (or the summary as JSON) on stdout; exit with the outcome's code."""
    from linid.workflow.run.show import show

    if not outcome.shown:
        show(outcome, json_output)
    if outcome.exit_code:
        click.get_current_context().exit(outcome.exit_code)
