"""The contract that every target of `linid export` keeps, those of other packages too, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import PurePosixPath

import pytest

from linid.errors import ConfigError, UsageError
from linid.export.registry import BUILT_IN, all_targets, collect, find_target
from linid.export.target import Target, check_target, reshaped, word_of
from linid.export.targets import python
from tests.export.axis import EIGHT, exported


@pytest.mark.parametrize("name", list(all_targets()))
def test_a_target_writes_files_of_a_model_with_many_effects(name: str) -> None:
    target = find_target(name)
    model = exported(EIGHT)
    files = target.files(model)
    assert files and all(isinstance(content, bytes) and content for content in files.values())
    assert all(not PurePosixPath(path).is_absolute() and ".." not in PurePosixPath(path).parts for path in files)
    assert target.files(model) == files  # pure: equal models give equal bytes
    form = target.simplified(model)
    assert {e.name for e in form.estimates} >= {p.name for p in replace(model, result=form).model.parameters}
    assert target.whole or target.lacks(model)  # what costs something says what is lost
    assert target.purpose[0].isupper() and target.purpose[-1] == "."


def test_targets_of_packages_follow_those_of_linid() -> None:
    point = EntryPoint("python", "linid.export.targets.python:TARGET", "linid.exports")
    assert list(collect((), [point])) == ["python"]
    with pytest.raises(ConfigError, match="'python' already"):
        collect(BUILT_IN, [point])


@pytest.mark.parametrize(
    ("target", "fact"),
    [
        (1.0, "found float"),
        (replace(python.TARGET, name="My Target"), "no word"),
        (replace(python.TARGET, purpose=""), "purpose"),
    ],
)
def test_a_malformed_target_is_refused(target: Target, fact: str) -> None:
    with pytest.raises(ConfigError, match=fact):
        check_target(target, "here")


def test_an_unknown_target_is_answered_with_all() -> None:
    with pytest.raises(UsageError, match="python"):
        find_target("cobol")


def test_a_reshaped_model_keeps_what_it_shares() -> None:
    result = exported(EIGHT).result
    form = reshaped(result, effects=(), law="coulomb", values={"mass": 3.0})
    assert form.value("mass") == 3.0 and form.value("coulomb_force") == result.value("coulomb_force")
    assert form.effects == () and form.law == "coulomb"
    assert "bristle_stiffness" not in {e.name for e in form.estimates}


@pytest.mark.parametrize(("text", "word"), [("motor 7", "motor_7"), ("7/b", "axis_7_b"), ("???", "axis")])
def test_names_are_words(text: str, word: str) -> None:
    assert word_of(text) == word
