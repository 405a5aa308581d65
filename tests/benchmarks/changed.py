"""What is other than in a simulator: `python -m tests.benchmarks.changed FOLDER --base fmu [--make N --seed S]`.

Makes axes that are recorded twice in FOLDER (`linid challenge make --kinds changed`; a challenge that is there is
kept), fits each as it was commissioned, and exports that model to a simulator, MuJoCo or an FMU, which runs the later
recordings. These are diagnosed against its motions alone, as against a simulator that nobody here has written.
`--base linid` does what `linid challenge run` does. Prints what was named of each, and the rates of the score.
Open-loop runs of a motor by its phase currents lose step, so --axes q_linear is what a simulator says most of.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING

import numpy as np

from linid.challenge.answers import read_answer
from linid.challenge.create import make_challenge
from linid.challenge.files import CAMPAIGN_FILE, COMMISSIONED_FOLDER, DIAGNOSIS_FILE, KEYS_FILE, read_keys
from linid.challenge.hidden_axis import AXES
from linid.challenge.make import Plan
from linid.challenge.run import in_processes
from linid.challenge.score import score
from linid.export.target import Exported
from linid.workflow.commands.challenge import diagnose_with_linid

if TYPE_CHECKING:
    from linid.api import Campaign, Fit

BASES = ("linid", "mujoco", "fmu")
RATES = ("changed_first", "changed_found", "changed_wrong", "unchanged_alarms", "failed")


def in_mujoco(fitted: Fit, campaign: Campaign) -> Campaign:
    """The campaign with the motions beside it that MuJoCo has of the exported model."""
    import mujoco

    from linid.export.targets.mujoco.run_axis import run
    from linid.export.targets.mujoco.target import TARGET
    from linid.identification.signals.motion import measure_motion

    text = TARGET.files(Exported(fitted.result, "axis", recordings=campaign.recordings))["axis.xml"].decode()
    axis = mujoco.MjModel.from_xml_string(text)
    alone = float(axis.body("mover").mass[0])
    own = []
    for recording in campaign.recordings:
        inputs = [recording.drive_input] if recording.phase_currents is None else list(recording.phase_currents)
        if recording.kind == "free_wheel":
            inputs = []
        motion = measure_motion([recording])
        axis.body("mover").mass[0] = alone + recording.added_mass
        mujoco.mj_setConst(axis, mujoco.MjData(axis))  # of a single mass MuJoCo keeps the inverse
        y = run(axis, recording.t, inputs, float(motion.y[0]), float(motion.v[0]))[0]
        own.append(replace(recording, simulated=np.asarray(y)))
    return replace(campaign, recordings=tuple(own))


def in_unit(fitted: Fit, campaign: Campaign, folder: Path) -> Campaign:
    """The campaign with the motions beside it that the exported FMU has."""
    import linid
    from linid.export.targets.fmu.target import TARGET

    for name, content in TARGET.files(Exported(fitted.result, "axis", recordings=campaign.recordings)).items():
        (folder / name).write_bytes(content)
    return linid.simulated_by(campaign, folder / "axis_fmi3.fmu")


def answer_one(folder: Path, name: str, base: str) -> tuple[str, float]:
    """Fit the commissioned model and diagnose against it, or its export (what there is already is kept)."""
    import linid
    from linid.interface.stages import base_kind

    out = folder / f"results_{base}" / name
    begun = process_time()
    if not (out / DIAGNOSIS_FILE).exists():
        out.mkdir(parents=True, exist_ok=True)
        if base == "linid":
            diagnose_with_linid(folder / name / CAMPAIGN_FILE, out, 1)
        else:
            before = linid.read(folder / COMMISSIONED_FOLDER / name / CAMPAIGN_FILE)
            kind = base_kind(before.recordings)
            model, later = linid.fit(before, kind), linid.read(folder / name / CAMPAIGN_FILE)
            run = in_mujoco(model, later) if base == "mujoco" else in_unit(model, later, out)
            found = linid.diagnose(run, kind, simulated=True)
            (out / DIAGNOSIS_FILE).write_text(json.dumps(found.to_dict(), allow_nan=False), encoding="utf-8")
    return name, process_time() - begun


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--make", type=int, default=0, metavar="N")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--base", choices=BASES, default="linid")
    parser.add_argument("--axes", default="phase", help=f"kinds of axes, of {', '.join(AXES)}")
    options = parser.parse_args(arguments)
    if not (options.folder / KEYS_FILE).exists():
        plan = Plan(options.seed, kinds=("changed",), axes=tuple(options.axes.split(",")))
        make_challenge(plan, options.make, options.folder, jobs=options.jobs)
    keys = read_keys(options.folder / KEYS_FILE)
    tasks = [(options.folder, name, options.base) for name in keys]
    answers = {}
    for name, seconds in in_processes(answer_one, tasks, options.jobs):
        answers[name] = read_answer(options.folder / f"results_{options.base}" / name)
        true = [f"{cause} {told.get('factor', '')}".strip() for cause, told in keys[name].parameters.items()]
        said = "+".join(answers[name].named) or "-"
        print(f"{name} {'+'.join(true) or '-'} -> {answers[name].status}, {said} [{seconds:.0f} s]", flush=True)
    rates = score({name: keys[name] for name in answers}, answers).rates
    print("; ".join(f"{name} {rates[name].count:g} of {rates[name].total}" for name in RATES))


if __name__ == "__main__":
    main()
