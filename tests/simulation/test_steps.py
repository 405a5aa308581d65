"""The kernel's parts in plain Python against closed forms, and the whole of it against its compiled self."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from linid.physics.effects.registry import EFFECTS, find_effect
from linid.physics.model import STATE_PLACES, STATE_SIZE, STATE_START, Model
from linid.recording.recording import Recording
from linid.simulation import along, forces, kernel, splines_at, steps
from linid.simulation.course import FINEST, AxisState, Candidates, Course, Place, Scheme, Stretch
from linid.simulation.forces import Axis, Bristles
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import REVERSAL_TOLERANCE, Simulator, whole_recordings
from linid.simulation.steering import UNSTEERED
from linid.simulation.terms import terms_of
from tests.plain import Plain
from tests.simulation.axis_with_effects import AXIS, SAMPLES

BRISTLES = Bristles(2.0, 3.0, 5e-3, 2.0, 1e4, 80.0, 4.0, 0.6)
SPRING = (BRISTLES.sigma_0, BRISTLES.sigma_1)
REST = (0.0, 0.0, 0.0)
BARE = Plain().of(terms_of(bare=True))


def axis_of(powered: bool = False, motor: int = 0, p: np.ndarray | None = None) -> Axis:
    return Axis(0, powered, motor, 0, 0.0, 0.0, np.zeros(20) if p is None else p, np.zeros((3, 12)))


FREE = axis_of()


def test_free_sliding_is_exact_however_long_the_step_is() -> None:
    tick = 0.05 / (1 << FINEST)
    course = Course(0.0, 0.05, 1, tick, 0.0, False, 1e-3, np.zeros((0, 4, 4)), np.zeros(0))
    sliding, weights = Plain().of(steps.sliding_step), Plain().of(kernel.glide_weights)
    start = AxisState(0.1, 0.8, BRISTLES.coulomb / BRISTLES.sigma_0, 0.0, REST, SPRING)
    slide = steps.Slide(1 << FINEST, True, weights(BRISTLES.sigma_2, BRISTLES.mass, 0.05))
    end = sliding(BARE, FREE, BRISTLES, course, Place(0, 0, 0), start, slide)
    rate, rest = BRISTLES.sigma_2 / BRISTLES.mass, -BRISTLES.coulomb / BRISTLES.sigma_2
    decay = math.exp(-rate * 0.05)
    assert end.v == pytest.approx(rest + (0.8 - rest) * decay, rel=1e-14)
    assert end.y == pytest.approx(0.1 + rest * 0.05 + (0.8 - rest) * (1.0 - decay) / rate, rel=1e-14)
    assert end.w == BRISTLES.coulomb / BRISTLES.sigma_0


@pytest.mark.parametrize(("v", "expected"), [(0.5, 2.0), (-0.5, -2.0), (5e-3, 2.0 + math.exp(-1.0)), (0.0, 0.0)])
def test_the_bristle_of_steady_sliding_is_the_stribeck_curves(v: float, expected: float) -> None:
    found = Plain().of(forces.steady_bristle)(BARE, FREE, BRISTLES, 0.0, 0.0, v, REST)
    assert found * BRISTLES.sigma_0 == pytest.approx(expected, rel=1e-14)


def test_a_pushed_bristle_at_rest_holds_up_to_breakaway() -> None:
    p = np.zeros(20)
    p[8] = 10.0  # N/A
    pushed = axis_of(True, Model("force").motor, p)
    held = [
        Plain().of(forces.steady_bristle)(BARE, pushed, BRISTLES, 0.0, 0.0, 0.0, (i, 0.0, 0.0))
        for i in (0.2, -0.2, 5.0)
    ]
    assert np.array(held) * BRISTLES.sigma_0 == pytest.approx([2.0, -2.0, 3.0])


def test_the_straight_line_has_the_parabolas_impulse() -> None:
    parabola = np.polynomial.Polynomial([1.0, -3.0, 7.0])
    mean, rise = Plain().of(steps.impulse)(parabola(0.0), parabola(0.5), parabola(1.0))
    assert mean == pytest.approx(parabola.integ()(1.0)) and rise == pytest.approx(parabola(1.0) - parabola(0.0))


def test_halvings_go_on_until_the_rate_swings_little() -> None:
    predicted = Plain().of(steps.predicted)
    tick = 1e-3 / (1 << FINEST)

    def halvings(v: float, w: float, force: float, tolerance: float) -> int:
        motion = AxisState(0.0, v, w, force, REST, SPRING)
        return int(predicted(BARE, FREE, BRISTLES, motion, 0.0, 0, tick, tolerance).halvings)

    steady = BRISTLES.coulomb / BRISTLES.sigma_0
    assert halvings(0.5, steady, 0.0, 1e-3) == 0  # steady sliding needs none
    reversal = [halvings(1e-3, steady, -40.0, tolerance) for tolerance in (1e-1, 1e-3, 1e-5)]
    assert 0 < reversal[0] < reversal[1] < reversal[2] <= FINEST


def test_inputs_act_late_and_are_held_at_the_ends() -> None:
    t = np.arange(0.0, 0.1, 1e-3)
    recording = Recording("r", t, np.zeros_like(t), drive_input=t**2, input_unit="A")
    c, late = pack_inputs([recording]).coefficients, Plain().of(splines_at.late_inputs)
    assert late(c, 1e-3, 0.0305)[0] == pytest.approx(0.0305**2, rel=1e-9)
    assert late(c, 1e-3, -1.0)[0] == 0.0 and late(c, 1e-3, 9.0)[0] == pytest.approx(0.099**2, rel=1e-9)


@pytest.mark.parametrize("x", [0.0, 1e-9, 0.01, 0.0199, 0.02, 0.5, 30.0])
def test_means_of_the_decay(x: float) -> None:
    first, second = Plain().of(along.decay_means)(x, math.exp(-x))
    assert first == pytest.approx(quad(lambda s: math.exp(-x * s), 0.0, 1.0)[0], rel=3e-6)
    assert second == pytest.approx(quad(lambda s: s * math.exp(-x * s), 0.0, 1.0)[0], rel=3e-6)


def test_what_the_bristle_has_forgotten_is_skipped() -> None:
    y = np.concatenate([np.linspace(0.0, 1.0, 11), np.ones(5)])
    wanted = np.zeros(16, dtype=bool)
    wanted[10] = True
    skipped = Plain().of(along.skipped)
    assert skipped(0, wanted, y, 0.25) == (10, 7)  # three intervals of 0.1 m
    assert skipped(8, wanted, y, 0.25) == (10, 8)
    assert skipped(11, wanted, y, 0.25)[0] == 16  # none is wanted any more


@pytest.mark.parametrize("term", ["force", "level", "friction", "thrust", "sensor"])
@pytest.mark.parametrize("alone", [False, True], ids=["guarded", "specialised"])
def test_terms_of_effects_are_chained(term: str, alone: bool) -> None:
    """Added or multiplied, those that are on, each with its own parameters and states."""
    names = tuple(effect.name for effect in EFFECTS if term in effect.terms)
    model = Model("sine", names)
    values = {**AXIS, **{k: x for name in names for k, x in SAMPLES[name].items()}}
    p = Plain().of(forces.work_vector)(model.vector(values), 2.0, 7.0, 0.0)
    p[STATE_START : STATE_START + STATE_SIZE] = 1e-3 * np.arange(1.0, STATE_SIZE + 1.0)
    t, y, v, currents = 0.1, 0.03, 0.2, (0.5, -0.2, -0.3)
    chain = getattr(Plain().of(terms_of(model if alone else None)), term)
    several = term in ("force", "sensor")
    expected = 1.0
    for name in names:
        effect = find_effect(name)
        place = STATE_START + STATE_PLACES.get(name, 0)
        states = p[place : place + effect.states_of(term)] if effect.states else np.zeros(effect.states_of(term))
        own = [values.get(q.name, q.default) for q in effect.parameters]
        value = effect.terms[term].py_func(t, y, v, *currents, 2.0, 7.1, *states, *own)
        expected = expected + value if several else expected * value
    assert len(names) >= (1 if term in ("friction", "thrust") else 2)
    assert chain(1.0, model.mask, t, y, v, currents, p) == pytest.approx(expected, rel=1e-14)
    assert chain(1.0, 0, t, y, v, currents, p) == 1.0


@pytest.mark.parametrize("effects", [(), ("cogging", "flexible_load"), ("input_delay", "thermal_derating", "backlash")])
def test_compiled_and_plain_simulations_are_the_same(effects: tuple[str, ...]) -> None:
    t = np.arange(0.0, 0.04, 1e-3)
    currents = 0.8 * np.sin(60.0 * t + np.array([[0.0], [2.0], [4.0]]))
    simulator = Simulator(Model("sine", effects), pack_inputs([Recording("r", t, 0.0 * t, phase_currents=currents)]), 2)
    model, inputs = simulator.model, simulator.inputs
    values = {**AXIS, **{k: x for name in effects for k, x in SAMPLES[name].items()}}
    start = np.array([0.01, 0.02, math.nan])
    compiled = simulator.run(model.vector(values)[None, :], whole_recordings(inputs), start[None, None, :])[0][0]
    y = np.empty(t.size)
    plain = Plain()
    candidates = Candidates(model.vector(values)[None], model.motor, model.mask, 0)
    first = (model.vector(values), True, inputs.coefficients, False, 0.0, inputs.dts[0], 0, t.size, 0.0)
    stretch = Stretch(*first, inputs.records[0], inputs.elapsed[0])
    kept = np.array(model.states, dtype=int)
    scheme = Scheme(False, np.empty((4, 0)), np.empty(0), 2, REVERSAL_TOLERANCE / 4.0, UNSTEERED)
    out = (y, np.zeros(0))
    plain.of(kernel.simulate_one)(plain.of(terms_of()), candidates, stretch, start, kept, scheme, np.zeros(0), out)
    assert np.max(np.abs(y - compiled)) < 1e-12 * np.max(np.abs(y))
