"""Effects outside the library cannot be passed off as a listed one: regression of what the base model misses."""

from __future__ import annotations

import numpy as np
import pytest

from linid.challenge.axes import TRAVEL
from linid.challenge.entries import AxisSizes
from linid.challenge.outside import OUTSIDE
from linid.challenge.strength import COARSE, HALF_WIDTH, bump, calibrate, run_all
from linid.stand.description import AxisDescription
from tests.challenge.conftest import effect

Array = np.ndarray


def forms(axis: AxisDescription, y: Array, v: Array, thrust: Array, current: Array, t: Array) -> dict[str, list[Array]]:
    """Generous textbook forms of the listed effects, as columns of force, and `base`, what refitting the base takes."""
    angle = (2 if axis.motor.kind == "theta" else 1) * axis.motor.electrical_wavenumber_per_m * y
    place = (y - axis.stroke.upper_m / 2) / (TRAVEL * axis.stroke.upper_m)
    side, heat = np.tanh(v / 5e-3), np.cumsum(current**2) * 1e-3
    return {
        "base": [thrust, side, v, side * np.exp(-np.abs(v) / 0.05)],
        "cogging": [g(k * angle) for k in (1, 2, 4) for g in (np.sin, np.cos)],
        "force_ripple": [thrust * g(k * angle) for k in (2, 4, 6) for g in (np.sin, np.cos)],
        "asymmetric_friction": [np.ones_like(v), np.abs(v)],
        "cable_force": [np.ones_like(v), place, place**2, place**3],
        "position_dependent_friction": [side * place**k for k in (1, 2, 3, 4)],
        "quadratic_drag": [v * np.abs(v)],
        "input_delay": [np.gradient(thrust, 1e-3)],
        "force_saturation": [thrust * np.abs(current), thrust * current**2],
        "thermal_derating": [thrust * heat, thrust * heat**2],
        "end_effect": [thrust * place**2, thrust * place**4],
        "friction_drift": [side * t, side * t**2],
        "flexible_load": [np.gradient(np.gradient(thrust, 1e-3), 1e-3)],
    }


def explained(axis: AxisDescription, sizes: AxisSizes, name: str) -> dict[str, float]:
    """Share of what a refitted base leaves that each listed form explains."""
    reached = calibrate(axis, effect(name, axis), 0.3, sizes)
    assert reached is not None
    smooth, curve = bump(HALF_WIDTH, 1e-3)
    missing: list[Array] = []
    columns: dict[str, list[Array]] = {}
    for run in run_all(axis, [reached[0]], substeps=COARSE):
        error = np.convolve(run.reading - run.y, curve, "valid")
        missing.append(run.mass * (np.convolve(run.acceleration - run.base_acceleration, smooth, "valid") + error))
        table = forms(axis, run.y, run.v, run.thrust, run.states[:, 3], run.t)
        table["base"].append(run.acceleration)
        for listed, group in table.items():
            columns.setdefault(listed, []).append(np.stack([np.convolve(c, smooth, "valid") for c in group], 1))
    target = np.concatenate(missing)
    base = np.concatenate(columns.pop("base"))

    def left(design: Array) -> float:
        return float(np.sum((target - design @ np.linalg.lstsq(design, target, rcond=None)[0]) ** 2))

    whole = left(base)
    return {listed: 1 - left(np.hstack([base, np.concatenate(group)])) / whole for listed, group in columns.items()}


@pytest.mark.parametrize("name", OUTSIDE)
def test_no_listed_effect_explains_one_outside(calm: AxisDescription, sizes: AxisSizes, name: str) -> None:
    assert max(explained(calm, sizes, name).values()) < 0.5


@pytest.mark.parametrize("name", ["quadratic_drag", "thermal_derating", "constant_force"])
def test_the_same_forms_do_explain_the_listed_ones(calm: AxisDescription, sizes: AxisSizes, name: str) -> None:
    form = "asymmetric_friction" if name == "constant_force" else name
    assert explained(calm, sizes, name)[form] > 0.7
