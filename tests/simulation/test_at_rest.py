"""An axis that a bristle holds for good is not simulated any further: against one that is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.simulation.axis_with_effects import AXIS, SAMPLES, synchronous_run

DURATION, STARTS = 1.5, np.array([[0.01, 0.35], [-0.02, -0.25], [0.03, 0.0]])  # s, m and m/s: all rest for long
TICKING = "tick: zero * t"  # a force that hangs on time, of no size: nothing of it ever rests for good
TRAVELLING = "wake: -grip * stribeck * sign(v) * exp(-travel / 0.01)"
OWN = {TRAVELLING: {"grip": 0.2}, "valley: -hold * sin(180 * y)": {"hold": 1.5}}
HELD = ["cogging", "cable_force", "constant_force", "eddy_current_drag", *OWN]


def coast_downs(samples: int = 0) -> tuple[Recording, ...]:
    """Free wheels that begin at STARTS, their positions not known yet."""
    run = synchronous_run(DURATION)
    one = replace(run, kind="free_wheel", phase_currents=None, y=np.zeros(run.t.size))
    return tuple(replace(one, name=f"wheel {k}") for k in range(len(STARTS)))


def parts(effects: tuple[str, ...]) -> tuple[Model, np.ndarray, Simulator]:
    """A model with effects, its parameters and the simulator of three coast-downs."""
    model = Model("sine", effects)
    values = dict(AXIS)
    for name in effects:
        given = OWN.get(name, {"zero": 0.0} if name == TICKING else SAMPLES.get(name, {}))
        names = [p.name for p in find_effect(name).parameters]
        values |= {next(full for full in names if full.endswith(short)): value for short, value in given.items()}
    return model, model.vector(values), Simulator(model, pack_inputs(coast_downs()), 4)


def coasted(effects: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray, int]:
    """Positions in m and speeds in m/s of all coast-downs, (3, n) each, and the steps that these took."""
    _, vector, simulator = parts(effects)
    starts = np.full((1, len(STARTS), 3), np.nan)
    starts[0, :, :2] = STARTS
    y, v, steps = simulator.run(vector[None], whole_recordings(simulator.inputs), starts, velocity=True)
    return y.reshape(len(STARTS), -1), v.reshape(len(STARTS), -1), steps


@pytest.mark.parametrize("name", HELD)
def test_what_rests_for_good_stays_where_it_would(name: str) -> None:
    y, v, steps = coasted((name,))
    all_y, all_v, all_steps = coasted((name, TICKING))
    assert np.max(np.abs(y - all_y)) < 1e-13
    assert np.max(np.abs(v - all_v)) < 2e-12
    assert np.all(v[:, -1] == 0.0)
    assert steps < 0.8 * all_steps  # it does rest, and that costs nothing


@pytest.mark.parametrize("name", ["friction_drift", "external_disturbance", "dwell_stiction", "flexible_load"])
def test_what_goes_on_at_rest_is_simulated_to_the_end(name: str) -> None:
    y, _, _ = coasted((name,))
    all_y, _, _ = coasted((name, TICKING))
    assert np.array_equal(y, all_y)


@pytest.mark.parametrize("variable", ["t", "T", "since_reversal", "rest"])
def test_an_own_term_that_goes_on_at_rest_moves_the_axis_again(variable: str) -> None:
    term = f"ramp: -rise * {variable}"
    OWN[term] = {"rise": 6.0}
    y, _, _ = coasted((term,))
    all_y, _, _ = coasted((term, TICKING))
    assert np.array_equal(y, all_y)
    assert np.ptp(y[2, y.shape[1] // 2 :]) > 1e-6


@pytest.mark.parametrize("name", [name for name in HELD if name != TRAVELLING])
def test_derivatives_stay_too(name: str) -> None:
    found = []
    for effects in ((name,), (name, TICKING)):
        model, vector, simulator = parts(effects)
        free = [p.name for p in model.parameters if p.name not in ("stribeck_exponent", "tick_zero")]
        tangents = np.zeros((len(free), vector.size))
        for row, one in zip(tangents, free, strict=True):
            row[model.slot(one)] = max(abs(vector[model.slot(one)]), 1e-3)
        starts = np.full((len(STARTS), 3), np.nan)
        starts[:, :2] = STARTS
        moved = np.zeros((len(STARTS), 3, len(free)))
        segments = whole_recordings(simulator.inputs)
        assert simulator.has_slopes(guided=False)
        found.append(simulator.slopes(vector, tangents, segments, starts, moved, guided=False))
    (y, slopes), (all_y, all_slopes) = found
    assert np.max(np.abs(y - all_y)) < 1e-13
    scale = np.maximum(np.max(np.abs(all_slopes), axis=0), 1e-9)
    assert np.max(np.abs(slopes - all_slopes) / scale) < 1e-7
