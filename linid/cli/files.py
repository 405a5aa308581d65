"""The argument FILE... of the commands that take recordings, and what is said where none is given."""

from __future__ import annotations

from pathlib import Path

import click

from linid.errors import UsageError

# What a command needs: recordings in words, and the arguments before them in an example.
_NEEDS = {
    "fit-friction": ("free wheels (the axis coasting to rest with the drive off), or driven runs with a q-current", ""),
    "fit-motor": (
        "driven runs with position and phase currents (force: a q-current), best with free wheels beside them",
        "--model theta ",
    ),
    "simulate": ("recordings whose inputs drive the model", "motor/parameters.json "),
    "validate": ("recordings that the fit has not seen", "motor/parameters.json "),
    "diagnose": ("free wheels, and driven runs with position and currents, each kind more than once", ""),
}


def _given(ctx: click.Context, parameter: click.Parameter, files: tuple[Path, ...]) -> tuple[Path, ...]:
    """The files; raises UsageError, which says what to give, where there is none."""
    if files or ctx.resilient_parsing:
        return files
    name = str(ctx.command.name)
    what, arguments = _NEEDS[name]
    raise UsageError(
        f"linid {name}",
        "no FILE is given",
        f"Give {what}, as scope exports, or a campaign that lists them: `linid {name} {arguments}campaign.yaml`. "
        "`linid inspect FOLDER --campaign campaign.yaml` writes one for a folder of exports; "
        "data/stand/campaign.yaml is an example.",
    )


FILES = click.argument(
    "files", nargs=-1, required=False, type=click.Path(path_type=Path), metavar="FILE...", callback=_given
)
