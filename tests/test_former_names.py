"""Files and options of earlier versions: their names are read as what they are called today."""

from __future__ import annotations

import json

import pytest

from linid.errors import ConfigError
from linid.former_names import FORMER_NAMES, with_present_keys
from linid.identification.model_file import model_from_text, model_to_text
from linid.interface.settings import make_settings
from linid.stand.description import SineMotor
from linid.workflow.run.settings import parse_assignment
from tests.report.samples import fit_result

OLD = {present: former for former, present in FORMER_NAMES.items()}


def with_former_names(content: object) -> object:
    if isinstance(content, dict):
        return {OLD.get(key, key): with_former_names(value) for key, value in content.items()}
    if isinstance(content, list):
        return [with_former_names(value) for value in content]
    return OLD.get(content, content) if isinstance(content, str) else content


def test_a_model_file_with_former_names_is_the_same_model() -> None:
    text = model_to_text(fit_result())
    old = json.dumps(with_former_names(json.loads(text)))
    assert "guideway_density" in old and "commutation_offset" not in old
    assert model_to_text(model_from_text(old, "old.json")) == text


def test_settings_and_options_with_former_names() -> None:
    old = make_settings(
        {"known": {"shift": 0.1}, "bounds": {"guideway_density": [1.0, 2.0]}, "profiles": ["shift"]},
        parse_assignment("polish_steps=9"),
    )
    new = make_settings(
        {
            "known": {"commutation_offset": 0.1},
            "bounds": {"electrical_wavenumber": [1.0, 2.0]},
            "profiles": ["commutation_offset"],
            "least_squares_steps": 9,
        }
    )
    assert old == new and new.least_squares_steps == 9


def test_a_later_layer_with_a_former_name_stands_above() -> None:
    assert make_settings({"known": {"commutation_offset": 0.1}}, {"known": {"shift": 0.3}}).known == {
        "commutation_offset": 0.3
    }


def test_one_thing_under_both_names_is_refused() -> None:
    with pytest.raises(ConfigError, match="same thing"):
        make_settings({"known": {"shift": 0.1, "commutation_offset": 0.1}})


def test_a_recording_may_be_called_as_a_parameter_was() -> None:
    assert make_settings({"added_mass": {"shift": 0.5}}).added_mass == {"shift": 0.5}


def test_a_described_motor_with_former_keys() -> None:
    keys = {"kind": "sine", "force_constant_n_per_a": 30.0, "winding_displacement_rad": 2.0}
    old = SineMotor.model_validate(keys | {"guideway_density_per_m": 222.0, "shift_rad": 0.4})
    assert old.electrical_wavenumber_per_m == 222.0 and old.commutation_offset_rad == 0.4


def test_what_is_no_mapping_stays() -> None:
    assert with_present_keys([1]) == [1] and with_present_keys("shift") == "shift"
