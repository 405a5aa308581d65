"""Where: shares by coordinate against closed forms and pure noise."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from linid.diagnosis.balance import Rows
from linid.diagnosis.locate import ceiling, coordinates, locate

RECORDINGS, LENGTH = 6, 1500
WAVENUMBER = 200.0


def balance(seed: int) -> SimpleNamespace:
    """Rows of slow swings over 0.3 m at 1 kHz."""
    random = np.random.default_rng(seed)
    t = np.tile(np.arange(LENGTH) * 1e-3, RECORDINGS)
    owner = np.repeat(np.arange(RECORDINGS), LENGTH)
    rate = 2.0 * np.pi * random.uniform(0.4, 0.9, RECORDINGS)[owner]
    y, v, a = 0.15 * np.sin(rate * t), 0.15 * rate * np.cos(rate * t), -0.15 * rate**2 * np.sin(rate * t)
    block = owner * 15 + (t // 0.1).astype(int)
    rows = Rows(
        np.arange(t.size), owner, block, t, y, v, a, np.zeros(t.size), np.zeros(t.size, dtype=bool), (7,) * RECORDINGS
    )
    return SimpleNamespace(rows=rows)


def smooth_noise(size: int, seed: int) -> np.ndarray:
    white = np.random.default_rng(seed).standard_normal(size + 20)
    return np.asarray(np.convolve(white, np.ones(9) / 3.0, mode="same")[10:-10])


def shares(residual: np.ndarray, data: SimpleNamespace) -> dict[str, object]:
    found = locate(
        data, residual, np.ones(RECORDINGS), np.ones(RECORDINGS), coordinates(data, "linear", WAVENUMBER), seed=1
    )
    return {s.coordinate: s for s in found}


def test_a_force_along_the_field_is_found_there() -> None:
    data = balance(1)
    noise = smooth_noise(data.rows.y.size, 2)
    residual = 1.5 * np.sin(WAVENUMBER * data.rows.y) + noise
    share = 0.5 * 1.5**2 / (0.5 * 1.5**2 + np.var(noise))
    found = shares(residual, data)
    pole = found["pole_phase"]
    assert abs(pole.share - share) < 0.05
    assert pole.p_value == 0.01
    assert all(found[name].share < 0.15 for name in ("velocity", "direction", "time", "recording"))
    assert np.max(np.abs(pole.mean - 1.5 * np.sin(pole.x))) < 0.3


def test_a_force_that_turns_with_the_direction_is_found_there() -> None:
    data = balance(3)
    found = shares(np.sign(data.rows.v) + 0.5 * smooth_noise(data.rows.y.size, 4), data)
    assert found["direction"].share > 0.7
    assert found["direction"].share >= found["time"].share + 0.3
    assert found["pole_phase"].share < 0.05


def test_noise_depends_on_nothing() -> None:
    """Of 8 coordinates and 6 draws of noise hardly one in a hundred has p = 0.01, and no share is worth a word."""
    small = 0
    for seed in range(6):
        data = balance(10 + seed)
        found = shares(smooth_noise(data.rows.y.size, 50 + seed), data)
        assert all(s.share < 0.05 for s in found.values())
        small += sum(s.p_value <= 0.01 for s in found.values())
    assert small <= 4


def test_the_ceiling_is_what_smooth_functions_could_close() -> None:
    data = balance(7)
    rows = data.rows
    axes = coordinates(data, "linear", WAVENUMBER)
    noise = smooth_noise(rows.y.size, 8)
    floor = np.full(RECORDINGS, float(np.std(noise)))
    smooth = np.where(rows.y > 0.05, 2.0, -1.0) * np.sign(rows.v)
    # The step lies within a bin, and the means are shrunk: not all of it is reached.
    assert ceiling(data, smooth + noise, np.ones(RECORDINGS), axes, floor) > 0.75
    unseen = 2.0 * smooth_noise(rows.y.size, 9)
    assert ceiling(data, unseen + noise, np.ones(RECORDINGS), axes, floor) < 0.15
