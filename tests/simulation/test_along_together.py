"""Candidates along a motion share what they can of the bristle's way and of effects: no bit hangs on the company."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.physics.model import MOTOR_START, Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator

T = np.arange(0.0, 0.4, 1e-3)
MODELS = {
    "plain": Model("sine"),
    "force": Model("sine", ("constant_force", "cogging")),
    "level": Model("sine", ("position_dependent_friction",)),
    "load": Model("sine", ("load_dependent_friction",)),
    "thrust": Model("sine", ("end_effect", "cogging", "quadratic_drag")),
    "drift": Model("sine", ("friction_drift", "asymmetric_friction")),
    "late": Model("sine", ("input_delay", "cogging")),
    "field": Model("sine", ("pole_pitch_error", "position_dependent_friction")),
    "own force": Model("sine", ("way: c * cos(90 * y) + d * v", "cogging")),
    "own share": Model("sine", ("way: F * (c * cos(90 * y) + d * abs(v))", "force_ripple")),
    "own friction": Model("sine", ("grip: (c * cos(90 * y) + d * stribeck) * sign(v)", "asymmetric_friction")),
    "own load": Model("sine", ("grip: (c * abs(F) + d * acceleration) * sign(v)", "load_dependent_friction")),
    "state": Model("sine", ("drive_train_backlash",)),
    "dahl": Model("sine", law="dahl"),
    "elasto_plastic": Model("sine", law="elasto_plastic"),
    "maxwell_slip": Model("sine", law="maxwell_slip"),
}


def motion(seed: int) -> tuple[Recording, np.ndarray, np.ndarray]:
    """A recording that rests in its middle, its speed (fast sliding forgets all but F_C), and where it stands still."""
    generator = np.random.default_rng(seed)
    v = 0.5 * np.sin(2 * np.pi * generator.uniform(3.0, 9.0) * T + generator.uniform(0.0, 6.0))
    rests = (T > 0.15) & (T < 0.2)
    v[rests] = 0.0
    y = np.cumsum(v) * 1e-3
    currents = 0.5 * np.sin(30.0 * T + np.array([[0.0], [2.0], [4.0]]))
    return Recording("r", T, y, phase_currents=currents), v, rests


def population(model: Model, size: int, generator: np.random.Generator) -> np.ndarray:
    """Candidates of which some share their friction, all but friction, or all but one value with the one before."""
    rows: list[np.ndarray] = []
    for k in range(size):
        values = {
            p.name: p.default * (1.0 + 0.3 * generator.random())
            if p.log
            else generator.uniform(max(p.lower, -9.0), min(p.upper, 9.0))
            for p in model.parameters
        }
        values["static_force"] = values["coulomb_force"] * 1.5
        row = model.vector(values)
        kind = generator.integers(4) if k else 3
        if kind == 0:
            row[:MOTOR_START] = rows[-1][:MOTOR_START]
        elif kind == 1:
            row[MOTOR_START:] = rows[-1][MOTOR_START:]
        elif kind == 2:
            place = model.slot(model.parameters[int(generator.integers(len(model.parameters)))].name)
            row = np.where(np.arange(row.size) == place, row, rows[-1])
        rows.append(row)
    return np.array(rows)


@pytest.mark.parametrize("name", MODELS)
@given(st.integers(0, 2**32 - 1), st.integers(2, 9), st.booleans(), st.integers(1, 3))
@settings(max_examples=20, deadline=None)
def test_candidates_have_the_same_bits_alone(name: str, seed: int, size: int, wanted: bool, jobs: int) -> None:
    generator = np.random.default_rng(seed)
    model, parts = MODELS[name], [motion(seed), motion(seed + 1)]
    simulator = Simulator(model, pack_inputs([part[0] for part in parts]), 1, jobs)
    v, rests = (np.concatenate([part[k] for part in parts]) for k in (1, 2))
    y = np.concatenate([part[0].y for part in parts])
    candidates = population(model, size, generator)
    start = np.full((size, 2), np.nan)
    some = generator.random(y.size) < 0.02 if wanted else None

    def run(rows: slice) -> list[np.ndarray]:
        one = simulator.along(
            candidates[rows], y, v, rests, start[rows], without="acceleration" if wanted else "", wanted=some
        )
        return [one.bristle, one.states, *([] if wanted else [one.acceleration])]

    together = run(slice(None))
    for k in range(size):
        for all_of_them, alone in zip(together, run(slice(k, k + 1)), strict=True):
            assert np.array_equal(
                all_of_them[k : k + 1] if all_of_them.shape[0] > 1 else all_of_them, alone, equal_nan=True
            )


SKIPPED = {
    "plain": (Model("sine"), {}),
    "level": (Model("sine", ("position_dependent_friction",)), {}),
    "load": (Model("sine", ("load_dependent_friction",)), {}),
    "own": (Model("sine", ("learned: (c_1 * cos(90 * y) + c_2 * stribeck) * sign(v)",)), {"learned_c_1": 3.0}),
}


@pytest.mark.parametrize("name", SKIPPED)
@pytest.mark.parametrize("seed", range(5))
def test_what_is_not_followed_is_forgotten(name: str, seed: int) -> None:
    """A bristle that is wanted now and then is followed over a part of the way, and is where the whole way leads it.

    Friction of the own term reaches four times that of the axis.
    """
    model, given_values = SKIPPED[name]
    recording, v, rests = motion(seed)
    simulator = Simulator(model, pack_inputs([recording]), 1, 1)
    values = {p.name: p.default for p in model.parameters} | {"coulomb_force": 1.0, "static_force": 1.2} | given_values
    candidates = model.vector(values)[None, :]
    wanted = np.random.default_rng(seed).random(v.size) < 0.01
    wanted[-1] = True
    arguments = (candidates, recording.y, v, rests, np.full((1, 1), np.nan))
    followed = simulator.along(*arguments, without="acceleration").bristle[0]
    parts = simulator.along(*arguments, without="acceleration", wanted=wanted).bristle[0]
    assert np.count_nonzero(np.isfinite(parts)) < 0.9 * v.size
    # where an axis that moved has forgotten where it came from
    assert parts[wanted] == pytest.approx(followed[wanted], abs=1e-9 * np.max(np.abs(followed)))


def test_recordings_that_nobody_wants_hold_zeros() -> None:
    """Whoever wants some of them still reckons with all: what memory happened to hold raised warnings there."""
    model, parts = Model("sine", ("encoder_periodic_error",)), [motion(1), motion(2)]
    simulator = Simulator(model, pack_inputs([part[0] for part in parts]), 1, 1)
    v, rests = (np.concatenate([part[k] for part in parts]) for k in (1, 2))
    y, size = np.concatenate([part[0].y for part in parts]), parts[0][1].size
    candidates, start = population(model, 3, np.random.default_rng(1)), np.full((3, 2), np.nan)
    whole = simulator.along(candidates, y, v, rests, start)
    part = simulator.along(candidates, y, v, rests, start, among=np.array([False, True]))
    assert whole.reading_error is not None and part.reading_error is not None
    for all_of_them, some in (
        (whole.acceleration, part.acceleration),
        (whole.bristle, part.bristle),
        (whole.reading_error, part.reading_error),
    ):
        assert np.array_equal(some[:, size:], all_of_them[:, size:]) and not np.any(some[:, :size])
    tangents = np.eye(candidates.shape[1])[[model.slot("coulomb_force"), model.slot("force_constant")]]
    slopes, _ = simulator.slopes_along(candidates[0], tangents, y, v, rests, among=np.array([False, True]))
    assert np.any(slopes[:, size:]) and not np.any(slopes[:, :size])
