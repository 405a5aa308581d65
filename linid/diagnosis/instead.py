"""Whether a term does as well as the effects that were named, by the shares of the excess that they leave.

by_term: by the term alone; by_effects: by the effects; beside: of what these leave, by the best term beside them (1:
none).
"""

from __future__ import annotations

from collections.abc import Sequence

from linid.physics.effects.registry import find_effect

INSTEAD = 0.5  # of what the effects leave, with a term beside them: a term that leaves less says that they are none
# Of the excess: an effect of just the term's arguments that leaves less is the cause, in another form.
LEFT_BY_FORM = 0.2
# Of the excess: where effects and the best term beside them leave less, no term alone is looked for in their stead.
NEXT_TO_NOTHING = 0.01
# Times what the effects leave, with a term beside them: what leaves more as found is no better in the model.
HOPELESS = 2.0


def does_without_effects(by_term: float, by_effects: float, beside: float, its_shape: bool) -> bool:
    """Whether a term alone says that the named effects only lent themselves to something else.

    its_shape: whether an effect depends on just the term's arguments. Effects that leave most of the excess to a term,
    and no less with it than another term does alone, are two causes for one; effects that close most of it are not
    given up for a shape.
    """
    if are_its_shape(by_effects, its_shape):
        return False
    two_for_one = not its_shape and beside < 1.0 and by_effects > INSTEAD
    return by_term < INSTEAD * by_effects * beside or (two_for_one and leaves_no_more(by_term, by_effects, beside))


def leave_next_to_nothing(by_effects: float, beside: float) -> bool:
    """Whether effects and the best term beside them leave so little that no term alone does as well."""
    return by_effects * beside < NEXT_TO_NOTHING


def leaves_no_more(by_term: float, by_effects: float, beside: float) -> bool:
    """Whether a term leaves no more than effects and the best term beside them."""
    return by_term <= by_effects * beside


def is_hopeless(by_term: float, by_effects: float, beside: float) -> bool:
    """Whether a term as found leaves so much more that a fit of the model with it is not worth its time."""
    return by_term > HOPELESS * by_effects * beside


def are_its_shape(by_effects: float, its_shape: bool) -> bool:
    """Whether a term is only the shape of an effect of its arguments. Arguments as in `does_without_effects`."""
    return its_shape and by_effects < LEFT_BY_FORM


def of_the_arguments(effects: Sequence[str], arguments: Sequence[str]) -> bool:
    """Whether one of some effects depends on just these arguments: a term of them is its shape, not another cause."""
    return any(set(answer) == set(arguments) for name in effects for answer in find_effect(name).depends_on)
