"""Settings: layers, assignments and the way to YAML and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from linid.errors import ConfigError
from linid.interface.settings import Settings, make_settings
from linid.interface.stages import fit_settings
from linid.workflow.run.settings import parse_assignment, read_settings, settings_yaml


def test_later_layers_win_and_mappings_merge() -> None:
    merged = make_settings({"seed": 1, "known": {"mass": 2.0, "nome": 0.5}}, {"known": {"mass": 3.0}}, {"seed": 7})
    assert merged.seed == 7 and merged.known == {"mass": 3.0, "nome": 0.5}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("population=48", {"population": 48}),
        ("tolerance=1e-4", {"tolerance": 1e-4}),
        ("known.mass=2", {"known": {"mass": 2}}),
        ("bounds.mass=[0.1, 2]", {"bounds": {"mass": [0.1, 2]}}),
        ("figure_formats=[png, svg]", {"figure_formats": ["png", "svg"]}),
        ("figures=false", {"figures": False}),
    ],
)
def test_assignments(text: str, expected: dict[str, Any]) -> None:
    assert parse_assignment(text) == expected
    make_settings(expected)


def test_one_added_mass_is_for_all_files() -> None:
    assert make_settings({"added_mass": 0.5}).added_mass == {"*": 0.5}
    assert make_settings({"added_mass": 0.5}, {"added_mass": {"a.csv": 1.0}}).added_mass == {"*": 0.5, "a.csv": 1.0}


def test_mass_stands_above_the_campaign() -> None:
    settings = make_settings({"mass": 2.0, "known": {"nome": 0.4}})
    assert settings.known_values({"mass": 1.0, "commutation_offset": 0.1}) == {
        "mass": 2.0,
        "nome": 0.4,
        "commutation_offset": 0.1,
    }


@pytest.mark.parametrize(
    "raw", [{"mass": -1}, {"seed": 1.5}, {"known": {"mass": float("nan")}}, {"window": [1]}, {"x": 1}]
)
def test_wrong_values_are_refused(raw: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        make_settings(raw)


@given(
    seed=st.integers(0, 2**31),
    mass=st.none() | st.floats(1e-6, 1e6),
    horizon=st.floats(1e-3, 10),
    known=st.dictionaries(st.sampled_from(["mass", "nome", "commutation_offset"]), st.floats(-1e9, 1e9)),
    window=st.none() | st.tuples(st.floats(-10, 0), st.floats(1, 10)),
)
def test_resolved_settings_read_back_exactly(tmp_path_factory: pytest.TempPathFactory, **raw: Any) -> None:
    settings = Settings(**raw, channels={"position": "y"})
    path: Path = tmp_path_factory.mktemp("s") / "config.yaml"
    path.write_text(settings_yaml(settings, "two\nlines"), encoding="utf-8")
    assert make_settings(read_settings(path)) == settings


def test_channels_may_name_a_file_beside_the_settings(tmp_path: Path) -> None:
    (tmp_path / "mapping.yaml").write_text("channels:\n  position: {column: y, unit: mm}\n", encoding="utf-8")
    (tmp_path / "settings.yaml").write_text("channels: mapping.yaml\n", encoding="utf-8")
    channels = make_settings(read_settings(tmp_path / "settings.yaml")).channels
    assert channels is not None and channels.position is not None and channels.position.unit == "mm"


def test_inputs_bear_the_name_of_their_campaign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that lies in the working folder, whose path has no parent."""
    from linid.api import read
    from tests.workflow.small import campaign

    path = campaign(tmp_path / "stage_3")
    monkeypatch.chdir(path.parent)
    assert read("campaign.yaml").name == "small"
    path.write_text(path.read_text(encoding="utf-8").replace("name: small\n", ""), encoding="utf-8")
    assert read("campaign.yaml").name == "stage_3"


def test_a_plain_search_is_not_polished_unless_asked() -> None:
    def steps(**raw: Any) -> int:
        return fit_settings(make_settings(raw), 1).least_squares_steps

    assert steps() == 60 and steps(method="plain") == 0
    assert steps(method="plain", least_squares_steps=5) == 5 and steps(least_squares_steps=0) == 0
    assert steps(polish_steps=0) == 0  # as it was called


def test_operators_and_rates_reach_the_search() -> None:
    raw = {"selection": "roulette", "crossover": "blend", "crossover_rate": 0.4, "mutation": "gaussian", "elite": 0}
    search = fit_settings(make_settings(raw, {"mutation_rate": 0.2, "tournament": 5}), 1).search
    assert (search.selection, search.crossover, search.crossover_rate) == ("roulette", "blend", 0.4)
    assert (search.mutation, search.mutation_rate, search.elite, search.tournament) == ("gaussian", 0.2, 0, 5)
    for wrong in ({"crossover_rate": 1.5}, {"selection": "best"}, {"mutation_rate": -0.1}):
        with pytest.raises(ConfigError):
            make_settings(wrong)


@pytest.mark.parametrize(
    ("value", "kept"), [(True, "few"), (False, "none"), ("few", "few"), ("all", "all"), ("none", "none")]
)
def test_figures_are_a_number_of_them_or_as_formerly_yes_or_no(value: object, kept: str) -> None:
    assert make_settings({"figures": value}).figures == kept


def test_figures_of_another_number_are_refused() -> None:
    with pytest.raises(ConfigError, match="figures"):
        make_settings({"figures": "many"})
