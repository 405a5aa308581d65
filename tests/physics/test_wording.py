"""Texts and units fit the axis that they are told of."""

from __future__ import annotations

import re

import pytest

from linid.identification.uncertainty.identifiability import ADVICE, advice
from linid.physics.effects.registry import EFFECTS
from linid.physics.wording import fitting_words, scaled_unit

LINEAR_ONLY = re.compile(r"stroke|mm/s|pole pitch|guideway|added mass")


def texts(axis: str, kind: str) -> list[str]:
    """All advice on effects and parameters."""
    return [fitting_words(e.exposed_by, axis, kind) for e in EFFECTS] + [advice(name, axis, kind) for name in ADVICE]


@pytest.mark.parametrize("kind", ["friction", "force", "sine"])
def test_a_rotary_axis_is_not_told_of_strokes(kind: str) -> None:
    assert any(LINEAR_ONLY.search(text) for text in texts("linear", kind))
    assert not [text for text in texts("rotary", kind) if LINEAR_ONLY.search(text)]


@pytest.mark.parametrize("axis", ["linear", "rotary"])
def test_phases_are_for_motors_that_have_them(axis: str) -> None:
    assert any("one phase" in text for text in texts(axis, "sine"))
    assert not [text for text in texts(axis, "force") if "phase" in text]


def test_words_that_fit_stay() -> None:
    for axis, kind in (("linear", "force"), ("rotary", "sine"), ("rotary", "force")):
        for text in texts(axis, kind):
            assert fitting_words(text, axis, kind) == text
    for effect in EFFECTS:
        assert fitting_words(effect.exposed_by, "linear", "sine") == effect.exposed_by
    sentence = "Record one slow move to and fro over the whole stroke at 20 mm/s, and the added mass."
    assert fitting_words(sentence, "linear", "force") == sentence
    assert fitting_words("moves over the whole stroke at 2 rad/s", "rotary", "force") == (
        "moves over whole revolutions at 2 rad/s"
    )


def test_units_of_what_no_recording_scales() -> None:
    assert [scaled_unit(u, "linear", "kg") for u in ("N", "N s/m", "m/s", "1")] == ["N/kg", "N s/(m kg)", "m/s", "1"]
    assert [scaled_unit(u, "rotary", "kg m^2") for u in ("N m", "N m s/rad", "rad")] == [
        "rad/s^2",
        "N m s/rad per kg m^2",
        "rad",
    ]
    for unit in ("N", "N m", "N/A"):
        assert scaled_unit(unit, "linear", "") == unit
        once = scaled_unit(unit, "rotary", "kg m^2")
        assert scaled_unit(once, "rotary", "kg m^2") == once
