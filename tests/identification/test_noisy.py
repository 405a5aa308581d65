"""Objectives under noise of the inputs: packed anew only where the noise reaches, and stepping where they did."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.noisy import Draw, Parts, answers_under_noise, driven, opposite_draws, under_noise
from linid.identification.objectives.problem import Problem
from linid.identification.signals.motion import input_jumps, input_noise, with_inputs_moved
from linid.identification.space.bounds import build_space
from linid.physics.model import Model
from linid.recording.input_course import input_coefficients
from linid.recording.jumps import find_jumps
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs

from .stand import FREE_WHEELS, stand

MODEL = Model("sine")
ONLY = (*FREE_WHEELS, "sine_current_2", "square_current_1")


def recordings(kind: str) -> tuple[Recording, ...]:
    return tuple(r for r in stand(only=ONLY).recordings if r.kind == kind)


def both() -> Problem:
    truth = stand(only=ONLY).truth
    values = {p.name: truth.get(p.name, p.default) for p in MODEL.parameters}
    everything = (*recordings("free_wheel"), *recordings("motor"))
    space = build_space(MODEL, everything, values, {}, {}, False, (), True)
    return Problem(space, (FreeRun(MODEL, recordings("free_wheel"), 2, 1), Ahead(MODEL, recordings("motor"), 2, 1)))


@pytest.mark.parametrize("jobs", [1, 2])
def test_no_more_draws_are_there_at_once_than_threads(jobs: int) -> None:
    """Each has packed inputs of its own, of long recordings hundreds of MB."""
    part, drawn, answered = both().parts[1], [0], [0]

    def draws() -> Iterator[Draw]:
        for draw in opposite_draws((part,), 3, np.random.default_rng(3)):
            drawn[0] += 1
            assert drawn[0] <= answered[0] + jobs
            yield draw

    def ask(parts: Parts) -> float:
        (moved,) = parts
        return float(np.max(moved.recordings[0].phase_currents))

    wanted = [float(np.max(one[0][0].phase_currents)) for one in opposite_draws((part,), 3, np.random.default_rng(3))]
    for answer in answers_under_noise((part,), draws(), ask, jobs):
        assert answer == wanted[answered[0]]
        answered[0] += 1
    assert answered[0] == 6


def test_moved_inputs_give_what_an_objective_on_such_recordings_gives() -> None:
    problem = both()
    part = problem.parts[1]
    params = problem.space.vectors(np.full((2, len(problem.space.names)), 0.5))
    smooth = [r for r in part.recordings if r.name == "sine_current_2"]
    part = Ahead(MODEL, tuple(smooth), 2, 1)
    draws = list(opposite_draws((part,), 2, np.random.default_rng(3)))
    assert len(draws) == 4
    for (moved,) in draws:
        anew = Ahead(MODEL, tuple(replace(r, before_noise=None) for r in moved), 2, 1)
        under = under_noise(part, moved)
        none = np.zeros((2, 0))
        plain = part.residuals(params, none)
        noise = anew.residuals(params, none) - plain  # of some nm; splines of sums are sums of splines
        np.testing.assert_allclose(under.residuals(params, none) - plain, noise, rtol=0.0, atol=1e-6 * np.ptp(noise))
        assert np.ptp(noise) > 1e-9
    up, down = (one[0][0].phase_currents for one in draws[:2])
    assert up is not None and down is not None
    np.testing.assert_allclose(up + down, 2.0 * smooth[0].phase_currents, atol=1e-12)


def test_noise_passes_for_no_jump() -> None:
    square = next(r for r in recordings("motor") if r.name == "square_current_1")
    assert square.phase_currents is not None
    jumps = find_jumps(square.phase_currents)
    assert jumps
    loud = 20.0 * input_noise(square, np.random.default_rng(2))
    moved = with_inputs_moved(square, loud)
    assert moved.phase_currents is not None and find_jumps(moved.phase_currents) != jumps
    assert np.array_equal(input_jumps(moved), input_jumps(square))
    before = pack_inputs([square]).coefficients
    again = with_inputs_moved(moved, -loud)
    assert again.before_noise is square
    np.testing.assert_allclose(pack_inputs([again]).coefficients, before, rtol=1e-6, atol=1e-6 * np.abs(before).max())


@pytest.mark.parametrize("stated", ["detected", "linear", "hold"])
def test_noise_goes_between_the_samples_as_the_inputs_do(stated: Any) -> None:
    """Noise added to a smooth input gives the coefficients of the noisy input, whatever goes between the samples; added
    to one that steps, it gives those of the input and, on top, a course of its own without a step."""
    smooth, square = (next(r for r in recordings("motor") if r.name == name) for name in ("sine_current_2", ONLY[-1]))
    for one in (smooth, square):
        before = replace(one, between_samples=stated)
        noise = input_noise(before, np.random.default_rng(2))
        moved = with_inputs_moved(before, noise)
        packed, alone = pack_inputs([moved]), pack_inputs([before])
        own = packed.coefficients - alone.coefficients
        flat = input_coefficients(before, noise, stepping=False).transpose(1, 0, 2)
        rounding = 1e-9 * np.abs(packed.sampled).max() / packed.dts[0] ** np.arange(4.0)
        assert np.all(np.abs(own[:, :3] - flat) <= rounding)
        assert np.array_equal(own[:, 3], np.zeros_like(own[:, 3]))
        assert packed.powered[0] and packed.steps[0] == (stated == "hold" or (stated == "detected" and one is square))
        if one is smooth:
            whole = pack_inputs([replace(moved, before_noise=None)])
            assert np.all(np.abs(packed.coefficients - whole.coefficients) <= rounding)
            assert np.all(np.abs(packed.sampled - whole.sampled) <= 1e-9 * np.ptp(whole.sampled))


def test_of_a_cut_recording_the_inputs_themselves_tell_where_they_step() -> None:
    square = next(r for r in recordings("motor") if r.name == "square_current_1")
    moved = with_inputs_moved(square, input_noise(square, np.random.default_rng(2)))
    assert moved.phase_currents is not None
    half = slice(0, square.t.size // 2)
    cut = replace(moved, t=moved.t[half], y=moved.y[half], v=None, phase_currents=moved.phase_currents[:, half])
    own = replace(cut, before_noise=None)
    assert np.array_equal(pack_inputs([cut]).coefficients, pack_inputs([own]).coefficients)
    assert np.array_equal(input_jumps(cut), input_jumps(own))


def test_noise_reaches_what_is_driven() -> None:
    problem = both()
    reached = driven(problem)
    p, wheels = len(problem.space.parameters), recordings("free_wheel")
    assert reached.places == (1,) and reached.problem.parts == problem.parts[1:]
    assert np.array_equal(reached.columns, np.arange(p))  # start offsets are of the free wheels
    assert np.array_equal(reached.rows, np.arange(reached.rows.size) >= sum(r.t.size for r in wheels))
    runs = Problem(problem.space, (problem.parts[1], FreeRun(MODEL, recordings("motor"), 2, 1), problem.parts[0]))
    reached = driven(runs)
    assert reached.places == (0, 1)
    assert np.array_equal(reached.columns, np.arange(p + 2 * len(recordings("motor"))))
    assert under_noise(problem.parts[0], wheels) is problem.parts[0]
    none = driven(Problem(problem.space, problem.parts[:1]))
    assert none.places == () and not np.any(none.rows)
