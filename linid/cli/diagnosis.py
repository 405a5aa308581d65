"""The options of `linid diagnose` that no other command has."""

from __future__ import annotations

from pathlib import Path

import click

from linid.cli.options import MotorName, apply_options, model_options

diagnosis_options = apply_options(
    [
        click.option(
            "--model", type=MotorName("friction"), help="Base model [sine with phase currents, force with one input]."
        ),
        click.option(
            "--simulator",
            "--since",
            "simulator",
            metavar="MODEL.json|recorded|UNIT.fmu",
            help="Base: this model as it stands, an FMU, or (recorded) the simulation that the recordings have beside "
            "them.",
        ),
        click.option(
            "--controller",
            type=click.Path(path_type=Path),
            metavar="CONTROLLER.yaml",
            help="The drive's loops, as configs/controller.yaml describes them, for what a feed-forward would save "
            "[linid's default, suited to the axis].",
        ),
        model_options,
    ]
)
