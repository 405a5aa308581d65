"""The balance of forces and predictions behind play between motor and reading."""

from __future__ import annotations

import numpy as np
import pytest

from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.behind_play import along_measured
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from tests.simulation.axis_with_effects import AXIS, SAMPLES, campaign_with, simulate

NAME = "backlash"
MODEL = Model("sine", (NAME,))
VECTOR = MODEL.vector(AXIS | SAMPLES[NAME])
PLAY = SAMPLES[NAME]["backlash_gap"]
NOISE = 1e-6
NONE = np.zeros((1, 0))
SEARCHED = ("bristle_stiffness", "coulomb_force", "viscous_friction", "mass", "force_constant", "backlash_gap")


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def driven() -> tuple:
    return tuple(r for r in campaign_with((NAME,), noise=NOISE) if r.phase_currents is not None)[:2]


def tangents() -> tuple[np.ndarray, np.ndarray]:
    """Directions along single parameters, and their sizes, SI."""
    out = np.zeros((len(SEARCHED), VECTOR.size))
    for k, name in enumerate(SEARCHED):
        out[k, MODEL.slot(name)] = abs(VECTOR[MODEL.slot(name)])
    return out, np.full(len(SEARCHED), 1e-4)


def test_the_motors_motion_is_told() -> None:
    """Its hidden state and its position are those of the simulation behind the reading, to a tenth of the play."""
    one = campaign_with((NAME,), noise=NOISE)[5]
    part = Ahead(MODEL, (one,), 8, 1)
    start = (one.y[0], 0.0, np.nan)
    along = along_measured(part.simulator, VECTOR[None], part.motion)
    moving = np.abs(part.motion.v) > 0.02
    assert along.reading_error is not None and np.count_nonzero(moving) > 500
    np.testing.assert_allclose(along.reading_error[0], -0.5 * PLAY * along.states[0, :, 0], atol=1e-12)
    assert set(np.sign(along.states[0, moving, 0])) == {-1.0, 1.0}
    assert np.mean(np.sign(along.states[0, moving, 0]) == np.sign(part.motion.v[moving])) > 0.98
    motor = simulate((), one, start, 8, values={})  # the reading takes no part in what drives it
    read = simulate((NAME,), one, start, 8, values=SAMPLES[NAME])
    told = along.states[0, :, 0] * 0.5 * PLAY
    assert rms(told[moving] - (motor - read)[moving]) < 0.1 * PLAY


def test_the_slopes_of_the_balance_are_those_of_differences() -> None:
    part = Acceleration(MODEL, driven(), 1)
    directions, steps = tangents()
    slopes = part.slopes(VECTOR, directions)
    for slope, direction, step in zip(slopes, directions, steps, strict=True):
        ends = part.model_acceleration(np.vstack([VECTOR + step * direction, VECTOR - step * direction]))
        differences = (ends[0] - ends[1]) / (2.0 * step)
        assert rms(slope - differences) < 0.02 * rms(differences)


def test_the_slopes_of_predictions_are_those_of_differences() -> None:
    """In most windows: where a contact comes a step earlier, differences of whole runs are large."""
    part = Ahead(MODEL, driven(), 8, 1)
    directions, steps = tangents()
    assert part.carries_slopes
    _, slopes = part._predicted(VECTOR, directions)
    for slope, direction, step in zip(slopes.T, directions, steps, strict=True):
        ends = part.simulate(np.vstack([VECTOR + step * direction, VECTOR - step * direction]))
        differences = (ends[0] - ends[1]) / (2.0 * step)
        assert np.median(np.abs(slope - differences)) < 0.03 * rms(differences)


def test_candidates_keep_to_themselves() -> None:
    """One candidate among others of other plays is what it is alone, to the last bit."""
    others = np.array([VECTOR, VECTOR, VECTOR])
    others[1, MODEL.slot("backlash_gap")] *= 0.5
    others[2, MODEL.slot("coulomb_force")] *= 1.1
    for part in (Acceleration(MODEL, driven(), 1), Ahead(MODEL, driven(), 8, 1)):
        together = part.residuals(others, np.zeros((3, 0)))
        for k in range(3):
            np.testing.assert_array_equal(together[k], part.residuals(others[k : k + 1], NONE)[0])


def test_without_play_nothing_is_hidden() -> None:
    plain = Model("sine")
    vector = MODEL.vector(AXIS | {"backlash_gap": 0.0})
    for kind in (lambda model: Acceleration(model, driven(), 1), lambda model: Ahead(model, driven(), 8, 1)):
        with_it, without = (
            kind(MODEL).residuals(vector[None], NONE),
            kind(plain).residuals(plain.vector(AXIS)[None], NONE),
        )
        np.testing.assert_allclose(with_it, without, atol=1e-9 * rms(without) + 1e-15)


def test_windows_that_begin_beside_a_wait_are_predicted_to_the_noise() -> None:
    """Most of them; where the motor is about to turn, the noise of its speed decides when it meets the other side."""
    recordings = campaign_with((NAME,), noise=NOISE)
    part = Ahead(MODEL, tuple(recordings), 8, 1)
    base = Ahead(Model("sine"), tuple(recordings), 8, 1)
    errors = []
    for one, vector in ((part, VECTOR), (base, Model("sine").vector(AXIS))):
        squares = one.residuals(vector[None], NONE)[0] ** 2
        errors.append(np.sqrt(np.add.reduceat(squares, one.segments.out_offsets[:-1]) / one.segments.count))
    begins = zip(part.segments.recording, part.segments.first, strict=True)
    clear = np.array([not any(w.start - 1 < k < w.end + 1 for w in recordings[r].motion.waits) for r, k in begins])
    assert np.count_nonzero(clear) > 100
    assert np.median(errors[0][clear]) < 1.25 * NOISE
    assert rms(errors[0]) < 0.1 * rms(errors[1])


def test_the_effect_says_that_it_is_play() -> None:
    effect = find_effect(NAME)
    assert effect.play in effect.amplitudes and effect.told


@pytest.mark.parametrize("name", [n for n in SAMPLES if n != NAME])
def test_no_other_effect_is_play(name: str) -> None:
    assert find_effect(name).play == ""
