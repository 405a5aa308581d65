"""Each effect's own experiment gives its parameters back: first by regression, then by a fit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from linid.errors import UsageError
from linid.identification.fit import fit
from linid.identification.guess.effect_values import Regression, Trial, amplitude_sizes, best_trial
from linid.identification.guess.first_values import first_values, guess_effects, seed_candidates
from linid.identification.guess.scales import look_out
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.identification.space.bounds import build_space
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording
from tests.simulation.axis_with_effects import AXIS, NAMES, SAMPLES, campaign_with, simulate

QUICK = FitSettings(search=SearchSettings(population=16, generations=2), jobs=2, objective="acceleration")
# The play hides the motion that the force balance and the start states of predictions are taken from: only whole free
# runs, which need no motion but their start, tell it. Gravity is for rotary axes, below.
FREE_RUN = replace(QUICK, objective="free_run")
# Effects of given models are other values of what a fit identifies.
SEEN_IN_THE_BALANCE = tuple(
    name for name in NAMES if name not in ("backlash", "gravity") and not find_effect(name).of_given_models
)
# Breakaways pass within a few samples, which biases the weak form's `dwell_length` by a tenth; predictions do not.
AHEAD = {"dwell_stiction": replace(QUICK, objective="auto")}
# Equal gain errors of the outer phases look like another winding displacement while the currents sum to zero.
KNOWN = {"phase_gain_imbalance": {"winding_displacement": AXIS["winding_displacement"]}}


def given(name: str) -> dict[str, float]:
    """Structural parameters that a person would know; the marked recordings have to be found."""
    ends = {k: SAMPLES[name][k] for k in find_effect(name).preset if "recording" not in k and k in SAMPLES[name]}
    return ends | KNOWN.get(name, {})


def check(name: str, result: FitResult, tolerance: float = 0.03) -> None:
    largest = max(abs(SAMPLES[name][k]) for k in find_effect(name).amplitudes_of("sine"))
    for estimate in result.estimates:
        truth = SAMPLES[name].get(estimate.name)
        if truth is None:
            continue
        size = largest if estimate.name in find_effect(name).amplitudes_of("sine") else abs(truth)
        allowed = max(5.0 * estimate.std, tolerance * size) if estimate.std == estimate.std else 1e-12
        assert abs(estimate.value - truth) <= allowed, estimate
        if estimate.name in find_effect(name).amplitudes_of("sine") and abs(truth) > 0.3 * largest:
            # Where a few samples tell all, the deviation itself is rough.
            sure = 5.0 if name in AHEAD else 10.0
            assert estimate.status == "fitted" and abs(estimate.value) > sure * estimate.std, estimate


@pytest.mark.parametrize("name", SEEN_IN_THE_BALANCE)
def test_regression_along_the_motion_explains_the_gap(name: str) -> None:
    """The grid's best entry explains most of what the true base model leaves, with amplitudes near the truth."""
    recordings = campaign_with((name,))
    model = Model("sine")
    base = build_space(model, recordings, AXIS, {}, {}, False).holding({"mass": AXIS["mass"]})
    regression = Regression(base, base.encode(AXIS), recordings, 2)
    outlook = look_out(model, recordings, AXIS)
    sizes = amplitude_sizes(regression, find_effect(name), outlook)
    trial = best_trial(regression, find_effect(name), outlook, given(name), sizes)
    assert trial.explained > (0.04 if name == "external_disturbance" else 0.3)  # of one recording in eight
    if name == "payload_change":
        assert trial.values["payload_recordings"] == 16.0
    strongest = max(find_effect(name).amplitudes_of("sine"), key=lambda k: abs(SAMPLES[name][k]))
    if name not in ("phase_gain_imbalance", "force_saturation", "thermal_derating"):  # degenerate; far from linear
        assert trial.amplitudes[strongest] == pytest.approx(SAMPLES[name][strongest], rel=0.7)


@pytest.mark.parametrize("name", ["force_saturation", "payload_change", "flexible_load", "friction_level_change"])
def test_fit_recovers_the_effect(name: str) -> None:
    result = fit("sine", campaign_with((name,)), settings=QUICK, effects=(name,), known=given(name))
    check(name, result)


def test_free_runs_recover_a_play() -> None:
    result = fit("sine", campaign_with(("backlash",)), settings=FREE_RUN, effects=("backlash",))
    check("backlash", result)
    for estimate in result.estimates:
        if estimate.name in AXIS and estimate.status == "fitted":
            assert 0.0 < estimate.std < 0.02 * abs(estimate.value), estimate
            assert abs(estimate.value - AXIS[estimate.name]) < 5.0 * estimate.std + 1e-4 * abs(estimate.value), estimate


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SEEN_IN_THE_BALANCE if name not in AHEAD])
def test_fit_recovers_every_effect(name: str) -> None:
    result = fit("sine", campaign_with((name,)), settings=QUICK, effects=(name,), known=given(name))
    check(name, result)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.exhaustive) for seed in (1, 2))])
def test_a_few_samples_effect_is_found_whatever_the_rounding(seed: int) -> None:
    """A force balance hardly shows breakaways, so first values are poor; noise below the encoder's decides nothing.

    Without any noise the rounding of the last bits is the noise, and one rounding of many recovers the effect.
    """
    generator = np.random.default_rng(seed)
    recordings = [
        replace(r, y=r.y + 1e-8 * generator.standard_normal(r.y.size)) for r in campaign_with(("dwell_stiction",))
    ]
    result = fit("sine", recordings, settings=AHEAD["dwell_stiction"], effects=("dwell_stiction",))
    check("dwell_stiction", result)


def test_two_effects_are_guessed_together() -> None:
    effects = ("cogging", "quadratic_drag")
    recordings = campaign_with(effects)
    first, densities = first_values(Model("sine"), recordings, {}, None)
    (found, *_), preset = guess_effects(Model("sine", effects), recordings, first, {}, densities, FitSettings(jobs=2))
    orders = {name: order for name, order in preset.items() if name.startswith("cogging_order_")}
    assert orders == {f"cogging_order_{k}": float(n) for k, n in enumerate((1, 2, 4, 6), 1)}
    assert found["cogging_sine_2"] == pytest.approx(1.5, rel=0.5)
    assert found["drag_coefficient"] == pytest.approx(6.0, rel=0.5)
    assert 0.5 < found["mass"] / AXIS["mass"] < 2.0  # a first value: the search reaches eight times further


def test_free_wheels_alone_start_from_the_guess_and_its_rivals() -> None:
    recordings = [r for r in campaign_with(("quadratic_drag",)) if r.kind == "free_wheel"]
    model, settings = Model("friction", ("quadratic_drag",)), FitSettings(jobs=2)
    first, densities = first_values(Model("friction"), recordings, {}, None)
    (found, *rivals), _ = guess_effects(model, recordings, first, {}, densities, settings)
    space = build_space(model, recordings, found, {}, {}, False)
    starts, _ = seed_candidates(space, model, recordings, found, densities, settings, rivals)
    assert np.array_equal(starts, [space.encode(values) for values in (found, *rivals)])
    assert rivals[-1]["drag_coefficient"] == 0.0


def test_an_effect_is_fitted_where_all_else_is_held() -> None:
    known = {p.name: AXIS[p.name] for p in Model("sine").parameters}
    recordings = campaign_with(("quadratic_drag",))
    result = fit("sine", recordings, settings=FREE_RUN, effects=("quadratic_drag",), known=known)
    found, true = {e.name: e.value for e in result.estimates}, SAMPLES["quadratic_drag"]
    assert found["mass"] == AXIS["mass"]
    assert found["drag_power"] == pytest.approx(true["drag_power"], rel=0.05)
    # The coefficient is that at the speed v_d, which the fit chooses.
    scale = (found["drag_speed"] / true["drag_speed"]) ** (true["drag_power"] - 1.0)
    here = true["drag_coefficient"] * true["drag_speed"] / found["drag_speed"] * scale
    assert found["drag_coefficient"] == pytest.approx(here, rel=0.05)


def test_an_effect_without_sense_is_refused() -> None:
    recordings = [r for r in campaign_with(()) if r.kind == "free_wheel"]
    with pytest.raises(UsageError, match="makes no sense with the friction model"):
        fit("friction", recordings, settings=QUICK, effects=("current_offset",))


TURNING = {
    "coulomb_force": 2.4e-3,
    "static_force": 3e-3,
    "stribeck_velocity": 0.5,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 5.0,
    "bristle_damping": 5e-3,
    "viscous_friction": 4e-5,
    "mass": 6e-6,
    "force_constant": 0.0318,
}


def turns(effects: tuple[str, ...], values: dict[str, float]) -> list[Recording]:
    """Three recordings of a rotary axis with one input, which turns many times both ways."""
    generator = np.random.default_rng(2)
    t = np.arange(0.0, 3.0, 1e-3)
    recordings = []
    for k, level in enumerate((0.1, -0.1, 0.11)):
        empty = Recording(
            f"turn_{k}", t, np.zeros_like(t), drive_input=level * (1.0 + 0.1 * np.sin(3.0 * t)), axis="rotary", number=k
        )
        start = (0.0, 190.0 * level, math.nan)
        y = simulate(effects, empty, start, 4, values=TURNING | values, kind="force")
        recordings.append(replace(empty, y=y + 1e-6 * generator.standard_normal(y.size)))
    return recordings


def trial_on(recordings: list[Recording], name: str) -> Trial:
    """The best trial of an effect on a rotary axis whose base model is known."""
    base = build_space(Model("force"), recordings, TURNING, {"force_constant": 0.0318}, {}, False)
    regression = Regression(base, base.encode(TURNING), recordings, 1)
    outlook = look_out(Model("force"), recordings, TURNING)
    effect = find_effect(name)
    return best_trial(regression, effect, outlook, {}, amplitude_sizes(regression, effect, outlook))


def test_gravity_is_the_first_wave_of_a_revolution() -> None:
    """Its two amplitudes come back, and cogging, whose candidates begin with two waves, does not take its place."""
    hidden = {"gravity_sine": 3e-4, "gravity_cosine": -2e-4}
    recordings = turns(("gravity",), hidden)
    trial = trial_on(recordings, "gravity")
    assert trial.explained > 0.9
    for name, value in hidden.items():
        assert trial.amplitudes[name] == pytest.approx(value, rel=0.05)
    other = trial_on(recordings, "cogging")
    assert other.explained < 0.1 and min(other.values[f"cogging_order_{k}"] for k in range(1, 9)) >= 2.0
    result = fit(
        "force", recordings, settings=QUICK, effects=("gravity",), known={"force_constant": TURNING["force_constant"]}
    )
    for name, value in hidden.items():
        assert result.value(name) == pytest.approx(value, rel=0.03)


def test_the_orders_of_unknown_poles_are_found() -> None:
    """A turning axis with one input: three waves per revolution that nobody has told."""
    waves = {5.0: 2e-4, 7.0: 1.5e-4, 12.0: 1e-4}
    hidden = {"cogging_wavenumber": 1.0, "cogging_sine_4": 0.0, "cogging_cosine_4": 0.0}
    for k, (order, size) in enumerate(waves.items(), 1):
        hidden |= {f"cogging_order_{k}": order, f"cogging_sine_{k}": size, f"cogging_cosine_{k}": -0.3 * size}
    trial = trial_on(turns(("cogging",), hidden), "cogging")
    sizes = {
        trial.values[f"cogging_order_{k}"]: math.hypot(
            trial.amplitudes[f"cogging_sine_{k}"], trial.amplitudes[f"cogging_cosine_{k}"]
        )
        for k in range(1, 9)
    }
    assert sorted(sorted(sizes, key=lambda order: -sizes[order])[:3]) == sorted(waves)
    for order, size in waves.items():
        assert sizes[order] == pytest.approx(size * math.hypot(1.0, 0.3), rel=0.05)
    assert trial.explained > 0.9
