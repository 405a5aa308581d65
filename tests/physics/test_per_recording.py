"""Effects of single recordings say themselves where they act, and what of them is searched."""

from __future__ import annotations

from dataclasses import replace

import pytest

from linid.errors import ConfigError
from linid.physics.effects import constant_force, external_disturbance, payload_change
from linid.physics.effects.effect import Effect, check_effect
from linid.physics.effects.registry import EFFECTS
from linid.physics.parameter import Parameter

FORCE, PAYLOAD, PUSH = constant_force.EFFECT, payload_change.EFFECT, external_disturbance.EFFECT
SINGLE = [effect for effect in EFFECTS if effect.per_recording]


def marks(effect: Effect) -> dict[int, float]:
    """The mark of each of the recordings 1, 2, 3 and 50."""
    return {n: float(n) if effect.acts == "one" else 2.0 ** (n - 1) for n in (1, 2, 3, 50)}


def touched(effect: Effect, values: dict[str, float], record: int) -> bool:
    """Whether any term does anything in the middle of a recording."""
    parameters = [values.get(p.name, p.default) for p in effect.parameters]
    common = (0.5, 0.1, 0.3, 0.2, 0.0, 0.0, float(record), 1.0)
    arguments = {"mass": (float(record),)}
    neutral = {"thrust": 1.0, "friction": 1.0, "level": 1.0}
    return any(
        term.py_func(*arguments.get(name, common), *parameters) != neutral.get(name, 0.0)
        for name, term in effect.terms.items()
    )


def active(effect: Effect) -> dict[str, float]:
    """Values with which part 1 acts in the middle of its recording."""
    values = {name: 0.5 for name in effect.amplitudes_of_part(1)}
    if effect is PUSH:
        values |= {p.name: 1.0 for p in PUSH.part(1) if "duration" in p.name}
    return values


def test_those_that_act_in_single_recordings() -> None:
    assert (PUSH.acts, PAYLOAD.acts) == ("one", "some") and {PUSH, PAYLOAD} <= set(SINGLE)
    assert FORCE.acts_in({}, 7) and not FORCE.per_recording


@pytest.mark.parametrize("effect", SINGLE, ids=lambda e: e.name)
def test_the_terms_act_where_the_effect_says(effect: Effect) -> None:
    for marked, mark in marks(effect).items():
        values = active(effect) | {effect.mark: mark}
        for number in (0, 1, 2, 3, 49, 50, 51):
            assert effect.acts_in(values, number) == touched(effect, values, number) == (number == marked), number
        assert effect.acts_in({effect.mark: mark}, marked)
        assert not effect.acts_in(dict.fromkeys(effect.amplitudes, 0.0) | {effect.mark: mark}, marked)
    assert not any(effect.acts_in({}, number) for number in (0, 1, 2))


def test_a_payload_marks_several() -> None:
    values = active(PAYLOAD) | {"payload_recordings": 1.0 + 4.0 + 2.0**49}
    for number in (1, 2, 3, 4, 50):
        assert PAYLOAD.acts_in(values, number) == touched(PAYLOAD, values, number) == (number in (1, 3, 50))


def test_parts_hold_what_acts_nowhere() -> None:
    assert PAYLOAD.held({"payload_mass": 2.0, "payload_recordings": 4.0}) == {"payload_recordings": 4.0}
    assert FORCE.held({"constant_force": 2.0}) == {}
    assert PAYLOAD.part(1) == PAYLOAD.parameters and PAYLOAD.moved({"payload_mass": 2.0}, 1) == {"payload_mass": 2.0}
    assert FORCE.free_part({}) == 0


def mark(name: str) -> Parameter:
    return Parameter(name, "n", "1", 0.0, 100.0, 0.0, meaning="recording")


@pytest.mark.parametrize(
    ("effect", "fact"),
    [
        (replace(FORCE, acts="few"), "acts in 'few'"),
        (replace(FORCE, acts="one"), "do not go together"),
        (replace(PAYLOAD, acts="all"), "do not go together"),
        (replace(PAYLOAD, mark="payload_mass"), "not among its `preset`"),
        (replace(PAYLOAD, mark="other"), "not among its `preset`"),
        (replace(FORCE, parts=2), "no mark of part 1"),
        (replace(PAYLOAD, parts=2), "no mark of part 1"),
        (
            replace(
                FORCE,
                parameters=(mark("a_1"), mark("a_2"), mark("b_1")),
                amplitudes=("a_1",),
                preset=("b_1",),
                mark="b_1",
                acts="one",
                parts=2,
            ),
            "2 equal parts",
        ),
    ],
)
def test_a_malformed_mark_is_refused(effect: Effect, fact: str) -> None:
    with pytest.raises(ConfigError, match=fact):
        check_effect(effect, "here")
