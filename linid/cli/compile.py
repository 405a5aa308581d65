"""The command `compile`."""

from __future__ import annotations

from functools import partial

import click

from linid.cli.console import make_reporter
from linid.cli.options import debug_option, verbosity_options


@click.command("compile", short_help="Compile the simulation now, once per machine.")
@verbosity_options
@debug_option
def compile_kernels(quiet: bool, verbose: bool) -> None:
    """Compile the whole simulation for this machine's processor, so that no later command waits for it.

    What is compiled already, when linid was installed or later, is left as it is. It is kept in LINID_CACHE_DIR,
    else in the user's cache.

    \b
    Example:
      LINID_CACHE_DIR=/opt/linid linid compile        (when an image is built)
    """
    from linid.simulation.compile_ahead import ALL, Compilation

    with make_reporter({"quiet": quiet, "verbose": verbose}) as reporter:
        Compilation(ALL).finish(partial(reporter.step, "compile the simulation"))
