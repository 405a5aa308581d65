"""batch: jobs and their dependencies, failures that stay local, sameness on any --jobs, resumption, bad files."""

from __future__ import annotations

import json
import os
import re
import signal
import time
from pathlib import Path

import pytest

from linid.workflow.batch.file import (
    BatchFile,
    DiagnoseJob,
    FieldJob,
    FitMotorJob,
    GenerateJob,
    JobSpec,
    ValidateJob,
    read_batch,
)
from linid.workflow.batch.job import JobReport, verified_settings
from linid.workflow.batch.run import JobQueue
from linid.workflow.run.reporter import Reporter
from tests.workflow.small import ROOT, campaign, children, linid, start, summary

DEFAULTS = "defaults: {population: 10, generations: 4, least_squares_steps: 4, figures: false, verify_search: false}\n"


def write(folder: Path, jobs: str, *, defaults: str = DEFAULTS) -> Path:
    path = folder / "batch.yaml"
    path.write_text(defaults + "jobs:\n" + jobs, encoding="utf-8")
    return path


def friction(name: str = "friction", files: str = "campaign.yaml", more: str = "") -> str:
    return f"  - {{name: {name}, command: fit-friction, files: [{files}]{more}}}\n"


CHECK = "  - {name: check, command: validate, files: [campaign.yaml], model: friction}\n"
CHAIN = friction() + friction("cma", more=", settings: {method: cma}") + CHECK


def test_any_number_of_jobs_gives_the_same_results(tmp_path: Path) -> None:
    campaign(tmp_path)
    path = write(tmp_path, CHAIN)
    bodies = {n: summary("batch", path, "--out", tmp_path / f"o{n}", "--jobs", n) for n in (1, 2)}
    for body in bodies.values():
        assert [job["label"] for job in body["jobs"]] == ["friction", "cma", "check"]
        assert {job["status"] for job in body["jobs"]} <= {"done", "not_converged"}
    for name in ("friction/parameters.json", "cma/parameters.json", "check/gaps.json"):
        assert (tmp_path / "o1" / name).read_bytes() == (tmp_path / "o2" / name).read_bytes()
    assert (tmp_path / "o1" / "friction" / "log.txt").read_text(encoding="utf-8")
    assert (tmp_path / "o1" / "summary.csv").read_text(encoding="utf-8").count("\n") == 4
    single = tmp_path / "single"
    options = ("--population", 10, "--generations", 4, "--set", "least_squares_steps=4", "--no-figures")
    linid("fit-friction", tmp_path / "campaign.yaml", "--out", single, *options)
    assert (single / "parameters.json").read_bytes() == (tmp_path / "o1/friction/parameters.json").read_bytes()


def test_fits_start_from_a_job_a_file_or_a_folder(tmp_path: Path) -> None:
    """All three give the same result, under the law that the job names."""
    campaign(tmp_path)
    law = ", settings: {law: dahl}"
    linid(
        "batch",
        write(tmp_path, friction() + friction("job", more=f", friction: friction{law}")),
        "--out",
        tmp_path / "o",
    )
    (tmp_path / "diagnosis").mkdir()
    (tmp_path / "diagnosis" / "model_after.json").write_bytes((tmp_path / "o/friction/parameters.json").read_bytes())
    jobs = friction("file", more=f", friction: o/friction/parameters.json{law}")
    jobs += friction("fit", more=f", friction: o/friction{law}") + friction("gap", more=f", friction: diagnosis{law}")
    linid("batch", write(tmp_path, jobs), "--out", tmp_path / "p")
    wanted = (tmp_path / "o/job/parameters.json").read_text(encoding="utf-8")
    assert json.loads(wanted)["law"] == "dahl"
    for name in ("file", "fit", "gap"):
        assert (tmp_path / "p" / name / "parameters.json").read_text(encoding="utf-8") == wanted
    # A start that nobody could use would show in the fit without one.
    linid("batch", write(tmp_path, friction("bare", more=law)), "--out", tmp_path / "q")
    assert (tmp_path / "q/bare/parameters.json").read_text(encoding="utf-8") != wanted


def test_a_diagnosis_job_gives_its_model_after(tmp_path: Path) -> None:
    campaign(tmp_path)
    gap = "  - {name: gap, command: diagnose, files: [campaign.yaml]}\n"
    specs = read_batch(write(tmp_path, gap + friction(more=", friction: gap")), {})
    queue = JobQueue(specs, tmp_path / "o", places=None, reporter=None)  # type: ignore[arg-type]
    assert queue._with_paths(specs[1]).models == {"friction": str(tmp_path / "o" / "gap" / "model_after.json")}
    assert specs[1].after == ("gap",)


def test_a_failing_job_stops_only_those_that_need_it_and_resume_mends(tmp_path: Path) -> None:
    campaign(tmp_path)
    (tmp_path / "bad.csv").write_text("Time (ms),Actual Position (mm)\n", encoding="utf-8")
    check = "  - {name: check_bad, command: validate, files: [campaign.yaml], model: bad}\n"
    path = write(tmp_path, friction("bad", "bad.csv") + check + friction())
    out = tmp_path / "o"
    result = linid("batch", path, "--out", out)
    assert result.exit_code == 4
    assert "skipped" in result.stdout and "Traceback" not in result.stdout + result.stderr
    assert (out / "friction" / "parameters.json").exists() and not (out / "check_bad").exists()
    stamp = (out / "friction" / "parameters.json").stat().st_mtime_ns
    # A model of one free wheel would know no mass, and the campaign's added ones could not be compared with it.
    path.write_text(path.read_text(encoding="utf-8").replace("bad.csv", "campaign.yaml"), encoding="utf-8")
    body = summary("batch", path, "--out", out, "--resume")
    assert body["exit_code"] in (0, 5)
    assert (out / "check_bad" / "gaps.json").exists()
    assert (out / "friction" / "parameters.json").stat().st_mtime_ns == stamp


def test_a_job_whose_process_dies_is_reported(tmp_path: Path) -> None:
    campaign(tmp_path)
    slow = ", settings: {generations: 100000, patience: 100000}"
    path = write(tmp_path, friction("killed", more=slow) + friction("alive"))
    process = start("batch", path, "--jobs", "1", "--out", tmp_path / "o", cwd=tmp_path)
    wait_for(tmp_path / "o" / "killed" / "checkpoint.json")
    for child in children(process.pid):
        os.kill(child, signal.SIGKILL)
    out, _ = process.communicate(timeout=300)
    assert process.returncode == 1
    assert "killed" in out and "without an" in out
    assert (tmp_path / "o" / "alive" / "parameters.json").exists()


@pytest.mark.parametrize(
    ("blow", "group"),
    [(signal.SIGINT, False), (signal.SIGINT, True), (signal.SIGTERM, True)],
    ids=["Ctrl-C, parent only", "Ctrl-C, whole group", "kill, whole group"],
)
def test_an_interrupted_batch_goes_on(tmp_path: Path, blow: signal.Signals, group: bool) -> None:
    campaign(tmp_path)
    slow = ", settings: {generations: 60, patience: 1000, population: 24}"
    path = write(tmp_path, friction("slow", more=slow) + friction("later"))
    process = start("batch", path, "--jobs", "1", "--out", tmp_path / "o", cwd=tmp_path)
    wait_for(tmp_path / "o" / "slow" / "checkpoint.json")
    for pid in [process.pid, *(children(process.pid) if group else [])]:
        os.kill(pid, blow)
    _, said = process.communicate(timeout=300)
    assert process.returncode == 128 + blow and "--resume" in said and "Traceback" not in said
    assert not (tmp_path / "o" / "later").exists()
    assert linid("batch", path, "--out", tmp_path / "o", "--resume").exit_code in (0, 5)
    assert linid("batch", path, "--out", tmp_path / "whole").exit_code in (0, 5)
    for name in ("slow", "later"):
        mine, other = ((tmp_path / where / name / "parameters.json").read_bytes() for where in ("o", "whole"))
        assert mine == other


def wait_for(path: Path) -> None:
    if not Path("/proc/self/stat").exists():
        pytest.skip("needs /proc to find the job's process")
    deadline = time.monotonic() + 300.0
    while not path.exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_several_batch_files_in_one_run(tmp_path: Path) -> None:
    campaign(tmp_path)
    first = write(tmp_path, friction())
    second = tmp_path / "second.yaml"
    second.write_text(first.read_text(encoding="utf-8"), encoding="utf-8")
    body = json.loads(linid("batch", first, second, "--dry-run", "--json").stdout)
    assert [job["job"] for job in body["jobs"]] == ["batch.friction", "second.friction"]


def test_generated_recordings_feed_a_fit(tmp_path: Path) -> None:
    axis = ROOT / "configs" / "stand_axis.yaml"
    jobs = f"  - {{name: made, command: generate, axis: {axis}, only: [freewheel_2, freewheel_4]}}\n"
    body = summary("batch", write(tmp_path, jobs + friction(files='"job:made"')), "--out", tmp_path / "o")
    assert body["exit_code"] in (0, 5)
    assert (tmp_path / "o" / "made" / "truth.yaml").exists()


@pytest.mark.parametrize("name", ["stand", "template", "paper"])
def test_the_batch_files_of_the_project_are_valid(name: str) -> None:
    specs = read_batch(ROOT / "configs" / f"{name}.yaml", {})
    assert {spec.command for spec in specs} >= {"fit-friction", "fit-motor"}
    assert "reproduce" in {spec.command for spec in specs} or name != "paper"


def test_jobs_wait_for_all_that_they_name() -> None:
    specs = {spec.label: spec for spec in read_batch(ROOT / "configs" / "paper.yaml", {})}
    assert set(specs["paper"].after) == {
        "friction",
        "motor_sine",
        "motor_theta",
        "narrow_stand",
        "narrow_sine",
        "narrow_theta",
        "voltage_stand",
        "voltage",
    }
    assert specs["field"].models == {"model": "job:motor_theta"} and specs["field"].after == ("motor_theta",)
    assert specs["narrow_sine"].options["model"] == "sine" and specs["narrow_sine"].options["input"] == "current"


def test_the_emps_example_says_which_file_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "emps.yaml"
    path.write_bytes((ROOT / "configs" / "emps.yaml").read_bytes())
    result = linid("batch", path)
    assert result.exit_code == 3 and "DATA_EMPS.mat" in result.stderr
    for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"):
        (tmp_path / name).touch()
    assert [spec.label for spec in read_batch(path, {})] == ["fit", "held_out"]


def test_the_template_explains_every_setting() -> None:
    from linid.interface.settings import Settings

    text = (ROOT / "configs" / "template.yaml").read_text(encoding="utf-8")
    assert [name for name in Settings.model_fields if f"{name}:" not in text] == []
    keys = {key for job in (FitMotorJob, GenerateJob, ValidateJob, DiagnoseJob, FieldJob) for key in job.model_fields}
    assert [key for key in sorted(keys) if f"{key}:" not in text] == []


@pytest.mark.parametrize(
    ("jobs", "line", "word"),
    [
        (friction(more=", setings: {seed: 1}"), 3, "Did you mean 'settings'"),
        (friction(more=", settings: {populatoin: 9}"), 3, "populatoin"),
        (friction(more=", settings: {population: lots}"), 3, "lots"),
        ("  - {name: x, command: fit-everything, files: [campaign.yaml]}\n", 3, "fit-everything"),
        (friction(files="nowhere.yaml"), 3, "nowhere.yaml"),
        (friction(name="bad name"), 3, "name"),
        (friction() + CHECK.replace("model: friction", "model: fricton"), 4, "Did you mean 'friction'"),
        (
            friction() + CHECK + CHECK.replace("name: check", "name: two").replace("model: friction", "model: check"),
            5,
            "validate job",
        ),
        ("  - {name: x, command: fit-motor, files: [campaign.yaml], model: cosine}\n", 3, "cosine"),
        (friction(more=", after: [ghost]"), 3, "ghost"),
        (friction(more=", friction: ."), 3, "holds no parameters.json and no model_after.json"),
    ],
)
def test_a_wrong_batch_file_exits_with_3_and_names_the_line(tmp_path: Path, jobs: str, line: int, word: str) -> None:
    campaign(tmp_path)
    path = write(tmp_path, jobs)
    result = linid("batch", path, "--out", tmp_path / "o")
    assert result.exit_code == 3, result.output
    assert f"{path}, line {line}" in result.stderr and word in result.stderr
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    "jobs", [friction() + friction(), friction("a", more=", after: [b]") + friction("b", more=", after: [a]")]
)
def test_equal_names_and_circles_are_refused(tmp_path: Path, jobs: str) -> None:
    campaign(tmp_path)
    assert linid("batch", write(tmp_path, jobs)).exit_code == 3


def test_schema() -> None:
    result = linid("batch", "--schema")
    body = json.loads(result.stdout)
    assert result.exit_code == 0 and set(body["properties"]) == set(BatchFile.model_fields)
    assert body["additionalProperties"] is False


class Scripted:
    """Places that hold one job at a time and tell the given reports; what they did stands in `log`."""

    def __init__(self, *reports: JobReport) -> None:
        self.reports = list(reports)
        self.log: list[str] = []

    def free(self) -> bool:
        return True

    def start(self, job: JobSpec) -> None:
        self.log.append(f"start {job.label}")

    def ended(self) -> list[JobReport]:
        report = self.reports.pop(0)
        self.log.append(f"{'draws' if report.drawing else report.status} {report.label}")
        return [report]

    def interrupt(self) -> list[JobReport]:
        raise AssertionError("nobody interrupts")


def test_followers_do_not_wait_for_figures(tmp_path: Path) -> None:
    """Nor do figures that fail, which the job reports, take their model from them."""
    campaign(tmp_path)
    specs = read_batch(write(tmp_path, friction() + CHECK + friction("last", more=", after: [friction, check]")), {})
    done = JobReport("check", "done", 0, 1.0, "")
    failed = JobReport("friction", "failed", 1, 2.0, "disk full")
    places = Scripted(
        JobReport("friction", "done", 0, 1.0, "", drawing=True), done, failed, JobReport("last", "done", 0, 1.0, "")
    )
    reports = JobQueue(specs, tmp_path / "o", places, Reporter(-1)).run()
    assert places.log == [
        "start friction",
        "draws friction",
        "start check",
        "done check",
        "start last",
        "failed friction",
        "done last",
    ]
    assert [(r.label, r.status) for r in reports] == [("friction", "failed"), ("check", "done"), ("last", "done")]


def test_figures_are_drawn_beside_the_next_job(tmp_path: Path) -> None:
    """On two places; the files are those of one place, where a job has an end before the next begins."""
    campaign(tmp_path)
    path = write(tmp_path, friction() + CHECK, defaults=DEFAULTS.replace("figures: false", "figures: all"))
    for jobs, beside in ((1, False), (2, True)):
        done = linid("batch", path, "--out", tmp_path / f"o{jobs}", "--jobs", jobs)
        assert done.exit_code in (0, 5), done.stderr
        began, end = (re.search(words, done.stderr) for words in ("check: started", r"friction: (done|not conv.*) in"))
        assert began is not None and end is not None
        assert (began.start() < end.start()) == beside
    drawn = sorted(p.relative_to(tmp_path / "o1") for p in (tmp_path / "o1").rglob("*.png"))
    assert len(drawn) > 5 and drawn == sorted(p.relative_to(tmp_path / "o2") for p in (tmp_path / "o2").rglob("*.png"))
    for name in drawn:
        assert (tmp_path / "o1" / name).read_bytes() == (tmp_path / "o2" / name).read_bytes()


def test_fits_of_a_batch_are_verified_where_that_is_quick(tmp_path: Path) -> None:
    """Friction and a sine motor are, theta, effects and other laws are not, and who says no is not."""
    campaign(tmp_path)
    motors = "  - {name: motor, command: fit-motor, model: [sine, theta], files: [campaign.yaml]}\n"
    jobs = (
        friction()
        + friction("told", more=", settings: {verify_search: false}")
        + friction("drag", more=", settings: {effects: [quadratic_drag]}")
        + friction("dahl", more=", settings: {law: dahl}")
        + motors
    )
    specs = read_batch(write(tmp_path, jobs, defaults=""), {})
    found = {spec.label: verified_settings(spec).verify_search for spec in specs}
    assert found == {
        "friction": True,
        "told": False,
        "drag": False,
        "dahl": False,
        "motor_sine": True,
        "motor_theta": False,
    }


def test_a_batch_says_whether_a_search_found_the_same_minimum(tmp_path: Path) -> None:
    campaign(tmp_path)
    path = write(tmp_path, friction(), defaults="defaults: {figures: false}\n")
    assert linid("batch", path, "--out", tmp_path / "o").exit_code == 0
    said = json.loads((tmp_path / "o" / "friction" / "parameters.json").read_text(encoding="utf-8"))["search_check"]
    assert said.startswith("An independent search from random candidates (seed 2) found the same minimum")
