"""The public interface: the same numbers as the command line, in threads, in a notebook and in a script."""

from __future__ import annotations

import inspect
import json
import os
import random
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import linid
from linid.diagnosis.gap import Trace
from linid.identification.result import Estimate, FitResult
from linid.identification.settings import Hooks
from linid.interface.stages import Stage
from tests.workflow.small import ROOT, STAND, campaign
from tests.workflow.small import linid as command

SMALL = {"population": 10, "generations": 4, "least_squares_steps": 4}


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return campaign(tmp_path_factory.mktemp("api"), motor=True)


@pytest.fixture(scope="module")
def read(path: Path) -> linid.Campaign:
    return linid.read(path)


@pytest.fixture(scope="module")
def friction(read: linid.Campaign) -> linid.Fit:
    return linid.fit(read, "friction", **SMALL)


def test_public_names_are_there_and_explained() -> None:
    for name in linid.__all__:
        member = getattr(linid, name)
        assert inspect.getdoc(member), name
        if inspect.isfunction(member):
            assert "Return" in member.__doc__ or ";" in member.__doc__, name
        if inspect.isclass(member):
            public = [
                k for k, x in vars(member).items() if not k.startswith("_") and (callable(x) or isinstance(x, property))
            ]
            assert all(inspect.getdoc(getattr(member, k)) for k in public), (name, public)
    assert set(linid.__all__) <= set(dir(linid)) and linid.__version__[0].isdigit()
    assert all(inspect.getdoc(getattr(linid.plot, name)) for name in linid.plot.__all__)
    with pytest.raises(AttributeError, match="no_such"):
        linid.no_such  # noqa: B018 - what is tried


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = (
        "import sys, linid; print([m for m in ('numpy', 'numba', 'scipy', 'matplotlib', 'pandas') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.strip() == "[]", done.stderr


def test_a_campaign_shows_what_it_holds(read: linid.Campaign) -> None:
    assert [r.name for r in read.held_out] == ["freewheel_6", "sine_current_3"]
    assert len(read) == len(read.fitted) + len(read.held_out) and read["freewheel_6"].added_mass == 1.0
    assert list(read.to_frame()["split"]) == [r.split for r in read] and "freewheel_6" in read._repr_html_()
    with pytest.raises(KeyError):
        read["no_such"]


def test_fits_are_those_of_the_command_line(
    path: Path, friction: linid.Fit, read: linid.Campaign, tmp_path: Path
) -> None:
    options = [f"--{k}" if k != "least_squares_steps" else "--set" for k in SMALL]
    values = [str(v) if k != "least_squares_steps" else f"{k}={v}" for k, v in SMALL.items()]
    given = [word for pair in zip(options, values, strict=True) for word in pair]
    assert command("fit-motor", path, "--model", "sine", "--out", tmp_path / "o", "--no-figures", *given).exit_code in (
        0,
        5,
    )
    theirs = linid.load(tmp_path / "o" / "parameters.json")
    ours = linid.fit(read, "sine", start=friction, jobs=2, **SMALL)
    assert ours.to_frame().equals(theirs.to_frame())
    assert linid.fit(read, "sine", **SMALL).to_frame().equals(theirs.to_frame())  # friction first, by itself
    saved = linid.load(ours.save(tmp_path / "model.json"))
    assert saved.to_frame().equals(theirs.to_frame())
    gaps = linid.validate(ours, read, jobs=2).to_frame()
    written = {row["recording"]: row for row in json.loads((tmp_path / "o" / "gaps.json").read_text())["gaps"]}
    assert set(written) == set(gaps.index)
    for name, row in gaps.iterrows():
        assert row["free_run"] == written[name]["free_run"] and row["force"] == written[name]["force"]


def test_estimates_have_value_and_interval(friction: linid.Fit) -> None:
    mass = friction["mass"]
    assert isinstance(mass, Estimate) and mass.interval[0] < mass.value < mass.interval[1] and mass.unit == "kg"
    frame = friction.to_frame()
    assert frame.loc["mass", "high"] == mass.interval[1] and "coulomb_force" in friction.summary()
    assert "F_C" in friction._repr_html_() and friction.model == "friction"
    with pytest.raises(KeyError, match="coulomb_force"):
        friction["no_such"]


def test_four_threads_give_what_one_gives(read: linid.Campaign) -> None:
    seeds = (1, 2, 3, 4)
    before = random.getstate(), np.random.get_state()[1].copy()
    alone = [linid.fit(read, "friction", seed=seed, **SMALL).to_frame() for seed in seeds]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda seed: linid.fit(read, "friction", seed=seed, **SMALL).to_frame(), seeds))
    assert all(one.equals(two) for one, two in zip(alone, together, strict=True))
    assert random.getstate() == before[0] and np.array_equal(np.random.get_state()[1], before[1])


def test_recordings_made_in_python(friction: linid.Fit, read: linid.Campaign) -> None:
    """A simulated coast-down read back as a recording brings the parameters back that it was made with."""
    made = []
    for recording in read.recordings:
        if recording.kind == "free_wheel":
            trace = linid.simulate(friction, recording)
            assert isinstance(trace, Trace) and trace.y_simulated.shape == recording.y.shape
            made.append(
                linid.Recording(
                    recording.name,
                    recording.t,
                    trace.y_simulated,
                    kind="free_wheel",
                    split=recording.split,
                    added_mass=recording.added_mass,
                )
            )
    own = linid.Campaign.of(made, known={"mass": friction["mass"].value})
    again = linid.fit(own, "friction", **{**SMALL, "least_squares_steps": 20})
    assert again["coulomb_force"].value == pytest.approx(friction["coulomb_force"].value, rel=1e-6)
    with pytest.raises(linid.UsageError, match="same name"):
        linid.Campaign.of([made[0], made[0]])
    with pytest.raises(linid.UsageError, match="no recording"):
        linid.Campaign.of([])


def test_what_cannot_be_is_refused_with_place_fact_and_remedy(
    read: linid.Campaign, friction: linid.Fit, tmp_path: Path
) -> None:
    for wrong, error in (
        (lambda: linid.fit(read, "thetta"), linid.UsageError),
        (lambda: linid.fit(read, "sine", populaton=3), linid.ConfigError),
        (lambda: linid.fit(read, "friction", known={"no_such": 1.0}), linid.UsageError),
        (lambda: linid.read(tmp_path / "none.csv"), linid.DataError),
        (lambda: linid.load(tmp_path / "none.json"), linid.ConfigError),
        (lambda: linid.validate(friction, [read["sine_current_2"]]), linid.DataError),
        (lambda: linid.diagnose(linid.Campaign.of(read.fitted)), linid.UsageError),
        (lambda: linid.fit(read, "sine", winding="delta"), linid.UsageError),
        (lambda: linid.fit(read, "friction", winding="star"), linid.UsageError),
        (lambda: linid.simulate(friction, read["freewheel_6"], by_voltage=True), linid.UsageError),
    ):
        with pytest.raises(error) as caught:
            wrong()
        assert caught.value.place and caught.value.fact and caught.value.remedy


def test_an_observer_does_the_stages_of_a_fit(read: linid.Campaign, friction: linid.Fit) -> None:
    """It sees friction, then the motor from it; what an earlier run has found takes the place of a search."""
    seen: list[tuple[str, bool]] = []

    class Keeper:
        def stage(self, stage: Stage, work: Callable[[Hooks], FitResult]) -> FitResult:
            seen.append((stage.name, stage.task.start is None))
            return friction.result if stage.name == "friction" else work(Hooks())

    kept = linid.fit(read, "sine", observer=Keeper(), **SMALL)
    assert seen == [("friction", True), ("motor", False)]
    assert kept.to_frame().equals(linid.fit(read, "sine", start=friction, **SMALL).to_frame())


def test_a_campaign_tells_what_was_read(path: Path, read: linid.Campaign) -> None:
    assert read.files[0]["file"] == str(path) and len(read.files) == 1 + len(read)
    assert read.notes[: len(read.warnings)] == read.warnings
    assert [r.name for r in read.select(split="fit", kind="motor")] == ["sine_current_2"]


def test_bare_recordings_have_the_axis_of_the_model_they_are_read_for(friction: linid.Fit) -> None:
    turning = linid.api.Fit(replace(friction.result, axis="rotary"))
    rows = STAND / "moves_1.csv"
    assert linid.read(rows, axis_of=friction).axis == "linear"
    with pytest.raises(linid.DataError):  # its position is in mm
        linid.read(rows, axis_of=turning)


def test_free_runs_begin_where_they_are_told(friction: linid.Fit, read: linid.Campaign) -> None:
    wheel = read["freewheel_6"]
    trace = linid.simulate(friction, wheel, position=0.25, speed=0.1)
    assert trace.y_simulated[0] == 0.25 and trace.velocity_simulated[0] == 0.1
    measured = linid.simulate(friction, wheel)
    assert linid.simulate(friction, wheel, speed=0.1).y_simulated[0] == measured.y_simulated[0]


def test_what_cannot_be_measured_is_told_or_raised(friction: linid.Fit, read: linid.Campaign) -> None:
    wheel = read["freewheel_6"]
    turning = replace(wheel, name="turning", axis="rotary")
    told: list[str] = []
    gaps = linid.validate(friction, [turning, wheel], unmeasured=lambda error: told.append(error.place))
    assert [gap.recording for gap in gaps] == ["freewheel_6"] and told == ["turning"]
    with pytest.raises(linid.UsageError, match="turning"):
        linid.validate(friction, [turning, wheel])


def test_plots_take_axes_and_give_them_back(friction: linid.Fit, read: linid.Campaign) -> None:
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    assert linid.plot.friction_curve(friction, axes, top_speed=0.1) is axes
    (line,) = axes.get_lines()
    v, force = line.get_data()
    assert np.max(v) == pytest.approx(0.1)
    top = friction["coulomb_force"].value + 0.1 * friction["viscous_friction"].value
    assert force[-1] == pytest.approx(top, rel=1e-9) and force[0] == pytest.approx(-top, rel=1e-9)
    trace = linid.simulate(friction, read["freewheel_6"])
    assert (
        linid.plot.free_run(trace).get_xlabel() == "Time (s)" and linid.plot.error(trace).get_title() == "freewheel_6"
    )


@pytest.mark.slow
def test_the_script_of_the_documentation_runs(tmp_path: Path) -> None:
    """With a diagnosis: the verdict in words, and its page."""
    done = subprocess.run(
        [sys.executable, ROOT / "docs" / "first_steps.py", ROOT / "data/stand/campaign.yaml", tmp_path],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=900,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert "noise floor" in done.stdout and "moving mass" in done.stdout
    assert (tmp_path / "diagnosis.html").stat().st_size > 1e6 and (tmp_path / "friction_curve.png").exists()


@pytest.mark.slow
def test_the_notebook_of_the_documentation_runs() -> None:
    nbformat = pytest.importorskip("nbformat", reason="needs nbformat, nbclient and ipykernel (the extra `test`)")
    nbclient = pytest.importorskip("nbclient", reason="needs nbformat, nbclient and ipykernel (the extra `test`)")
    notebook = nbformat.read(ROOT / "docs" / "first_steps.ipynb", as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), "is kept without outputs"
    os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    nbclient.NotebookClient(notebook, timeout=900, resources={"metadata": {"path": str(ROOT / "docs")}}).execute()
    shown = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert sum("text/html" in output.get("data", {}) for output in shown) >= 4
    assert any("image/png" in output.get("data", {}) for output in shown)
