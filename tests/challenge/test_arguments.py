"""What effects of the library depend on, and the best grade of several honest answers."""

from __future__ import annotations

import pytest

from linid.challenge.arguments import LISTED_ARGUMENTS, best_grade
from linid.diagnosis.proposed.arguments import LABELS
from linid.physics.effects.registry import BUILT_IN


def test_every_effect_of_the_library_has_answers_of_known_arguments() -> None:
    assert set(LISTED_ARGUMENTS) == {effect.name for effect in BUILT_IN}
    for name, answers in LISTED_ARGUMENTS.items():
        assert answers and len({frozenset(one) for one in answers}) == len(answers), name
        assert all(set(one) <= set(LABELS) and len(set(one)) == len(one) for one in answers), name


@pytest.mark.parametrize(
    ("said", "effect", "wanted"),
    [
        (("position",), "cogging", "exact"),
        (("position", "velocity"), "cogging", "related"),
        (("velocity",), "cogging", "wrong"),
        (("velocity",), "asymmetric_friction", "exact"),
        (("direction",), "asymmetric_friction", "exact"),
        (("motor_force", "position"), "current_offset", "exact"),
        ((), "constant_force", "exact"),
        (("position",), "constant_force", "wrong"),
    ],
)
def test_the_best_of_several_answers_counts(said: tuple[str, ...], effect: str, wanted: str) -> None:
    assert best_grade(said, LISTED_ARGUMENTS[effect]) == wanted
