"""What has changed since commissioning: `python -m tests.benchmarks.changed FOLDER [--make N --seed S] [--jobs J]`.

Makes axes in FOLDER (those there are kept), fits each as it was commissioned, and diagnoses its later recordings
against that model. Prints what was named of each, and how often the first name is a cause, other names are none, and
an axis that is what it was is called so.
--base mujoco or fmu: the model is exported to that simulator, which runs the later recordings, and these are diagnosed
against its motions alone, as against a simulator that nobody here has written. Open-loop runs of a motor by its
phase currents lose step, so --axes q_linear is what a simulator says most of.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from linid.challenge.changed import make_changed
from linid.challenge.files import CAMPAIGN_FILE, write_hidden_campaign
from linid.challenge.hidden_axis import AXES
from linid.challenge.run import in_processes
from linid.export.target import Exported

if TYPE_CHECKING:
    from linid.api import Campaign, Fit
    from linid.challenge.hidden_axis import AxisKind

KEY, MODEL = "key.json", "commissioned.json"
BASES = ("linid", "mujoco", "fmu")
COMMISSIONED, LATER = "commissioned", "later"
# Which parameter an effect stands for where it acts in every recording.
MEANS = {
    "friction_level_change": "coulomb_force",
    "payload_change": "mass",
    "force_constant_change": "force_constant",
    "viscous_friction_change": "viscous_friction",
}


def make_one(folder: Path, seed: int, index: int, axes: tuple[AxisKind, ...]) -> tuple[str, float]:
    """Write one axis, twice recorded, with its key."""
    name = f"axis_{index + 1:04d}"
    if not (folder / name / KEY).exists():
        made = make_changed(seed, index, axes)
        write_hidden_campaign(made.commissioned, folder / name / COMMISSIONED, fresh=False)
        write_hidden_campaign(made.later, folder / name / LATER, fresh=False)
        key = {"scenario": made.scenario, "causes": made.causes, "factors": made.factors}
        motor = made.later.description
        key["motor"] = motor.motor.kind if motor.kind == "phase" else "force"
        (folder / name / KEY).write_text(json.dumps(key, indent=1), encoding="utf-8")
    return name, 0.0


def answer_of(base: str) -> str:
    """The file of a diagnosis against a base."""
    return "answer.json" if base == "linid" else f"answer_{base}.json"


def in_mujoco(fitted: Fit, campaign: Campaign) -> Campaign:
    """The campaign with the motions beside it that MuJoCo has of the exported model."""
    import mujoco

    from linid.export.targets.mujoco import TARGET
    from linid.export.targets.mujoco.run_axis import run
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
    from linid.export.targets.fmu import TARGET

    for name, content in TARGET.files(Exported(fitted.result, "axis", recordings=campaign.recordings)).items():
        (folder / name).write_bytes(content)
    return linid.simulated_by(campaign, folder / "axis_fmi3.fmu")


def answer_one(folder: Path, name: str, base: str) -> tuple[str, float]:
    """Fit the commissioned model and diagnose against it, or its export (what there is already is kept)."""
    import linid
    from linid.identification.model_file import model_to_text

    place = folder / name
    key = json.loads((place / KEY).read_text(encoding="utf-8"))
    (before,) = (place / COMMISSIONED).glob(f"*/{CAMPAIGN_FILE}")
    (after,) = (place / LATER).glob(f"*/{CAMPAIGN_FILE}")
    if not (place / MODEL).exists():
        fitted = linid.fit(linid.read(before), key["motor"])
        (place / MODEL).write_text(model_to_text(fitted.result), encoding="utf-8")
    begun = perf_counter()
    if not (place / answer_of(base)).exists():
        model, later = linid.load(place / MODEL), linid.read(after)
        if base == "linid":
            found = linid.diagnose(later, since=model)
        else:
            run = in_mujoco(model, later) if base == "mujoco" else in_unit(model, later, place)
            found = linid.diagnose(run, key["motor"], simulated=True)
        (place / answer_of(base)).write_text(json.dumps(found.to_dict(), allow_nan=False), encoding="utf-8")
    return name, perf_counter() - begun


def named(answer: dict[str, object]) -> list[str]:
    """Causes in the order of their shares; changed parameters by their own names."""
    names = [str(name).partition(":")[0] for name in answer["verdict"]["effects"]]  # type: ignore[index]
    return [MEANS.get(name, name) for name in names]


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
    axes = tuple(options.axes.split(","))
    made = [(options.folder, options.seed, index, axes) for index in range(options.make)]
    for _ in in_processes(make_one, made, options.jobs):
        pass
    names = sorted(path.parent.name for path in options.folder.glob(f"*/{KEY}"))
    first = wrong = alarms = quiet = causes = said = found = 0
    tasks = [(options.folder, name, options.base) for name in names]
    for name, seconds in in_processes(answer_one, tasks, options.jobs):
        key = json.loads((options.folder / name / KEY).read_text(encoding="utf-8"))
        answer = json.loads((options.folder / name / answer_of(options.base)).read_text(encoding="utf-8"))
        said_names, true = named(answer), list(key["causes"])
        if true:
            causes += 1
            first += bool(said_names) and said_names[0] in true
            found += len(set(said_names) & set(true))
        else:
            quiet += 1
            alarms += bool(said_names)
        said += len(said_names)
        wrong += len([one for one in said_names if one not in true])
        factors = ", ".join(f"{k} x {x:.3f}" for k, x in key["factors"].items())
        status = answer["verdict"]["status"]
        print(
            f"{name} {key['scenario']}: {'+'.join(true) or '-'} ({factors}) -> {status}, {'+'.join(said_names) or '-'} "
            f"[{seconds:.0f} s]",
            flush=True,
        )
    print(f"cause named first {first} of {causes}; wrong {wrong} of {said} names; falsely alarmed {alarms} of {quiet}")


if __name__ == "__main__":
    main()
