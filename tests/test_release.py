"""What is released names one version everywhere, and the package is typed."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[1]
PROCESSOR = ROOT / "linid" / "kernels" / "processor.txt"  # beside the kernels of an editable installation


def test_one_version_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    changes = re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    assert cited["version"] == project["version"] and changes[:2] == ["Unreleased", project["version"]]
    assert cited["references"][0]["doi"] == "10.1007/s11071-018-4365-0"


def test_the_package_is_typed_and_ships_its_data() -> None:
    data = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["package-data"]
    for package, names in data.items():
        folder = ROOT / package.replace(".", "/")
        assert all((folder / name).is_file() for name in names), package
    shipped = {ROOT / p.replace(".", "/") / name for p, names in data.items() for name in names}
    others = {p for p in (ROOT / "linid").rglob("*") if p.is_file() and p.suffix not in (".py", ".pyc", ".nbi", ".nbc")}
    assert others - {PROCESSOR} == shipped


def test_what_contributing_names_is_there() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    paths = re.findall(r"`((?:linid|tests|docs)/[\w./]+)`", text)
    assert len(paths) > 10 and all((ROOT / path).exists() for path in paths)
