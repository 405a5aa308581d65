"""What a proposed term is like: the effect itself wholly, an unrelated one not at all."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from linid.arrays import Array
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.resembling import LEAST_ALIKE, MOST, refined_by, resemblances
from linid.diagnosis.report_data import Resemblance
from tests.diagnosis.proposed.axis import Force, axis, proposal_of


def pull(problem: Problem) -> Array:
    return np.sin(10.0 * problem.rows.y)


def like(force: Force, form: str, tried: dict[str, Force]) -> tuple[Resemblance, ...]:
    problem = axis(force)
    columns = {name: problem.pushed(one(problem).reshape(problem.mass.size, -1)) for name, one in tried.items()}
    return resemblances(problem, proposal_of(problem, form), columns)


def test_an_effect_is_like_itself() -> None:
    (found,) = like(pull, "position", {"cable_force": pull})
    assert found.alike > 0.98
    assert found.difference == "the same arguments and shape"


def test_an_unrelated_effect_is_not_like_it() -> None:
    def beat(problem: Problem) -> Array:
        return np.sin(40.0 * problem.rows.t)

    assert like(pull, "position", {"external_disturbance": beat, "cable_force": pull})[0].effect == "cable_force"
    assert like(pull, "position", {"external_disturbance": beat}) == ()


def test_what_the_base_can_do_makes_nothing_alike() -> None:
    assert like(pull, "position", {"quadratic_drag": lambda p: p.rows.v}) == ()


def test_the_likest_come_first_and_few_of_them() -> None:
    names = ("cable_force", "cogging", "gravity", "current_offset", "backlash")
    shifts = {name: 0.03 * k for k, name in enumerate(names)}
    tried: dict[str, Force] = {
        name: lambda p, shift=shift: np.sin(10.0 * (p.rows.y - shift)) for name, shift in shifts.items()
    }
    found = like(pull, "position", tried)
    assert len(found) <= MOST
    assert found[0].effect == "cable_force"
    assert all(one.alike >= other.alike > LEAST_ALIKE for one, other in pairwise(found))


def test_another_shape_says_how_much_of_it_is_missing() -> None:
    def half(problem: Problem) -> Array:
        return pull(problem) + 1.0 * np.sin(40.0 * problem.rows.y)

    (found,) = like(half, "position", {"cogging": pull})
    assert (
        found.difference
        == f"the same arguments, another shape: {100 * (1 - found.alike):.2g} % of the term is not reproduced"
    )


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        ("cable_force", "cable force depends on position alone; the term also on motor force"),
        (
            "load_dependent_friction",
            "load dependent friction depends on motor force and direction of motion; "
            "the term on position and motor force",
        ),
    ],
)
def test_other_arguments_are_said(effect: str, words: str) -> None:
    def force(problem: Problem) -> Array:
        return 0.1 * pull(problem) * problem.push

    (found,) = like(force, "position x motor force", {effect: force})
    assert found.difference == words


def test_an_effect_of_more_arguments() -> None:
    (found,) = like(lambda p: -(p.rows.v**3), "velocity", {"thermal_derating": lambda p: p.rows.v**3})
    assert found.difference == "thermal derating depends on motor force and time in the campaign; the term on velocity"
    (found,) = like(pull, "position", {"position_dependent_friction": pull})
    assert found.difference == "position dependent friction depends on direction of motion too; the term does not"


def test_a_constant_force_is_the_same_everywhere() -> None:
    (found,) = like(lambda p: 1.0 + 0.3 * pull(p), "position", {"constant_force": lambda p: np.ones(p.mass.size)})
    assert found.difference == "constant force is the same everywhere; the term depends on position"


def test_an_effect_that_does_not_say_what_it_depends_on() -> None:
    (found,) = like(pull, "position", {"my_pull: c * sin(10 * y)": pull})
    assert found.difference.endswith("of the term is not reproduced")


def test_what_depends_on_the_same_as_a_named_effect_may_be_the_rest_of_its_form() -> None:
    named = ("cogging", "eddy_current_drag", "friction_drift", "constant_force")
    assert refined_by(named, ("position",)) == ("cogging",)
    assert refined_by(named, ("velocity",)) == ("eddy_current_drag",)
    # By direction alone, or by velocity.
    assert refined_by(named, ("velocity", "time")) == refined_by(named, ("direction", "time")) == ("friction_drift",)
    # More or fewer arguments are another cause, and so is a constant beside one.
    assert refined_by(named, ("position", "velocity")) == refined_by(named, ("time",)) == refined_by(named, ()) == ()
