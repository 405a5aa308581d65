"""Own terms from settings to results: the examples of the documentation run, and a MODEL file keeps a term."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner

import linid
from linid.cli.main import cli
from linid.errors import ConfigError, LinidError
from linid.interface.settings import make_settings
from linid.report.latex import parameter_latex
from linid.report.tables import formula_notes

PAGE = Path(__file__).resolve().parents[1] / "docs" / "own_terms.md"
CONFIG = Path(__file__).resolve().parents[1] / "configs" / "stand_axis.yaml"


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture(scope="module")
def stand(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("own_terms")
    done = CliRunner().invoke(cli, ["generate", str(CONFIG), "--seed", "7", "--out", str(folder / "my_stand")])
    assert done.exit_code == 0, done.output
    return folder


def test_the_settings_of_the_page_are_fitted(stand: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No such drag acts on the axis: its amplitude is a small part of the viscous friction."""
    monkeypatch.chdir(stand)
    first, mixed = blocks("yaml")
    Path("settings.yaml").write_text(first, encoding="utf-8")
    command = ["fit-friction", "--config", "settings.yaml", "my_stand/campaign.yaml", "--no-figures", "--out", "fit"]
    done = CliRunner().invoke(cli, command)
    assert done.exit_code == 0, done.output
    assert done.output.count("my_drag = -c * v * abs(v) in N") == 1
    fit = linid.load("fit/parameters.json")
    assert fit.result.effects == ("my_drag: -c * v * abs(v)",)
    assert abs(fit["my_drag_c"].value) < 0.02 * fit["viscous_friction"].value
    again = yaml.safe_load(Path("fit/config.yaml").read_text(encoding="utf-8"))
    assert make_settings(again).effects == fit.result.effects
    assert make_settings(yaml.safe_load(mixed)).effects == (
        "cogging",
        "hill: -b * exp(-((y - y_0) / w) ** 2) * sign(v); y_0 in [0.1, 0.3]; w in [0.01, 0.1]",
    )


def test_the_python_of_the_page_runs(stand: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(stand)
    (block,) = blocks("python")
    names: dict[str, object] = {}
    exec(compile(block, str(PAGE), "exec"), names)
    assert len(names["rail"]) == 6  # type: ignore[arg-type]
    fit = names["fit"]
    assert isinstance(fit, linid.Fit)
    kept = linid.load(fit.save("saved.json")).result
    assert {e.name: e.value for e in kept.estimates} == {e.name: e.value for e in fit.result.estimates}
    assert kept.effects == fit.result.effects
    (note,) = formula_notes(fit.result)
    assert note.startswith("rail = -spline(y, 0, 0.5, 6) * sign(v) in N; rail_1 to 6: ") and "held" not in note
    assert parameter_latex(fit.result).count(r"rail = -spline(y, 0, 0.5, 6) * sign(v) in N") == 1


def test_a_damaged_formula_in_a_model_file_is_refused(stand: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(stand)
    text = Path("fit/parameters.json").read_text(encoding="utf-8")
    for wrong in ("my_drag: -c * v * open(v)", "my_drag: -d * v", "my_drag: -c * v * "):
        Path("wrong.json").write_text(text.replace("my_drag: -c * v * abs(v)", wrong), encoding="utf-8")
        with pytest.raises(ConfigError):
            linid.load("wrong.json")


@pytest.mark.parametrize(
    ("effects", "wanted"),
    [
        ("cogging", None),
        (["cogging"], ("cogging",)),
        ({"d": "-c*v"}, ("d: -c * v",)),
        (["d:-c*v", "cogging"], ("d: -c * v", "cogging")),
        ([{"d": {"formula": "c*v**p", "p": [1, "3e0"]}}], ("d: c * v ** p; p in [1, 3]",)),
        ({"d": {"p": [1, 3]}}, None),
        ({"d": {"formula": "c*v**p", "p": 3}}, None),
        ({"d": "c * open(v)"}, None),
        ({"d": 3}, None),
        ([3], None),
    ],
)
def test_settings_take_names_mappings_and_lists_of_both(effects: object, wanted: tuple[str, ...] | None) -> None:
    if wanted is None:
        with pytest.raises(LinidError):
            make_settings({"effects": effects})
    else:
        assert make_settings({"effects": effects}).effects == wanted


def test_the_list_of_effects_explains_an_own_term() -> None:
    done = CliRunner().invoke(cli, ["effects", "my_drag: -c*v*abs(v)"])
    assert done.exit_code == 0 and "my_drag = -c * v * abs(v)" in done.output and "my_drag_c" in done.output
    assert "NAME: FORMULA" in CliRunner().invoke(cli, ["effects"]).output
    wrong = CliRunner().invoke(cli, ["effects", "my_drag: -c*v*open(v)"])
    assert wrong.exit_code != 0
