"""What effects do at all samples at once is what they do sample by sample, to the last bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit

from linid.arrays import Array
from linid.physics.effects.registry import EFFECTS, active_mask
from linid.physics.model import EFFECT_SLOTS, RECORD, WORK_SIZE
from linid.simulation.along_effects import Samples
from linid.simulation.terms import terms_of

TERMS = terms_of()
COUNT = 37  # no multiple of any number of lanes


def _samples(random: np.random.Generator) -> Samples:
    y, v, i_1, i_2, i_3 = random.standard_normal((5, COUNT)) * np.array([0.3, 0.5, 3.0, 3.0, 3.0])[:, None]
    v[::5] = 0.0
    return Samples(0.25, 1e-3, y, v, i_1, i_2, i_3)


def _vector(random: np.random.Generator, effect: Any) -> Array:
    """Parameters anywhere in their bounds, those of scales by their logarithm."""
    p = np.zeros(WORK_SIZE)
    p[RECORD] = 3.0
    for one in effect.parameters:
        share = random.random()
        scaled = (
            one.lower * (one.upper / one.lower) ** share if one.log else one.lower + share * (one.upper - one.lower)
        )
        p[EFFECT_SLOTS[one.name]] = scaled
    return p


def _both(term: str) -> tuple[Any, Any]:
    """The term at all samples, and sample by sample, on values that are there already."""
    over, each = getattr(TERMS.over, term), getattr(TERMS, term)
    if term == "drive":

        @njit
        def at_once(out: Array, on: int, samples: Samples, p: Array) -> None:
            over(out, on, samples, p)

        @njit
        def in_turn(out: Array, on: int, samples: Samples, p: Array) -> None:
            for k in range(samples.y.size):
                t, currents = samples.t_start + k * samples.dt, (out[0, k], out[1, k], out[2, k])
                out[0, k], out[1, k], out[2, k] = each(on, t, samples.y[k], samples.v[k], currents, p)

        return at_once, in_turn
    if term == "load":  # beside the samples, of the motor's force: what the second input is

        @njit
        def loads_at_once(out: Array, on: int, samples: Samples, p: Array) -> None:
            over(out[0], samples.i_2, on, samples, p)

        @njit
        def loads_in_turn(out: Array, on: int, samples: Samples, p: Array) -> None:
            for k in range(samples.y.size):
                t, currents = samples.t_start + k * samples.dt, (samples.i_1[k], samples.i_2[k], samples.i_3[k])
                out[0, k] = each(out[0, k], on, samples.i_2[k], t, samples.y[k], samples.v[k], currents, p)

        return loads_at_once, loads_in_turn

    @njit
    def all_at_once(out: Array, on: int, samples: Samples, p: Array) -> None:
        over(out[0], on, samples, p)

    @njit
    def one_by_one(out: Array, on: int, samples: Samples, p: Array) -> None:
        for k in range(samples.y.size):
            t, currents = samples.t_start + k * samples.dt, (samples.i_1[k], samples.i_2[k], samples.i_3[k])
            out[0, k] = each(out[0, k], on, t, samples.y[k], samples.v[k], currents, p)

    return all_at_once, one_by_one


@pytest.mark.parametrize("term", [name for name, _ in TERMS.over])
def test_all_samples_at_once_have_the_bits_of_each_alone(term: str) -> None:
    able = [effect for effect in EFFECTS if term in effect.terms and not effect.states_of(term)]
    at_once, in_turn = _both(term)
    assert able
    for number, effect in enumerate(able):
        random, changed = np.random.default_rng([7, number]), False
        for _ in range(20):
            samples, p, on = _samples(random), _vector(random, effect), active_mask((effect.name,))
            begun = np.array([samples.i_1, samples.i_2, samples.i_3])
            if term == "field":
                begun[0] = samples.y
            found, expected = begun.copy(), begun.copy()
            at_once(found, on, samples, p)
            in_turn(expected, on, samples, p)
            assert np.array_equal(found, expected, equal_nan=True), effect.name
            changed = changed or not np.array_equal(found, begun)
        assert changed or effect.per_recording, effect.name  # which need not be this recording, at these moments


@pytest.mark.parametrize("term", [name for name, _ in TERMS.over])
def test_effects_that_are_off_or_take_hidden_states_change_nothing(term: str) -> None:
    samples, begun = _samples(np.random.default_rng(1)), np.ones((3, COUNT))
    found = begun.copy()
    at_once, _ = _both(term)
    stateful = tuple(effect.name for effect in EFFECTS if term in effect.terms and effect.states_of(term))
    for names in ((), stateful):
        at_once(found, active_mask(names), samples, np.zeros(WORK_SIZE))
        assert np.array_equal(found, begun)
