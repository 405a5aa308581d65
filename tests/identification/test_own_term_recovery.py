"""Own terms that act on an axis are found again by a fit, from nothing but their text."""

from __future__ import annotations

import numpy as np
import pytest

from linid.errors import UsageError
from linid.identification.fit import fit
from linid.identification.guess.effect_values import Regression, amplitude_sizes, best_trial
from linid.identification.guess.scales import look_out
from linid.identification.settings import FitSettings, SearchSettings
from linid.identification.space.bounds import build_space
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording
from tests.simulation import axis_with_effects
from tests.simulation.axis_with_effects import AXIS, campaign_with

QUICK = FitSettings(search=SearchSettings(population=16, generations=2), jobs=2, objective="acceleration")
TERMS = {
    "drag: -c * v * abs(v)": {"drag_c": 6.0},
    "power: -c * v * abs(v) ** p; p in [0.5, 3]": {"power_c": 6.0, "power_p": 1.2},
    "rub: -c * abs(F) * sign(v)": {"rub_c": 0.15},
    "hill: -b * exp(-((y - y_0) / w) ** 2) * sign(v); y_0 in [-0.1, 0.1]; w in [0.003, 0.1]": {
        "hill_b": 1.0,
        "hill_y_0": 0.02,
        "hill_w": 0.02,
    },
    "rail: spline(y, -0.1, 0.1, 8)": {
        f"rail_{k}": x for k, x in enumerate([0.5, 1.0, -1.0, 0.7, -1.2, 0.6, 1.0, -0.4], 1)
    },
}


def campaign(text: str, monkeypatch: pytest.MonkeyPatch) -> list[Recording]:
    monkeypatch.setitem(axis_with_effects.SAMPLES, text, TERMS[text])
    return campaign_with((text,))


@pytest.mark.parametrize("text", TERMS)
def test_regression_along_the_motion_gives_first_values(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    recordings = campaign(text, monkeypatch)
    effect, model = find_effect(text), Model("sine")
    base = build_space(model, recordings, AXIS, {}, {}, False).holding({"mass": AXIS["mass"]})
    regression = Regression(base, base.encode(AXIS), recordings, 2)
    outlook = look_out(model, recordings, AXIS)
    sizes = amplitude_sizes(regression, effect, outlook)
    trial = best_trial(regression, effect, outlook, {}, sizes)
    assert trial.explained > 0.3
    for name in effect.amplitudes:
        assert abs(TERMS[text][name]) < sizes[name]  # the range holds the truth


@pytest.mark.parametrize("text", TERMS)
def test_a_fit_recovers_the_term(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    result = fit("sine", campaign(text, monkeypatch), settings=QUICK, effects=(text,))
    assert result.effects == (text,)
    found = {e.name: e for e in result.estimates}
    for name, truth in TERMS[text].items():
        one = found[name]
        if name in ("rail_1", "rail_8"):  # the axis hardly gets there
            assert abs(one.value - truth) <= 5.0 * one.std
            continue
        assert abs(one.value - truth) <= max(5.0 * one.std, 0.01 * abs(truth)), one
        assert one.status == "fitted" and abs(one.value) > 10.0 * one.std
    for name in ("mass", "force_constant", "coulomb_force"):
        assert found[name].value == pytest.approx(AXIS[name], rel=3e-3)


def test_a_formula_of_the_motor_force_makes_no_sense_in_free_wheels() -> None:
    t = np.arange(0.0, 0.6, 1e-3)
    wheels = [
        Recording(f"w_{k}", t, 0.6 * t - 0.4 * t**2, kind="free_wheel", added_mass=added, number=k)
        for k, added in ((1, 0.0), (2, 0.5))
    ]
    with pytest.raises(UsageError, match="rub"):
        fit("friction", wheels, settings=QUICK, effects=("rub: -c * abs(F) * sign(v)",))
