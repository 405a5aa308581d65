"""Motor fits on the generated stand: recovery, and profiles against the covariance."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from linid.errors import UsageError
from linid.identification.fit import fit
from linid.identification.guess.first_values import first_values
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.physics.model import Model
from linid.physics.theta import Theta0

from .stand import FREE_WHEELS, stand

SMALL = FitSettings(search=SearchSettings(population=24, generations=4), jobs=2)
DRIVEN = ("slow_ramp_1", "sine_current_2", "sine_position_1", "moves_1")


@cache
def friction_fit() -> FitResult:
    wheels = [r for r in stand(only=FREE_WHEELS + DRIVEN).recordings if r.kind == "free_wheel"]
    return fit("friction", wheels, settings=SMALL)


@cache
def theta_fit() -> FitResult:
    return fit("theta", stand(only=FREE_WHEELS + DRIVEN).recordings, settings=SMALL, start=friction_fit())


def test_theta_motor_and_friction_are_recovered() -> None:
    result = theta_fit()
    truth = stand(only=FREE_WHEELS + DRIVEN).truth
    found = {e.name: e for e in result.estimates}
    assert result.converged
    for name in ("winding_displacement", "coulomb_force", "viscous_friction", "mass", "bristle_stiffness"):
        assert abs(found[name].value - truth[name]) < 4.5 * found[name].std, found[name]
    for name in ("electrical_wavenumber", "commutation_offset"):  # their intervals are not symmetric
        reach = 2.0 * (found[name].high - found[name].low)
        assert found[name].low - reach < truth[name] < found[name].high + reach, found[name]
        assert found[name].low < found[name].value < found[name].high
    assert found["electrical_wavenumber"].std < 2e-3 * truth["electrical_wavenumber"]


@pytest.mark.parametrize("untold", [("bristle_damping",), ("bristle_stiffness", "bristle_damping")])
def test_what_free_wheels_do_not_tell_of_the_bristle_leads_no_motor_fit_astray(untold: tuple[str, ...]) -> None:
    """A damping 200 times, and with it a stiffness 50 times too large are no start where nothing tells of them."""
    friction, factors = friction_fit(), {"bristle_damping": 200.0, "bristle_stiffness": 50.0}
    astray = [
        replace(e, value=e.value * factors[e.name], status="not_identifiable") if e.name in untold else e
        for e in friction.estimates
    ]
    start = replace(friction, estimates=tuple(astray))
    recordings = stand(only=FREE_WHEELS + DRIVEN).recordings
    first, _ = first_values(Model("theta"), recordings, {}, start)
    assert not {*untold} & first.keys() and first["mass"] == friction.value("mass")
    found, direct = fit("theta", recordings, settings=SMALL, start=start), theta_fit()
    assert found.evaluations < 1.5 * direct.evaluations
    for estimate in direct.estimates:
        if estimate.status == "fitted":
            assert abs(found.value(estimate.name) - estimate.value) < 0.5 * estimate.std, estimate


def test_what_the_field_means() -> None:
    """The fundamental force constant is 30 N/A; nome and coil length hide while the currents sum to zero."""
    derived = {e.name: e for e in theta_fit().derived}
    constant = derived["fundamental_force_constant"]
    assert abs(constant.value - 30.0) < 4.5 * constant.std < 1.5  # a phase error would make up for a larger one
    assert derived["pole_pitch"].low < np.pi / 222.0 + 1e-5 and derived["pole_pitch"].high > np.pi / 222.0 - 1e-5
    status = {e.name: e.status for e in theta_fit().estimates}
    assert status["nome"] == "not_identifiable" and status["winding_length"] == "not_identifiable"


def thrust(motor: dict[str, float]) -> np.ndarray:
    """Thrust over position within a pole pitch under currents of 1 A that turn with the true field."""
    y = np.linspace(0.0, np.pi / 111.0, 200)
    angle = 2.0 * (111.0 * y + 0.768)
    z = motor["electrical_wavenumber"] * y + motor["commutation_offset"]
    parts = [
        np.sin(angle + j * 2.0 * np.pi / 3.0)
        * Theta0(z + j * motor["winding_displacement"], motor["nome"], motor["winding_length"])
        for j in (-1, 0, 1)
    ]
    return motor["force_constant"] * np.sum(parts, axis=0)


def test_narrow_magnets_are_found_across_the_plain_of_equal_shapes() -> None:
    """Below a nome of 0.8 all shapes push alike; the search must not stay there when the truth is 0.895."""
    campaign = stand("stand_axis_narrow.yaml", only=("freewheel_1", "freewheel_5", *DRIVEN))
    wheels = [r for r in campaign.recordings if r.kind == "free_wheel"]
    friction = fit("friction", wheels, settings=SMALL)
    result = fit("theta", campaign.recordings, settings=SMALL, start=friction)
    true = thrust(dict(campaign.truth))
    error = thrust({e.name: e.value for e in result.estimates}) - true
    assert np.std(true) > 0.05 * np.mean(true)  # what a sine cannot follow
    assert np.sqrt(np.mean(error**2)) < 0.003 * np.mean(true)
    cost = next(e for e in result.derived if e.name == "sine_force_error")
    assert cost.value == pytest.approx(0.06, abs=0.01) and "theta pays" in cost.note


def test_a_profile_agrees_with_the_covariance_where_the_fit_is_nearly_linear() -> None:
    wheels = stand(only=FREE_WHEELS).recordings
    result = fit("friction", wheels, settings=replace(SMALL, profiles=("viscous_friction",)))
    (profile,) = result.profiles
    estimate = next(e for e in result.estimates if e.name == "viscous_friction")
    assert profile.low == pytest.approx(estimate.low, abs=0.1 * estimate.std)
    assert profile.high == pytest.approx(estimate.high, abs=0.1 * estimate.std)
    assert min(profile.statistic) == 0.0
    assert profile.values[int(np.argmin(profile.statistic))] == estimate.value


def test_a_profile_of_an_unknown_parameter_is_refused_before_the_search() -> None:
    wheels = stand(only=FREE_WHEELS).recordings
    with pytest.raises(UsageError, match="not a fitted parameter"):
        fit("friction", wheels, settings=replace(SMALL, profiles=("pole_pitch",)))
