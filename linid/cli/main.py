"""The command line: parse, call, print. No physics here; heavy modules load inside the commands."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import Any

import click

from linid.cli.challenge import challenge
from linid.cli.compile import compile_kernels
from linid.cli.completion import completion
from linid.cli.console import make_reporter, print_outcome
from linid.cli.diagnosis import diagnosis_options
from linid.cli.errors import Group
from linid.cli.export import export
from linid.cli.field import field
from linid.cli.files import FILES
from linid.cli.monitor import monitor
from linid.cli.options import (
    CONTROLLER,
    MotorName,
    debug_option,
    figures_options,
    fit_options,
    json_option,
    make_request,
    run_options,
    scheduler_option,
    schema_option,
    settings_options,
    start_option,
    verbosity_options,
)
from linid.cli.program import run_program
from linid.threads import load_with_one_thread

COLLECT_AFTER = 50_000  # new objects: modules and compiled code live on, and looking through them is a tenth of a start

MODEL = click.argument("model", type=click.Path(path_type=Path), metavar="MODEL.json")


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="linid")
def cli() -> None:
    """Identify friction and motor parameters of an axis from its drive's scope recordings.

    Start with `linid inspect` on one scope export. FILE is a recording (scope export) or a campaign: a YAML file that
    lists recordings and says which are fitted and which only judge the result. MODEL.json is the parameters.json that
    a fit has written. Results go to files and stdout, progress to stderr.

    Exit codes: 0 done, 1 internal error, 2 usage, 3 configuration, 4 bad data, 5 finished but not converged,
    6 `monitor`: something has changed, 130 interrupted by Ctrl-C, 143 terminated by SIGTERM (state saved).
    """
    gc.set_threshold(COLLECT_AFTER)
    load_with_one_thread()


@cli.command(short_help="Show what is understood of a recording or campaign.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--channels", type=click.Path(path_type=Path), metavar="YAML", help="Read with this column mapping.")
@click.option("--axis", type=click.Choice(["linear", "rotary"]), help="Kind of axis [by the position's unit].")
@click.option(
    "--mapping", type=click.Path(path_type=Path), metavar="YAML", help="Write the starter mapping here [print it]."
)
@click.option("--plot", type=click.Path(path_type=Path), metavar="PNG", help="Draw every channel as it was understood.")
@click.option(
    "--campaign",
    type=click.Path(path_type=Path),
    metavar="YAML",
    help="Of a folder of recordings: write the proposed campaign here [print it].",
)
@click.option("--overwrite", is_flag=True, help="Replace files that this command has written.")
@json_option
@debug_option
def inspect(file: Path, json_output: bool, **options: Any) -> None:
    """Show what is understood of a recording: layout, rate, columns, units, and what is still missing.

    Also writes a starter mapping, a YAML file that says which column is what and in which unit; correct its lines
    marked TODO and look again with --channels. Of a campaign all recordings are listed; for a folder of recordings a
    campaign is proposed: kinds, repeats, and what is held out. Exit code 4: not yet usable.

    \b
    Examples:
      linid inspect export.csv --mapping mapping.yaml
      linid inspect export.csv --channels mapping.yaml --plot export.png
      linid inspect recordings --campaign recordings/campaign.yaml
      linid inspect campaign.yaml
    """
    from linid.workflow.commands.inspect import inspect_path

    print_outcome(inspect_path(file, **options), json_output)


@cli.command("fit-friction", short_help="Identify friction and mass.")
@FILES
@start_option("first values from the recordings")
@settings_options
@fit_options
@run_options
def fit_friction(files: tuple[Path, ...], friction: Path | None, json_output: bool, **options: Any) -> None:
    """Identify friction (and the mass) from free wheels, or from runs with a logged q-current or command.

    A free wheel is a recording of the axis coasting to rest with the drive off.

    \b
    Examples:
      linid fit-friction campaign.yaml
      linid fit-friction push_1.csv push_2.csv --added-mass push_2.csv=0.5
      linid fit-friction run.csv --known force_constant=35.2 --effect constant_force
    """
    from linid.workflow.commands.fit_friction import fit_friction as run

    reporter = make_reporter(options)
    print_outcome(run(make_request(files, options), reporter, friction=friction), json_output)


@cli.command("fit-motor", short_help="Identify the motor, and friction with it.")
@FILES
@click.option("--model", required=True, type=MotorName(), help="Motor model.")
@start_option("the free wheels among FILE are fitted first")
@click.option(
    "--input",
    "driven_by",
    type=click.Choice(["current", "voltage"]),
    default="current",
    show_default=True,
    help="voltage: identify the windings too, from phase voltages beside the currents.",
)
@click.option(
    "--connection",
    type=click.Choice(["star", "separate"]),
    default="star",
    show_default=True,
    help="Of the windings, with --input voltage.",
)
@settings_options
@fit_options
@run_options
def fit_motor(
    files: tuple[Path, ...],
    model: Any,
    friction: Path | None,
    driven_by: str,
    connection: str,
    json_output: bool,
    **options: Any,
) -> None:
    """Identify the motor, and friction again with it.

    sine and theta need three phase currents (theta also knows the harmonics of the field), force needs one q-current
    or command. With --input voltage the windings' resistance and inductance are identified too, and the back-EMF,
    which is the force constant in other units, sharpens the motor's.

    \b
    Examples:
      linid fit-motor --model theta campaign.yaml
      linid fit-motor --model sine --input voltage campaign.yaml
      linid fit-motor --model sine --friction friction/parameters.json moves_1.csv moves_2.csv
      linid fit-motor --model theta --effect learned --friction diagnosis/model_after.json campaign.yaml
    """
    from linid.workflow.commands.fit_motor import fit_motor as run

    reporter = make_reporter(options)
    winding = connection if driven_by == "voltage" else ""
    request = make_request(files, options)
    print_outcome(run(request, reporter, model=model, friction=friction, winding=winding), json_output)


@cli.command(short_help="Run a model freely over recordings.")
@MODEL
@FILES
@click.option("--start-position", type=float, metavar="M", help="Start position, m or rad [measured].")
@click.option("--start-speed", type=float, metavar="M/S", help="Start speed, m/s or rad/s [measured].")
@click.option(
    "--input",
    "driven_by",
    type=click.Choice(["current", "voltage"]),
    default="current",
    show_default=True,
    help="voltage: by the recorded phase voltages, with a model that knows its windings.",
)
@CONTROLLER
@settings_options
@run_options
def simulate(
    model: Path,
    files: tuple[Path, ...],
    start_position: float | None,
    start_speed: float | None,
    driven_by: str,
    controller: Path | None,
    json_output: bool,
    **options: Any,
) -> None:
    """Run a model freely over recordings: simulations as CSV, and figures.

    The model is started once and then sees only the recorded inputs. Driven axes have no spring: such a run drifts or
    loses step sooner or later, with the best of models; `linid validate` measures what is fair. Free wheels of which
    the start speed is not given start at the speed that fits the recording best.

    With --controller the model runs in the loops of its drive, as the axis does on the machine: the positions of FILE
    are commanded, and commanded against reached position, following error and current come out.

    \b
    Examples:
      linid simulate motor/parameters.json moves_3.csv
      linid simulate --input voltage motor/parameters.json moves_3.csv
      linid simulate --controller controller.yaml motor/parameters.json reference.csv
    """
    from linid.workflow.commands.simulate import StartState
    from linid.workflow.commands.simulate import simulate as run

    reporter = make_reporter(options)
    start = StartState(start_position, start_speed)
    by_voltage = driven_by == "voltage"
    request = make_request(files, options)
    found = run(request, reporter, model=model, start=start, by_voltage=by_voltage, controller=controller)
    print_outcome(found, json_output)


@cli.command(short_help="Measure the gap between a model and recordings.")
@MODEL
@FILES
@click.option(
    "--split",
    type=click.Choice(["auto", "held_out", "fit", "all"]),
    default="auto",
    show_default=True,
    help="Which recordings; auto: the held-out ones where there are any, else all.",
)
@CONTROLLER
@settings_options
@run_options
def validate(
    model: Path, files: tuple[Path, ...], split: Any, controller: Path | None, json_output: bool, **options: Any
) -> None:
    """Measure the gap between a model and recordings that it need not have seen.

    Three measures, each beside the floor that measurement noise (and scatter of declared repeats) sets: the free run,
    the prediction 0.1 s ahead, and the force that is missing in the balance. At the floor nothing is left to explain.
    With --controller the model also follows the references that were logged, beside how the machine did.

    \b
    Example:
      linid validate motor/parameters.json campaign.yaml
    """
    from linid.workflow.commands.validate import validate as run

    reporter = make_reporter(options)
    found = run(make_request(files, options), reporter, model=model, split=split, controller=controller)
    print_outcome(found, json_output)


@cli.command(short_help="Find the effect that a simulation lacks.")
@FILES
@diagnosis_options
@settings_options
@run_options
@scheduler_option
def diagnose(
    files: tuple[Path, ...],
    model: Any,
    simulator: str | None,
    controller: Path | None,
    json_output: bool,
    **options: Any,
) -> None:
    """Say where the simulation differs from the machine, which effect is missing, and how far the gap shrinks with it.

    The campaign's `fit` recordings identify base model and effects, its `held_out` ones judge. The verdict is a budget:
    every effect with evidence, its share of the gap, and what stays unexplained (`none`, `explained`, `partly
    explained`, `unknown`); report.html in the run folder shows it. Effects given by --effect belong to the base. With
    --since the base is an earlier model, which moves no further than its own intervals; changes of its mass, Coulomb
    and viscous friction and force constant are candidates beside the effects. --simulator recorded: the base is what
    reproduces a simulation of your own, whose positions the campaign names (`simulated:`).

    What the effects cost in following error, and what the feed-forward of `linid export --to twincat` would save, is
    simulated in the loops of --controller.

    \b
    Example:
      linid diagnose campaign.yaml
    """
    from linid.workflow.commands.diagnose import diagnose as run

    reporter = make_reporter(options)
    request = make_request(files, options)
    found = run(request, reporter, model=model, simulator=simulator, controller=controller)
    print_outcome(found, json_output)


@cli.command(short_help="Run many jobs described in YAML.")
@click.argument("configs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="CONFIG.yaml...")
@click.option(
    "--set", "assignments", multiple=True, metavar="KEY=VALUE", help="Set a settings key in all jobs; repeatable."
)
@click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Seed of all jobs.")
@figures_options
@schema_option
@run_options
@scheduler_option
def batch(configs: tuple[Path, ...], json_output: bool, **options: Any) -> None:
    """Run the jobs of batch files; a failing job does not stop those that do not need its result.

    configs/template.yaml explains every key of a batch file. The exit code is the gravest of the jobs.

    \b
    Example:
      linid batch configs/stand.yaml
      linid batch fleet.yaml --scheduler tcp://10.0.0.5:8786 --out /shared/fleet
    """
    from linid.cli.options import overrides
    from linid.workflow.batch.run import run_batch
    from linid.workflow.run.request import Request

    reporter = make_reporter(options)
    names = ("out", "overwrite", "resume", "jobs", "scheduler", "dry_run")
    request = Request(files=configs, **{name: options[name] for name in names})
    print_outcome(run_batch(request, reporter, overrides=overrides(options)), json_output)


@cli.command(short_help="Generate recordings of a described axis.")
@click.argument("axis", type=click.Path(path_type=Path), metavar="AXIS.yaml")
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=1,
    show_default=True,
    metavar="N",
    help="Seed of the measurement noise.",
)
@click.option(
    "--layout",
    type=click.Choice(["generic", "twincat", "elmo", "controldesk"]),
    default="generic",
    show_default=True,
    help="Layout of the scope exports.",
)
@click.option("--decimal-mark", type=click.Choice([".", ","]), default=".", show_default=True, help="Decimal mark.")
@click.option("--only", multiple=True, metavar="NAME", help="Generate this recording only; repeatable.")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="Folder [a fresh dated one].")
@click.option("--overwrite", is_flag=True, help="Replace existing files.")
@click.option("--dry-run", is_flag=True, help="Say what would be done and write nothing.")
@json_option
@verbosity_options
@debug_option
def generate(axis: Path, json_output: bool, quiet: bool, verbose: bool, **options: Any) -> None:
    """Generate the scope recordings of an axis described in YAML, with campaign.yaml and the true parameters.

    \b
    Example:
      linid generate configs/stand_axis.yaml --seed 7 --out my_stand
    """
    from linid.workflow.commands.generate import generate_campaign

    reporter = make_reporter({"quiet": quiet, "verbose": verbose})
    out = options.pop("out")
    print_outcome(generate_campaign(axis, out, reporter, **options), json_output)


@cli.command(short_help="List the effects that fits can identify too.")
@click.argument("name", required=False)
@json_option
@debug_option
def effects(name: str | None, json_output: bool) -> None:
    """List the effects beyond friction and motor that fits can identify too (--effect NAME), or explain one.

    --effect "NAME: FORMULA" is a term of your own, a force in N (rotary: N m), of t, T (of the campaign), y, v, F (of
    the motor), acceleration, stribeck, travel and since_reversal, rest and slid, powers, abs, sign, sin, cos, exp, log,
    sqrt, tanh, min, max, pi, spline, spline2, periodic, and parameters to be identified, all other names. A product
    with sign(v) is friction; with stribeck as a further factor it rises towards breakaway as the axis' own does.
    --effect learned is the term that the recordings ask for, of a diagnosis' model or sought anew.

    \b
    Examples:
      linid effects
      linid effects constant_force
      linid effects "my_drag: -c * v * abs(v)"
    """
    from linid.workflow.commands.effects import list_effects

    print_outcome(list_effects(name), json_output)


for command in (challenge, field, export, monitor, compile_kernels, completion):
    cli.add_command(command)


def main() -> None:
    """Entry point of the `linid` program."""
    run_program(cli)


if __name__ == "__main__":
    main()
