"""True shares of the gap: additive, order-free, blind to what the base absorbs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from linid.challenge.catalogue import LISTED, HiddenEffect
from linid.challenge.hidden_axis import HiddenAxis
from linid.challenge.plant import simulate
from linid.challenge.truth import contributions, true_shares
from linid.stand.modes import command
from tests.challenge.conftest import effect


@pytest.fixture(scope="module")
def split(calm: HiddenAxis) -> HiddenAxis:
    """The calm axis with both splits among its recordings."""
    held = {"freewheel_4", "sine_position_2", "moves_3"}
    modes = [m.model_copy(update={"split": "held_out" if m.name in held else "fit"}) for m in calm.campaign]
    return calm.model_copy(update={"campaign": tuple(modes)})


def causes(
    axis: HiddenAxis, name: str, effects: Sequence[HiddenEffect]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Contributions, reading errors, true and base acceleration along one recording, and its mass."""
    mode = next(m for m in axis.campaign if m.name == name)
    caused, errors, _ = contributions(axis, mode, effects, 0, command(mode, axis))
    run = simulate(axis, mode, effects, substeps=2)
    return caused, errors, run.acceleration, run.base_acceleration, run.mass


@pytest.mark.parametrize("name", LISTED)
def test_a_single_effect_causes_all_that_the_base_misses(split: HiddenAxis, name: str) -> None:
    hidden = effect(name, split)
    hidden = replace(hidden, recordings=("moves_1",)) if hidden.recordings else hidden
    caused, errors, true, base, _ = causes(split, "moves_1", [hidden])
    scale = float(np.sqrt(np.mean((true - base) ** 2)))
    # Led along the motion by steps five times as long, the base gives what the plant itself logs for it.
    assert np.sqrt(np.mean((caused[0] - (true - base)) ** 2)) < 2e-3 * scale + 1e-6
    assert not caused[1].any() and errors[0].any() == (name in ("encoder_periodic_error", "backlash"))


def test_a_single_effect_has_the_whole_gap(split: HiddenAxis) -> None:
    for name in ("cogging", "encoder_periodic_error", "thermal_derating"):
        truth = true_shares(split, [effect(name, split, 2.0)])
        assert truth.shares == {name: pytest.approx(1.0)} and truth.unexplained == pytest.approx(0.0, abs=1e-12)
        assert truth.gap > 0


def test_contributions_are_the_forces_they_stand_for(split: HiddenAxis) -> None:
    hidden = [
        effect("constant_force", split),
        replace(effect("payload_change", split), recordings=("moves_1",)),
        effect("quadratic_drag", split),
    ]
    caused, _, true, base, mass = causes(split, "moves_1", hidden)
    assert caused.sum(axis=0) == pytest.approx(true - base, abs=1e-4)
    payload = hidden[1].amplitude
    # Alone the force moves the bare mass, with all others the loaded one: the mean of both.
    expected = hidden[0].amplitude * (1 / mass + 1 / (mass + payload)) / 2
    assert caused[0] == pytest.approx(expected, rel=2e-3)


def test_shares_sum_to_one_in_any_order(split: HiddenAxis) -> None:
    names = ("cogging", "friction_drift", "thermal_derating", "floor_vibration", "input_delay")
    hidden = [effect(name, split, 2.0) for name in names]
    truth = true_shares(split, hidden)
    assert sum(truth.shares[name] for name in names if name in LISTED) + truth.unexplained == pytest.approx(1.0)
    assert truth.unexplained == pytest.approx(truth.shares["floor_vibration"]) and truth.unexplained > 0.02
    turned = true_shares(split, hidden[::-1])
    assert turned.gap == pytest.approx(truth.gap)
    assert {name: turned.shares[name] for name in names} == pytest.approx(truth.shares)


def test_shares_are_shapley_values_of_what_is_still_missing(split: HiddenAxis) -> None:
    """Counted over all subsets, each with the base refitted, for forces that add up."""
    from linid.challenge import truth as module

    names = ("constant_force", "cogging", "quadratic_drag", "cable_force")
    hidden = [effect(name, split, 2.0) for name in names]
    found = true_shares(split, hidden)
    parts = [module._rows(split, mode, hidden, k, command(mode, split)) for k, mode in enumerate(split.campaign)]
    least = 0.3 * float(np.median([part.scale for part in parts]))

    def missing(inside: tuple[int, ...]) -> float:
        rest = [part.causes[[k for k in range(len(names)) if k not in inside]].sum(axis=0) for part in parts]
        weights = [1 / max(part.scale, least) for part in parts]
        fit = [k for k, part in enumerate(parts) if not part.held_out]
        base = np.hstack([parts[k].base * weights[k] for k in fit])
        sizes = np.linalg.norm(base, axis=1) + 1e-300
        target = np.hstack([rest[k] * weights[k] for k in fit])
        taken = np.linalg.lstsq((base.T / sizes), target, rcond=1e-6)[0] / sizes
        left = [(rest[k] - taken @ part.base) * weights[k] for k, part in enumerate(parts) if part.held_out]
        return float(np.mean(np.hstack(left) ** 2))

    whole = missing(())
    n = len(names)
    for k, name in enumerate(names):
        others = [j for j in range(n) if j != k]
        value = 0.0
        for size in range(n):
            weight = math.factorial(size) * math.factorial(n - size - 1) / math.factorial(n)
            for inside in combinations(others, size):
                value += weight * (missing(inside) - missing((*inside, k)))
        assert found.shares[name] == pytest.approx(value / whole, abs=1e-5)
    assert found.gap == pytest.approx(whole)


def test_what_the_base_absorbs_does_not_count(split: HiddenAxis) -> None:
    everywhere = replace(effect("payload_change", split, 4.0), recordings=tuple(m.name for m in split.campaign))
    driven = replace(everywhere, recordings=("moves_1", "moves_3"))
    # An extra mass in all driven recordings and free wheels is a larger mass; in some it is a payload.
    assert true_shares(split, [driven]).gap > 0.05
    absorbed = true_shares(split, [everywhere, effect("quadratic_drag", split, 3.0)])
    counted = true_shares(split, [driven, effect("quadratic_drag", split, 3.0)])
    assert abs(absorbed.shares["payload_change"]) < 0.1 * abs(counted.shares["payload_change"]) + 0.01


def test_nothing_hidden_is_no_gap_unless_the_law_is_another(split: HiddenAxis) -> None:
    assert true_shares(split, []).gap < 1e-6
    other = split.model_copy(update={"law": "maxwell"})
    truth = true_shares(other, [effect("cogging", other)])
    assert truth.shares["cogging"] + truth.unexplained == pytest.approx(1.0) and truth.unexplained != 0.0
