"""An FMU as the user's simulation: it runs as it should, and whatever it does else is an error with a name."""

from __future__ import annotations

import json
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from linid.api import refit_unit, simulated_by
from linid.cli.main import cli
from linid.errors import ConfigError, DataError, UsageError
from linid.export.target import Exported
from linid.export.targets.fmu.target import TARGET
from linid.interface.campaign import Campaign
from linid.report.files import write_atomic
from tests.diagnosis import machine
from tests.diagnosis.test_foreign import HEAVIER, SPEEDS
from tests.export.compiler import CC, needs_compiler
from tests.workflow.test_monitor import write_campaign

pytest.importorskip("fmpy", reason='needs the extra: pip install "linid[fmu]"')
pytestmark = needs_compiler


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The machine's true model as a unit."""
    name, content = next(
        (k, x) for k, x in TARGET.files(Exported(machine.result(), "axis", 1e-3)).items() if "fmi2" in k
    )
    return write_atomic(tmp_path_factory.mktemp("unit") / name, content)


def exact() -> Campaign:
    """Two recordings of the machine without noise."""
    out = []
    for k, speed in enumerate(SPEEDS[:2], 1):
        one = machine.recording(f"run_{k}", duration=1.0)
        out.append(replace(one, y=machine.position(one.t, v0=speed)))
    return Campaign.of(out)


def described(folder: Path, unit: Path, more: str) -> Path:
    path = folder / "unit.yaml"
    path.write_text(f"file: {unit}\n{more}\n", encoding="utf-8")
    return path


def test_a_unit_moves_as_the_machine_that_it_is_of(unit: Path, tmp_path: Path) -> None:
    campaign = exact()
    found = simulated_by(campaign, unit)
    for one in found.recordings:
        assert one.simulated is not None
        # Inputs that a unit holds lag half a period behind: K dI/dt dt/2 / m, twice integrated.
        lag = machine.K * machine.SWING * machine.OMEGA * 0.5 * machine.PERIOD / machine.MASS * 0.5 * one.duration**2
        np.testing.assert_allclose(one.simulated, one.y, atol=2.0 * lag)
    # In millimetres, by other names: the same.
    scaled = described(tmp_path, unit, "position_scale: 1.0\nparameters: {mass: 1.0e3}\nstep_s: 5.0e-4")
    heavy = simulated_by(campaign, scaled).recordings[0]
    assert heavy.simulated is not None
    straight = SPEEDS[0] * heavy.t
    np.testing.assert_allclose(heavy.simulated, straight, atol=0.02)  # 6 N on a ton


def test_what_a_unit_lacks_is_named(unit: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"has no variable angle.*position"):
        simulated_by(exact(), described(tmp_path, unit, "position: angle"))
    with pytest.raises(UsageError, match="has no variable i_q"):
        simulated_by(exact(), described(tmp_path, unit, "inputs: {drive: i_q}"))
    with pytest.raises(UsageError, match="names no variable for drive"):
        simulated_by(exact(), described(tmp_path, unit, "inputs: {current_u: drive}"))
    with pytest.raises(UsageError, match="not found"):
        simulated_by(exact(), tmp_path / "nowhere.fmu")
    with pytest.raises(ConfigError, match="positions"):
        simulated_by(exact(), described(tmp_path, unit, "positions: angle"))


def test_a_unit_that_crashes_ends_its_own_process_alone(unit: Path, tmp_path: Path) -> None:
    (tmp_path / "crash.c").write_text(
        "#include <stdlib.h>\n__attribute__((constructor)) static void end(void) { abort(); }\n", encoding="utf-8"
    )
    library = tmp_path / "crash.so"
    subprocess.run([str(CC), "-shared", "-fPIC", "-o", str(library), str(tmp_path / "crash.c")], check=True)
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(unit) as old, zipfile.ZipFile(broken, "w") as new:
        for name in old.namelist():
            new.writestr(name, library.read_bytes() if name.startswith("binaries/") else old.read(name))
    with pytest.raises(DataError, match="run_1: crashed the process of the unit"):
        simulated_by(exact(), broken)


def test_no_number_is_an_error_and_what_came_before_is_kept(unit: Path, tmp_path: Path) -> None:
    kept: list[str] = []
    campaign = exact()
    first, second = campaign.recordings
    assert second.drive_input is not None
    endless = replace(second, drive_input=np.where(second.t < 0.5, second.drive_input, 1e200))
    with pytest.raises(DataError, match=r"run_2: (is simulated to no number|the unit .* failed)"):
        simulated_by(Campaign.of((first, endless)), unit, lambda one, y: kept.append(one.name))
    assert kept == ["run_1"]


def test_what_a_unit_has_wrong_is_told_by_the_command(unit: Path, tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path / "today", "2026-11-02", HEAVIER)
    campaign.write_text(campaign.read_text() + f"known: {{force_constant: {machine.K}}}\n", encoding="utf-8")
    out = tmp_path / "out"
    done = CliRunner().invoke(
        cli, ["diagnose", "--simulator", str(unit), str(campaign), "--out", str(out), "--no-figures", "-q"]
    )
    assert done.exit_code == 0, done.output
    assert "Changed since the given model: mass 2" in " ".join(done.output.split())
    assert len(list((out / "simulated").glob("*.csv"))) == len(SPEEDS)
    # What the page says of other programs is what an export of that model says.
    rows = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))["exports"]
    (said,) = [row["kept"] for row in rows if "urdf" in row["targets"]]
    files = [str(out / "model_after.json"), str(campaign)]
    more = ["--to", "urdf", "--base", str(out / "model_before.json"), "--out", str(tmp_path / "exported"), "-q"]
    exported = CliRunner().invoke(cli, ["export", *files, *more])
    assert exported.exit_code == 0, exported.output
    loss = json.loads((tmp_path / "exported" / "urdf" / "loss.json").read_text(encoding="utf-8"))
    assert said == {one["measure"]: [one["share"], one["low"], one["high"]] for one in loss["kept"]} and said


def test_free_parameters_of_a_unit_are_identified_with_intervals_that_hold_them(unit: Path, tmp_path: Path) -> None:
    """From 40 % off: the machine's own values, though its position is noisy and the unit's inputs are held."""
    noise = np.random.default_rng(3)
    runs = [replace(one, y=one.y + 1e-6 * noise.standard_normal(one.t.size), split="fit") for one in exact().recordings]
    campaign = Campaign.of(runs)
    text = f"parameters: {{mass: {1.4 * machine.MASS}}}\nfree: {{mass: [{0.5 * machine.MASS}, {2.0 * machine.MASS}]}}"
    file = described(tmp_path, unit, f"{text}\nstep_s: 5.0e-4")
    found = refit_unit(campaign, file)
    (mass,) = found.estimates
    assert mass.start == pytest.approx(1.4 * machine.MASS) and not mass.at_end
    assert mass.value == pytest.approx(machine.MASS, rel=0.02) and mass.low < machine.MASS < mass.high
    assert found.after < 0.2 * found.before and found.unit.free == {}
    # The unit as found simulates what it was fitted to.
    (first, *_) = simulated_by(campaign, found.unit).recordings
    (wrong, *_) = simulated_by(
        campaign, described(tmp_path, unit, f"parameters: {{mass: {1.4 * machine.MASS}}}")
    ).recordings
    assert first.simulated is not None and wrong.simulated is not None
    assert np.std(first.simulated - first.y) < 0.3 * np.std(wrong.simulated - wrong.y)


def test_ranges_that_make_no_sense_are_refused(unit: Path, tmp_path: Path) -> None:
    fitted = Campaign.of([replace(one, split="fit") for one in exact().recordings])
    with pytest.raises(ConfigError, match="low < high"):
        refit_unit(fitted, described(tmp_path, unit, "free: {mass: [2.0, 1.0]}"))
    with pytest.raises(UsageError, match="has no variable weight"):
        refit_unit(fitted, described(tmp_path, unit, "free: {weight: [1.0, 2.0]}"))
    with pytest.raises(UsageError, match="frees no parameter"):
        refit_unit(fitted, described(tmp_path, unit, ""))
    with pytest.raises(UsageError, match="no recording to be fitted"):
        held = Campaign.of([replace(one, split="held_out") for one in fitted.recordings])
        refit_unit(held, described(tmp_path, unit, "free: {mass: [1.0, 2.0]}"))


def test_a_unit_carries_the_mass_that_a_recording_does(unit: Path, tmp_path: Path) -> None:
    one = exact().recordings[0]
    laden = Campaign.of([replace(one, added_mass=machine.MASS)])
    by_recording = simulated_by(laden, unit).recordings[0].simulated
    heavy = described(tmp_path, unit, f"parameters: {{mass: {2.0 * machine.MASS}}}")
    by_parameter = simulated_by(Campaign.of([one]), heavy).recordings[0].simulated
    without = simulated_by(laden, described(tmp_path, unit, 'added_mass: ""')).recordings[0].simulated
    assert by_recording is not None and by_parameter is not None and without is not None
    np.testing.assert_allclose(by_recording, by_parameter, atol=1e-9)
    assert np.std(without - by_parameter) > 1e-4
    with pytest.raises(UsageError, match="has no variable load"):
        simulated_by(laden, described(tmp_path, unit, "added_mass: load"))
