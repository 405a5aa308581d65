"""Forces told beforehand: which effects they hold, and windows with these side by side, as one at a time."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.physics.effects.registry import active_mask
from linid.physics.model import VECTOR_SIZE, Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Segments, Simulator
from linid.simulation.told import effects_told
from tests.simulation.axis_with_effects import AXIS, SAMPLES, simulate, start_of_run, synchronous_run

TOLD = [
    "cogging",
    "force_ripple",
    "phase_gain_imbalance",
    "constant_force",
    "input_delay",
    "force_saturation",
    "current_offset",
    "end_effect",
    "external_disturbance",
    "pole_pitch_error",
    "gravity",
    "force_constant_change",
    "commutation_change",
]
OWN = {
    "way: c * sin(90 * y)": {"way_c": 2.0},
    "tide: c * y * sin(40 * t + T)": {"tide_c": 9.0},
    "bump: c * exp(-0.5 * ((y - 0.03) / 0.01)**2)": {"bump_c": 3.0},
}
WAY = next(iter(OWN))
PERIOD = 1e-3  # s


@cache
def driven() -> Recording:
    """The axis driven to and fro, over reversals and a rest."""
    recording = synchronous_run(0.5)
    return replace(recording, y=simulate((), recording, start_of_run(), 4))


def simulator_of(effects: tuple[str, ...], substeps: int = 3, jobs: int = 1, *others: Recording) -> Simulator:
    return Simulator(Model("sine", effects), pack_inputs([driven(), *others]), substeps, jobs)


def vector_of(effects: tuple[str, ...]) -> np.ndarray:
    """Parameters (1, VECTOR_SIZE) of the axis with these effects."""
    samples = SAMPLES | OWN
    values = AXIS | {name: value for effect in effects for name, value in samples[effect].items()}
    return Model("sine", effects).vector(values)[None]


def windows() -> tuple[Segments, np.ndarray]:
    """Windows over each other, and where they start (1, S, 3): half of them with a given bristle, two at rest."""
    segments = Segments(np.zeros(16, dtype=np.int64), np.arange(16) * 25 + 10, np.full(16, 60))
    starts = np.full((1, 16, 3), np.nan)
    starts[0, :, 0] = driven().y[segments.first]
    starts[0, :, 1] = np.gradient(driven().y, PERIOD)[segments.first]
    starts[0, 1::2, 2], starts[0, 4:6, 1] = 1e-5, 0.0
    return segments, starts


def one_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Simulator, "_goes_in_lanes", lambda *_: False)


def test_what_is_told_beforehand() -> None:
    for name in SAMPLES:
        expected = active_mask((name,)) if name in TOLD else 0
        assert effects_told(Model("sine", (name,))) == expected, name
    cogging = active_mask(("cogging",))
    for other in ("flexible_load", "position_dependent_friction", "quadratic_drag", "grip: c*sin(3*y)*sign(v)"):
        assert effects_told(Model("sine", ("cogging", other))) == cogging, other
    # Own terms of place and time are told where all is: they have one bit in common.
    for own in OWN:
        for model in (Model("sine", ("cogging", own)), Model("sine", (own,)), Model("sine", tuple(OWN))):
            assert effects_told(model) == model.mask, own
        assert effects_told(Model("sine", ("cogging", own, "quadratic_drag"))) == cogging, own
        assert effects_told(Model("sine", ("cogging", own, "grip: c*v"))) == cogging, own
    # Friction under load, heat in the winding and a share of the motor's force must know that force by itself.
    for other in ("load_dependent_friction", "thermal_derating", "grip: c*F*sin(3*y)", "sway: c*acceleration"):
        assert effects_told(Model("sine", ("cogging", other))) == 0, other


@pytest.mark.parametrize("effect", [*TOLD, *OWN])
def test_windows_with_an_effect_are_as_one_at_a_time(effect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """But for forces within base steps, which a parabola tells: as near as base steps of the same length are."""
    (segments, starts), vector = windows(), vector_of((effect,))
    found = simulator_of((effect,)).run(vector, segments, starts, velocity=True, guided=True)
    simulators = [simulator_of((effect,), substeps) for substeps in (3, 48)]
    assert simulators[0]._goes_in_lanes(True) and not simulators[0]._goes_in_lanes(False)
    one_at_a_time(monkeypatch)
    alone, exact = (one.run(vector, segments, starts, velocity=True, guided=True) for one in simulators)
    assert abs(found[2] - alone[2]) < 0.01 * alone[2]
    for lanes, scalar, truth in zip(found[:2], alone[:2], exact[:2], strict=True):
        error = np.sqrt(np.mean((scalar - truth) ** 2))
        assert np.sqrt(np.mean((lanes - scalar) ** 2)) < 0.5 * error
        assert np.sqrt(np.mean((lanes - truth) ** 2)) < 1.1 * error
    without = simulator_of(()).run(vector_of(()), segments, starts, guided=True)[0]
    assert np.abs(without - found[0]).max() > 1e3 * np.sqrt(np.mean((found[0] - exact[0]) ** 2)) or effect in (
        "input_delay",
        "force_saturation",
    )


def test_windows_converge_as_one_at_a_time_does(monkeypatch: pytest.MonkeyPatch) -> None:
    effects = ("cogging", "force_ripple")
    (segments, starts), vector = windows(), vector_of(effects)
    simulators = [simulator_of(effects, substeps) for substeps in (2, 4, 8, 64)]
    together = [one.run(vector, segments, starts, guided=True)[0] for one in simulators]
    one_at_a_time(monkeypatch)
    *alone, exact = [one.run(vector, segments, starts, guided=True)[0] for one in simulators]
    errors = [np.sqrt(np.mean((y - exact) ** 2)) for y in together]
    expected = [np.sqrt(np.mean((y - exact) ** 2)) for y in alone]
    np.testing.assert_allclose(errors[:3], expected, rtol=0.1)
    assert errors[0] > 4.0 * errors[2] > 20.0 * errors[3]


@given(st.integers(0, 2**32 - 1), st.integers(1, 16), st.sampled_from([1, 2]))
@settings(max_examples=30, deadline=None)
def test_a_window_with_effects_has_the_same_bits_in_any_company(seed: int, company: int, jobs: int) -> None:
    """In any order and number, beside any candidates, in any number of threads, its derivatives too."""
    generator, effects = np.random.default_rng(seed), ("cogging", "input_delay", "end_effect", WAY)
    segments, starts = windows()
    params = np.repeat(vector_of(effects), 3, axis=0)
    for place in range(8, VECTOR_SIZE):
        params[1:, place] *= 1.0 + 0.1 * generator.uniform(-1.0, 1.0, 2)
    chosen = generator.permutation(segments.count.size)[:company]
    part = Segments(*(column[chosen] for column in segments))
    own = np.repeat(starts, 3, axis=0)
    together = simulator_of(effects, jobs=jobs).run(params, part, own[:, chosen], guided=True)[0]
    c, s = int(generator.integers(3)), int(generator.integers(company))
    one, alone = Segments(*(column[s : s + 1] for column in part)), simulator_of(effects)
    y = alone.run(params[c : c + 1], one, starts[:, chosen[s : s + 1]], guided=True)[0]
    a, b = part.out_offsets[s : s + 2]
    np.testing.assert_array_equal(together[c, a:b], y[0])
    model = Model("sine", effects)
    names = ("force_constant", "mass", "cogging_sine_2", "input_delay", "way_c", "coulomb_force")
    tangents = np.zeros((len(names), params.shape[1]))
    for row, name in enumerate(names):
        tangents[row, model.slot(name)] = params[0, model.slot(name)]
    nothing = np.zeros((segments.count.size, 3, len(names)))
    all_y, all_by = simulator_of(effects, jobs=jobs).slopes(
        params[c], tangents, part, starts[0, chosen], nothing[chosen]
    )
    own_y, own_by = alone.slopes(params[c], tangents, one, starts[0, chosen[s : s + 1]], nothing[:1])
    np.testing.assert_array_equal(all_y[a:b], own_y)
    np.testing.assert_array_equal(all_by[a:b], own_by)
    np.testing.assert_array_equal(own_y, y[0])


def test_recordings_without_inputs_are_one_at_a_time() -> None:
    """Their forces act where the simulation is, whatever is read of others."""
    t = np.arange(0.0, 0.2, PERIOD)
    wheel = Recording("wheel", t, 0.05 * np.sin(3.0 * t), kind="free_wheel", number=5)
    assert not simulator_of(("gravity",), 3, 1, wheel)._goes_in_lanes(True)
    assert simulator_of((), 3, 1, wheel)._goes_in_lanes(True)
