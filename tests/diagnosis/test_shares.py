"""Shares of two causes of a machine whose motion is chosen and whose current follows from it, against closed forms."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from linid.diagnosis.base import Base, fit_base_model, numbered
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.joint import Fitted
from linid.diagnosis.means import Means
from linid.diagnosis.screen import Screening
from linid.diagnosis.select import fit_effects
from linid.diagnosis.shares import Shares, shares_of
from linid.recording.recording import Recording
from tests.diagnosis.machine import COULOMB, MASS, VISCOUS, K

WAVENUMBER = 300.0  # rad/m
EFFECTS = ("cogging", "quadratic_drag")


def causes(y: np.ndarray, v: np.ndarray) -> dict[str, np.ndarray]:
    """Forces of both causes, N."""
    return {"cogging": 0.8 * np.sin(WAVENUMBER * y), "quadratic_drag": -4.0 * v**2}


def run(number: int) -> tuple[Recording, dict[str, np.ndarray]]:
    """A recording that slides one way, and at its samples speed, current and forces of the causes."""
    t = np.arange(3001) * 1e-3
    generator = np.random.default_rng(number)
    swing, rate, phase = generator.uniform([0.05, 4.0, 0.0], [0.2, 9.0, 6.0])
    v = 0.45 + swing * np.sin(rate * t + phase) + 0.1 * np.sin(2.3 * rate * t)
    a = swing * rate * np.cos(rate * t + phase) + 0.23 * rate * np.cos(2.3 * rate * t)
    y = 0.45 * t - swing / rate * (np.cos(rate * t + phase) - np.cos(phase))
    y -= 0.1 / (2.3 * rate) * (np.cos(2.3 * rate * t) - 1.0)
    forces = causes(y, v)
    i = (MASS * a + COULOMB + VISCOUS * v - sum(forces.values())) / K
    split = "held_out" if number > 3 else "fit"
    seen = y + 1e-7 * generator.standard_normal(t.size)
    return Recording(f"run_{number}", t, seen, drive_input=i, split=split), {"v": v, "i": i, **forces}


@cache
def found() -> tuple[Base, Fitted, Shares]:
    runs = [run(k) for k in range(1, 6)]
    recordings = numbered([r for r, _ in runs])
    base = fit_base_model(recordings, "force", {"mass": MASS}, Means(2), [])
    best = fit_effects(base, Screening(base.judge.fits, base.fitted, 2), EFFECTS)
    assert best is not None
    return base, best, shares_of(base.judge, base.fitted, best, 1)


def test_shares_are_covariances_with_what_the_base_cannot_absorb() -> None:
    """Current, a constant and speed take off what they can; the rest is shared out as <r_e, r> / <r, r>."""
    runs = [run(k) for k in range(1, 6)]
    fitted, held = ([values for r, values in runs if r.split == split] for split in ("fit", "held_out"))

    def stacked(group: list[dict[str, np.ndarray]], names: tuple[str, ...]) -> np.ndarray:
        return np.array([np.concatenate([values[name] for values in group]) for name in names])

    columns = [np.vstack([stacked(group, ("i", "v")), np.ones(3001 * len(group))]) for group in (fitted, held)]
    taken = np.linalg.lstsq(columns[0].T, stacked(fitted, EFFECTS).T, rcond=None)[0]
    left = stacked(held, EFFECTS) - taken.T @ columns[1]
    whole = left.sum(axis=0)
    shares = found()[2]
    for name, part in zip(EFFECTS, left, strict=True):
        assert shares.portions[name].share == pytest.approx(part @ whole / (whole @ whole), abs=0.03), name


def test_shares_and_what_is_left_are_the_whole_gap() -> None:
    shares = found()[2]
    total = sum(portion.share for portion in shares.portions.values())
    assert total + shares.unexplained[0] == pytest.approx(1.0, abs=1e-9)
    assert shares.closed[0] == pytest.approx(1.0 - shares.unexplained[0])
    assert shares.after < 0.5 < shares.before and abs(shares.unexplained[0]) < 0.02


def test_an_interval_holds_its_share_and_first_and_last_frame_it_where_causes_are_alike() -> None:
    for portion in found()[2].portions.values():
        assert portion.low < portion.share < portion.high
        assert portion.last_in == pytest.approx(portion.share, abs=0.2)


def test_a_fit_follows_a_curved_valley_to_its_end() -> None:
    """Coulomb force, viscous friction and a drag of any power nearly stand in for each other at one-way speeds."""
    base, best, _ = found()
    astray = {"coulomb_force": 1.23, "viscous_friction": 9.82, "drag_coefficient": 0.98, "drag_power": 2.96}
    start = {**best.values, **astray}
    fits = base.judge.fits
    assert fits.level_at(best.model, start, best.preset, best.recordings) > 0.03
    one = fits.fit(best.model, start, best.preset, best.recordings, THOROUGH)
    assert one.values["drag_power"] == pytest.approx(2.0, abs=0.02)
    assert one.values["viscous_friction"] == pytest.approx(VISCOUS, rel=0.02)
    assert one.values["drag_coefficient"] == pytest.approx(4.0, rel=0.05)


def test_the_floor_is_the_noise_of_the_sensors() -> None:
    """White noise of 0.1 um gives the weak form's second difference a known deviation."""
    base, _, _ = found()
    balance = base.judge.balance
    part = balance.part(base.fitted.model)
    for index in range(5):
        curve = np.diff(part.kernels[index], 2, prepend=[0, 0], append=[0, 0]) / 1e-6
        expected = 1e-7 * float(np.sqrt(np.sum(curve**2)))
        noise = base.judge.noise.encoder[np.unique(balance.rows.bin[balance.rows.recording == index])]
        assert np.sqrt(np.mean(noise)) == pytest.approx(expected, rel=0.3)
