"""The documentation's site builds without a warning and holds what the program has; links and names in it are true."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import linid
from linid.cli.main import cli

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    for module in ("sphinx", "myst_parser", "sphinx_click", "furo"):
        pytest.importorskip(module, reason='needs the extra: pip install "linid[docs]"')
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "docs", str(tmp_path / "site")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-3000:]
    commands = (tmp_path / "site/reference/cli.html").read_text(encoding="utf-8")
    assert all(f'id="linid-{name}"' in commands for name in cli.commands)
    reference = (tmp_path / "site/reference/api.html").read_text(encoding="utf-8")
    assert all(f'id="linid.api.{name}"' in reference for name in linid.__all__ if name not in ("plot", "Recording"))
    assert 'id="linid.recording.recording.Recording"' in reference or 'id="linid.api.Recording"' in reference
    effects = (tmp_path / "site/reference/effects.html").read_text(encoding="utf-8")
    assert "load_dependent_friction" in effects


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_files_and_modules_that_a_page_names_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    links = [link.split("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link]
    assert [link for link in links if link and not (page.parent / link).exists()] == []
    files = re.findall(r"(?<![\w/.])(?:linid|tests|docs|configs|data)/[\w./]*\w", text)
    assert [name for name in files if not (ROOT / name).exists()] == []
    modules = [name.replace(".", "/") for name in re.findall(r"python -m (tests[\w.]*\w)", text)]
    assert [name for name in modules if not ((ROOT / name).is_dir() or (ROOT / f"{name}.py").exists())] == []


def test_the_results_page_names_every_parameter_of_the_base_model() -> None:
    from linid.physics.electrical import SEPARATE
    from linid.physics.model import Model

    text = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    models = (Model("force"), Model("sine"), Model("theta", winding=SEPARATE))
    assert [p.name for model in models for p in model.parameters if f"`{p.name}`" not in text] == []
