"""Derivatives along a measured motion are those of the acceleration and reading that `along` gives."""

from __future__ import annotations

import numpy as np
import pytest

from linid.physics.effects.registry import EFFECTS
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator
from tests.simulation.test_along_together import motion

_STEP = 1e-5  # of each parameter's size
_SPIKES = 0.01  # of the samples: where a resting bristle just breaks away, or a hidden state turns, the slope jumps
ALONE = [effect.name for effect in EFFECTS]
TOGETHER = [
    ("input_delay", "cogging", "force_saturation"),
    ("pole_pitch_error", "position_dependent_friction", "phase_gain_imbalance", "end_effect"),
    ("cable_force", "encoder_periodic_error", "payload_change", "friction_drift"),
    ("backlash", "flexible_load", "breakaway_change", "asymmetric_friction"),
    # What the motor gets does not hang on hidden states, the forces beside it do.
    ("cable_force", "pole_pitch_error", "phase_gain_imbalance", "current_offset"),
    # Friction by the motor's force, which all of these change.
    ("load_dependent_friction", "pole_pitch_error", "force_saturation", "force_ripple", "thermal_derating"),
    ("load_dependent_friction", "input_delay", "position_dependent_friction", "cogging"),
    # What they make of it is told for all intervals at once, beside hidden states that do not change it.
    ("load_dependent_friction", "force_constant_change", "asymmetric_friction", "flexible_load"),
]
OWN = [
    ("mine: c_1 * cos(90 * y) + spline(v, -0.4, 0.4, 5)",),
    ("mine: c_1 * F * exp(-travel / 0.01) + c_2 * tanh(rest)", "cable_force", "force_ripple"),
    ("mine: c_1 * acceleration + c_2 * sin(T)", "phase_gain_imbalance", "thermal_derating"),
    ("mine: c_1 * y * sign(v) + c_2 * stribeck * sign(v)", "asymmetric_friction", "position_dependent_friction"),
    ("mine: c_1 * exp(-since_reversal) * sign(v) + c_2 * y * v", "end_effect", "friction_level_change"),
    ("mine: F * (c_1 * cos(90 * y) + c_2 * sin(90 * y)) + v * periodic(y, 0.03, 5)", "thermal_derating", "cogging"),
    ("mine: c_1 * F * tanh(slid) + spline2(y, -0.1, 0.3, 4, v, -1, 1, 4)", "input_delay", "dwell_stiction"),
    ("mine: c_1 * acceleration * y + c_2 * F * v", "backlash", "drive_train_backlash", "force_saturation"),
    ("mine: 0.1 * (c_1 * F * sign(v) + c_2 * abs(F) * sign(v))", "commutation_change", "end_effect"),
    ("mine: 0.1 * (c_1 * abs(F) + c_2 * F * y) * sign(v)", "load_dependent_friction", "commutation_change", "backlash"),
    ("mine: (c_1 * stribeck + spline(y, -0.1, 0.3, 5)) * sign(v) + c_2 * y", "asymmetric_friction", "thermal_derating"),
    ("mine: 0.1 * c_1 * abs(F) * sign(v) + c_2 * y", "load_dependent_friction", "thermal_derating", "input_delay"),
]


def parts(seed: int) -> tuple[list[Recording], np.ndarray, np.ndarray, np.ndarray]:
    """A driven recording with a stop, and one that runs freely."""
    first, second = motion(seed), motion(seed + 1)
    free = Recording("free", second[0].t, second[0].y, number=2)
    y = np.concatenate([first[0].y, free.y])
    v, rests = (np.concatenate([first[k], second[k]]) for k in (1, 2))
    return [first[0], free], y, v, rests


def values_of(model: Model, seed: int) -> dict[str, float]:
    """Every parameter somewhere within its bounds, the ranges of effects as wide as they act here."""
    generator = np.random.default_rng(seed)
    values = {
        p.name: p.default * (1.0 + 0.3 * generator.random())
        if p.log
        else p.lower + generator.uniform(0.3, 0.7) * (min(p.upper, p.lower + 2.0) - p.lower)
        for p in model.parameters
    }
    # Own terms, whose ranges are as wide as can be, take some of the friction away and add some.
    own = {name: generator.uniform(-0.3, 0.3) for name in values if name.startswith("mine_")}
    return values | own | {"static_force": 1.5 * values["coulomb_force"], "stribeck_velocity": 0.03}


def compared(model: Model, seed: int) -> dict[str, float]:
    """Per parameter, how far the derivatives are off central differences, as a share of their size."""
    recordings, y, v, rests = parts(seed)
    simulator = Simulator(model, pack_inputs(recordings), 1, 2)
    values = values_of(model, seed)
    vector, names = model.vector(values), [p.name for p in model.parameters]
    tangents = np.zeros((len(names), vector.size))
    for k, name in enumerate(names):
        tangents[k, model.slot(name)] = max(abs(values[name]), 1e-3)
    slopes, reading_slopes = simulator.slopes_along(vector, tangents, y, v, rests)
    moved = np.vstack([vector + _STEP * tangents, vector - _STEP * tangents])
    along = simulator.along(moved, y, v, rests, np.full((len(moved), len(recordings)), np.nan))
    found = {}
    for what, mine, them in (("", slopes, along.acceleration), ("reading by ", reading_slopes, along.reading_error)):
        if mine is None or them is None:
            assert mine is None and them is None
            continue
        expected = (them[: len(names)] - them[len(names) :]) / (2.0 * _STEP)
        for name, one, other in zip(names, mine, expected, strict=True):
            size = max(float(np.sqrt(np.mean(other**2))), 1e-4 * float(np.std(them)))
            off = np.sort(np.abs(one - other))[: int((1.0 - _SPIKES) * one.size)]
            found[what + name] = float(np.max(off)) / max(size, 1e-300)
    return found


@pytest.mark.parametrize("effects", [(), *((name,) for name in ALONE), *TOGETHER, *OWN], ids="+".join)
@pytest.mark.parametrize("kind", ["sine", "theta"])
def test_derivatives_are_those_of_what_is_given(kind: str, effects: tuple[str, ...]) -> None:
    found = compared(Model(kind, effects), seed=len(effects))
    assert found == pytest.approx(dict.fromkeys(found, 0.0), abs=1e-3)


def test_a_direction_does_not_hang_on_its_company() -> None:
    model = Model("sine", TOGETHER[2])
    recordings, y, v, rests = parts(5)
    vector = model.vector(values_of(model, 5))
    tangents = np.eye(vector.size)[[model.slot(p.name) for p in model.parameters]] * 1e-2
    one, two = (Simulator(model, pack_inputs(recordings), 1, jobs) for jobs in (1, 2))
    together, readings = one.slopes_along(vector, tangents, y, v, rests)
    for k in range(len(tangents)):
        alone, reading = two.slopes_along(vector, tangents[k : k + 1], y, v, rests)
        assert np.array_equal(alone[0], together[k]) and np.array_equal(reading[0], readings[k])


def test_what_it_does_not_know_is_said() -> None:
    recordings = parts(1)[0]
    inputs = pack_inputs(recordings)
    for model in (Model("sine", law="dahl"), Model("sine", law="maxwell_slip")):
        assert not Simulator(model, inputs).has_slopes_along
    for effects in (tuple(ALONE), *OWN):
        assert Simulator(Model("theta", effects), inputs).has_slopes_along
