"""Wheel and sdist hold the package and nothing else; the wheel works where only what it declares is installed."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from collections.abc import Sequence
from email import message_from_bytes
from importlib import metadata
from pathlib import Path
from textwrap import dedent

import pytest

from linid.cli.main import cli
from linid.installed_kernels import SWITCH
from linid.threads import ONE_THREAD

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LEFT_OUT = shutil.ignore_patterns(".*", "build", "dist", "*.egg-info", "linid_*", "kernels")
# What lies about in a checkout and must not be packed: machine code, a run's folder, notes.
STRAY = ("linid/__pycache__/x.cpython-311.pyc", "linid/physics/__pycache__/kernel.nbi", "linid_batch_x/notes.py")
UNREACHABLE = ("No matching distribution found for", "Could not find a version that satisfies")
GENERATED = ("freewheel_2", "freewheel_4", "freewheel_6", "sine_current_2", "sine_current_3")
# Two models with two seeds each in four threads at once, and one after the other.
THREADS = """
from concurrent.futures import ThreadPoolExecutor

def one(task):
    model, seed = task
    settings = {"population": 10, "generations": 4, "least_squares_steps": 4}
    return linid.fit(campaign, model, start=friction, seed=seed, **settings).to_frame()

tasks = [("friction", 2), ("theta", 2), ("friction", 3), ("theta", 3)]
with ThreadPoolExecutor(4) as pool:
    together = list(pool.map(one, tasks))
same = [one(task).equals(frame) for task, frame in zip(tasks, together, strict=True)]
"""
TOLD = """
import json
curve = linid.plot.friction_curve(motor)
print(json.dumps({
    "file": linid.__file__, "same": same, "verdict": found.verdict.sentence,
    "mass": [motor["mass"].value, *motor["mass"].interval], "rows": list(motor.to_frame().index),
    "gaps": sorted(gap.recording for gap in gaps), "lines": len(curve.get_lines()),
}))
"""


EVERY_MODULE = """
import importlib, pkgutil, linid
print(*(importlib.import_module(m.name).__name__ for m in pkgutil.walk_packages(linid.__path__, "linid.")))
print(linid.__file__)
"""


# What of the kernels needs to be compiled, and how many came with the installation.
LACKING = """
from numba.core.registry import cpu_target
from linid.installed_kernels import installed_folder
from linid.simulation.compile_ahead import ALL, lacking
found = installed_folder(cpu_target.target_context.codegen())
print([name for names in lacking(ALL) for name in names], len(list(found.glob("*.nbi"))) if found else 0)
"""


def run(*command: object, cwd: Path, timeout: float = 600.0, **variables: str) -> str:
    """Standard output of a program that knows nothing of the checkout; fails with all it said. variables: of its
    environment; no kernels are compiled unless these ask for it."""
    inherited = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", *ONE_THREAD)
    environment = {k: v for k, v in os.environ.items() if k not in inherited}
    environment |= {SWITCH: "0", **variables}
    done = subprocess.run(
        [str(part) for part in command], cwd=cwd, env=environment, capture_output=True, text=True, timeout=timeout
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def build(source: Path, *options: str, out: Path, **variables: str) -> None:
    """`python -m build` in an environment of its own; skips where that cannot be had."""
    pytest.importorskip("build", reason='needs build (the extra `test`: pip install -e ".[test]")')
    try:
        run(sys.executable, "-m", "build", *options, "--outdir", out, source, cwd=source, **variables)
    except AssertionError as error:
        if any(words in str(error) for words in UNREACHABLE):
            pytest.skip("what builds cannot be had: no network, no package index")
        raise


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the checkout, with strays: a build writes into its source."""
    folder = tmp_path_factory.mktemp("source") / "linid"
    shutil.copytree(ROOT, folder, ignore=LEFT_OUT)
    for name in STRAY:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("stray = True\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def dist(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the sdist, and the wheel that was built from it."""
    out = tmp_path_factory.mktemp("dist")
    build(source, out=out)
    assert sorted(p.name for p in out.iterdir()) == [
        f"linid-{PROJECT['version']}-py3-none-any.whl",
        f"linid-{PROJECT['version']}.tar.gz",
    ]
    return out


@pytest.fixture(scope="module")
def wheel(dist: Path) -> Path:
    return next(dist.glob("*.whl"))


def contents(wheel: Path) -> dict[str, int]:
    """CRC of each file in a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return {entry.filename: entry.CRC for entry in archive.infolist() if not entry.is_dir()}


def declared(names: Sequence[str]) -> set[str]:
    """Installed distributions that these requirements need, with all that those need in turn."""
    from packaging.requirements import Requirement

    found: set[str] = set()
    waiting = list(names)
    while waiting:
        requirement = Requirement(waiting.pop())
        name = re.sub(r"[-_.]+", "-", requirement.name).lower()
        wanted = requirement.marker is None or requirement.marker.evaluate({"extra": ""})
        if wanted and name not in found:
            found.add(name)
            waiting += metadata.requires(name) or []
    return found


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fresh environment: linid from its wheel; what it declares, and no more, linked from this environment."""
    folder = tmp_path_factory.mktemp("environment") / "venv"
    run(sys.executable, "-m", "venv", folder, cwd=folder.parent)
    paths = sysconfig.get_paths("venv", vars={"base": str(folder), "platbase": str(folder)})
    for name in declared(PROJECT["dependencies"]):
        distribution = metadata.distribution(name)
        tops = {file.parts[0] for file in distribution.files or ()} - {"..", "__pycache__"}
        assert tops, f"{name}: files not recorded"
        for top in tops:
            target = Path(paths["purelib"], top)
            if not target.exists():
                target.symlink_to(Path(str(distribution.locate_file(top))))
    scripts = Path(paths["scripts"])
    run(scripts / "python", "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", wheel, cwd=folder)
    return scripts


def test_the_wheel_holds_the_package_and_nothing_else(wheel: Path) -> None:
    files = {p.relative_to(ROOT).as_posix() for p in (ROOT / "linid").rglob("*") if p.is_file()}
    files = {name for name in files if "__pycache__" not in name and not name.startswith("linid/kernels/")}
    found = {name for name in contents(wheel) if ".dist-info/" not in name}
    assert found == files and "linid/py.typed" in files and any(name.endswith(".j2") for name in files)
    with zipfile.ZipFile(wheel) as archive:
        info = f"linid-{PROJECT['version']}.dist-info"
        assert archive.read(f"{info}/top_level.txt").split() == [b"linid"]
        assert archive.read(f"{info}/licenses/LICENSE") == (ROOT / "LICENSE").read_bytes()
        said = message_from_bytes(archive.read(f"{info}/METADATA"))
        scripts = archive.read(f"{info}/entry_points.txt").decode()
    assert (said["Version"], said["License-Expression"]) == (PROJECT["version"], PROJECT["license"])
    assert said["Requires-Python"] == PROJECT["requires-python"]
    without_extra = {text for text in said.get_all("Requires-Dist", []) if "extra ==" not in text}
    assert without_extra == set(PROJECT["dependencies"])
    assert f"linid = {PROJECT['scripts']['linid']}" in scripts


def test_the_sdist_builds_the_wheel_that_the_checkout_builds(source: Path, wheel: Path, tmp_path: Path) -> None:
    build(source, "--wheel", out=tmp_path)
    direct = contents(next(tmp_path.glob("*.whl")))
    assert direct == contents(wheel)


def test_what_the_wheel_declares_is_enough_for_its_modules_and_commands(environment: Path, tmp_path: Path) -> None:
    run(environment / "python", "-m", "pip", "check", cwd=tmp_path)
    modules, where = run(environment / "python", "-I", "-c", EVERY_MODULE, cwd=tmp_path).splitlines()
    assert Path(where).is_relative_to(environment.parent) and Path(where).with_name("py.typed").is_file()
    assert {"linid.api", "linid.cli.main"} <= set(modules.split())
    assert run(environment / "linid", "--version", cwd=tmp_path).split()[-1] == PROJECT["version"]
    said = run(environment / "linid", "--help", cwd=tmp_path)
    assert [name for name in cli.commands if not re.search(rf"^  {name} ", said, re.M)] == []


@pytest.mark.slow
def test_an_installation_brings_the_kernels_of_its_machine(
    source: Path, wheel: Path, environment: Path, tmp_path: Path
) -> None:
    """Next to the files of a wheel for any machine; no command compiles on an empty cache then."""
    shutil.copytree(source, tmp_path / "source")
    build(tmp_path / "source", "--wheel", out=tmp_path, **{SWITCH: "1"})
    (built,) = tmp_path.glob("*.whl")
    assert not built.name.endswith("-none-any.whl")
    plain, full = contents(wheel), contents(built)
    kernels = [name for name in full if name.startswith("linid/kernels/")]
    assert {name for name in full if "dist-info" not in name} == {
        *kernels,
        *(name for name in plain if "dist-info" not in name),
    }
    assert {Path(name).suffix for name in kernels} == {".nbi", ".nbc", ".txt"}

    with zipfile.ZipFile(built) as archive:
        archive.extractall(tmp_path / "installed")
    said = [
        run(
            environment / "python",
            "-P",
            "-c",
            f"import sys; sys.path[:0] = [{str(tmp_path / 'installed')!r}]\n{LACKING}",
            cwd=tmp_path,
            **{SWITCH: switch, "LINID_CACHE_DIR": str(tmp_path / f"cache_{switch}")},
        )
        for switch in "10"
    ]
    assert said[0].split() == ["[]", str(sum(name.endswith(".nbi") for name in kernels))]
    assert said[1].startswith("['along under lugre', ") and said[1].endswith(" 0\n")


@pytest.mark.slow
def test_the_readmes_python_runs_from_the_wheel_and_in_threads(environment: Path, tmp_path: Path) -> None:
    """On a campaign that the installed command generates."""
    axis = shutil.copy(ROOT / "configs" / "stand_axis.yaml", tmp_path)
    only = [word for name in GENERATED for word in ("--only", name)]
    run(environment / "linid", "generate", axis, *only, "--out", tmp_path / "stand", "--quiet", cwd=tmp_path)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"^## In Python\n\n((?:    .*\n|\n)+)", readme, re.M)
    script = tmp_path / "stand" / "example.py"
    script.write_text(dedent(example) + THREADS + TOLD, encoding="utf-8")
    said = run(environment / "python", "-I", script, cwd=script.parent)
    told = json.loads(said.splitlines()[-1])
    assert Path(told["file"]).is_relative_to(environment.parent)
    assert told["same"] == [True] * 4
    value, low, high = told["mass"]
    assert low < value < high and value == pytest.approx(0.588, rel=1e-3)  # configs/stand_axis.yaml
    assert {"mass", "coulomb_force", "commutation_offset"} <= set(told["rows"]) and "coulomb_force" in said
    assert told["gaps"] == ["freewheel_6", "sine_current_3"] and told["lines"] == 1
    assert told["verdict"] in said and "noise floor" in told["verdict"]
    assert told["verdict"] in (script.parent / "diagnosis.html").read_text(encoding="utf-8")
