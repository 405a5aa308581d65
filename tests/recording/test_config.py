"""YAML files: every complaint names the file, the line, what was found and what would be right."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import BaseModel, ConfigDict, Field

from linid.config import json_schema, load_yaml_model
from linid.errors import ConfigError


class Inner(BaseModel):
    model_config = ConfigDict(extra="forbid")
    weight: float = 1.0
    name: str


class Outer(BaseModel):
    model_config = ConfigDict(extra="forbid")
    rate: float = 1.0
    items: list[Inner] = Field(default_factory=list)
    choice: str | Inner | None = None


def load(folder: Path, text: str | bytes) -> Outer:
    path = folder / "setup.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_yaml_model(path, Outer)


def error_of(folder: Path, text: str | bytes, *parts: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load(folder, text)
    assert caught.value.exit_code == 3
    for part in ("setup.yaml", *parts):
        assert part in str(caught.value), str(caught.value)


@pytest.mark.parametrize(("text", "value"), [("1e-3", 1e-3), ("1E5", 1e5), ("2", 2.0), (".5", 0.5), ("1.5e+2", 150.0)])
def test_numbers_as_people_write_them(tmp_path: Path, text: str, value: float) -> None:
    assert load(tmp_path, f"rate: {text}\n").rate == value


def test_unknown_key_suggests_the_nearest(tmp_path: Path) -> None:
    error_of(tmp_path, "rate: 1\nitms: []\n", "line 2", "unknown key 'itms'", "Did you mean 'items'?")


def test_unknown_key_deep_inside(tmp_path: Path) -> None:
    text = "rate: 1\nitems:\n  - name: a\n  - name: b\n    wieght: 3\n"
    error_of(tmp_path, text, "line 5", "unknown key 'items[2].wieght'", "Did you mean 'weight'?", "weight, name")


def test_wrong_type(tmp_path: Path) -> None:
    error_of(tmp_path, "items:\n  - {name: a, weight: heavy}\n", "line 2", "'items[1].weight' is 'heavy'", "number")
    error_of(tmp_path, "\nrate: [1, 2]\n", "line 2", "'rate' is [1, 2]")


def test_missing_key(tmp_path: Path) -> None:
    error_of(tmp_path, "items:\n  - weight: 2\n", "line 2", "'items[1].name' is missing")


def test_several_problems_are_counted(tmp_path: Path) -> None:
    error_of(tmp_path, "rat: 1\nitms: []\nrate: x\n", "2 more problems")


def test_syntax_error_has_line_and_column(tmp_path: Path) -> None:
    error_of(tmp_path, "rate: 1\nitems: [a, b\nchoice: c\n", "line 3", "not valid YAML")
    error_of(tmp_path, "rate: 1\n\titems: 2\n", "line 2", "tabs")


def test_duplicate_key(tmp_path: Path) -> None:
    error_of(tmp_path, "rate: 1\nrate: 2\n", "line 2", "'rate' is given twice", "line 1")


@pytest.mark.parametrize(("text", "found"), [("", "nothing"), ("- 1\n- 2\n", "list"), ("word", "str")])
def test_not_a_mapping(tmp_path: Path, text: str, found: str) -> None:
    error_of(tmp_path, text, found, "Known keys: rate, items, choice")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="not found"):
        load_yaml_model(tmp_path / "none.yaml", Outer)
    with pytest.raises(ConfigError, match="folder"):
        load_yaml_model(tmp_path, Outer)
    error_of(tmp_path, b"rate: \xff\xfe1\n", "UTF-8")
    error_of(tmp_path, b"rate: \x00\n", "not valid YAML")


def test_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    assert load(tmp_path, b"\xef\xbb\xbfrate: 3\n").rate == 3.0


def test_schema_comes_from_the_model() -> None:
    schema = json_schema(Outer)
    assert schema["additionalProperties"] is False and set(schema["properties"]) == {"rate", "items", "choice"}
