"""Negative controls: a campaign too poor to decide, and motion that is nothing but noise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from linid.diagnosis.diagnose import diagnose
from linid.diagnosis.means import Means
from linid.recording.recording import Recording, in_order
from tests.simulation.axis_with_effects import AXIS, campaign_with, simulate

ENCODER = 1e-7  # m


def coast_downs(effect: str, values: dict[str, float], speed: float) -> list[Recording]:
    """Free wheels from about `speed` m/s in both directions, two in eight held out, of an axis with one effect."""
    generator = np.random.default_rng(4)
    t = np.arange(0.0, 0.7, 1e-3)
    out = []
    for k, direction in enumerate((1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, -1.0)):
        split = "held_out" if k % 4 == 3 else "fit"
        empty = Recording(
            f"wheel_{k}",
            t,
            np.zeros_like(t),
            kind="free_wheel",
            added_mass=0.3 * (k % 2),
            split=split,  # type: ignore[arg-type]
        )
        start = (-0.12 * direction + 0.01 * (k % 3), direction * speed * (0.9 + 0.06 * (k % 4)), math.nan)
        y = simulate((effect,), empty, start, 4, values=values, kind="friction")
        out.append(replace(empty, y=y + ENCODER * generator.standard_normal(y.size)))
    return list(in_order(out))


def driven(force: float) -> list[Recording]:
    """Reversing runs under one current, with a constant force; no free wheels."""
    generator = np.random.default_rng(6)
    t = np.arange(0.0, 2.0, 1e-3)
    out = []
    for k, (size, rate) in enumerate(((0.9, 5.0), (1.2, 6.0), (1.0, 7.0), (0.8, 4.5), (1.1, 5.5), (1.3, 6.5))):
        split = "held_out" if k % 3 == 2 else "fit"
        current = size * np.cos(rate * t + k)
        empty = Recording(f"run_{k}", t, np.zeros_like(t), drive_input=current, split=split)  # type: ignore[arg-type]
        values = {**AXIS, "constant_force": force}
        y = simulate(("constant_force",), empty, (0.0, 0.05, math.nan), 4, values=values, kind="force")
        out.append(replace(empty, y=y + ENCODER * generator.standard_normal(y.size)))
    return list(in_order(out))


def held_back(force: float) -> list[Recording]:
    """The same without that force but in two slow, steady runs, one of them held out."""
    generator = np.random.default_rng(8)
    t = np.arange(0.0, 2.0, 1e-3)
    out = driven(0.0)
    friction = AXIS["coulomb_force"] + AXIS["viscous_friction"] * 0.05
    for k, split in enumerate(("fit", "held_out")):
        current = (friction - force) / AXIS["force_constant"] * (1.0 + 0.02 * np.sin(2.0 * t + k))
        empty = Recording(f"slow_{k}", t, np.zeros_like(t), drive_input=current, split=split)  # type: ignore[arg-type]
        values = {**AXIS, "constant_force": force}
        y = simulate(("constant_force",), empty, (0.0, 0.05, math.nan), 4, values=values, kind="force")
        out.append(replace(empty, y=y + ENCODER * generator.standard_normal(y.size)))
    return list(in_order(out))


def test_a_run_that_something_holds_back_is_not_heavier() -> None:
    """Where the axis hardly accelerates, a large mass shrinks whatever is wrong, and explains nothing."""
    verdict = diagnose("held back", held_back(0.3), "force", means=Means(2)).diagnosis.verdict
    assert "payload_change" not in verdict.effects, verdict


def test_too_poor_a_campaign_gets_no_guess() -> None:
    """While the drive is always on, a force and an offset of the current push the same way."""
    known = {"force_constant": AXIS["force_constant"]}
    verdict = diagnose("driven", driven(0.5), "force", known=known, means=Means(2)).diagnosis.verdict
    assert verdict.status in ("explained", "partly explained"), verdict
    assert {"constant_force", "current_offset"} <= {*verdict.effects, *verdict.equivalent}


def test_a_drag_that_bends_upwards_is_no_eddy_current() -> None:
    """Induced currents brake ever less per speed, air ever more: even a short range of speeds tells them apart."""
    slow = coast_downs("quadratic_drag", {"drag_coefficient": 1.5}, 0.6)
    verdict = diagnose("slow", slow, "friction", means=Means(2)).diagnosis.verdict
    assert (verdict.status, verdict.effects) == ("explained", ("quadratic_drag",)), verdict


def test_a_constant_force_is_not_called_a_cable() -> None:
    """A cable whose spring and hysteresis come out next to nothing is a constant force."""
    recordings = coast_downs("constant_force", {"constant_force": 0.05}, 0.6)
    verdict = diagnose("tilted", recordings, "friction", means=Means(2)).diagnosis.verdict
    assert verdict.effects == ("constant_force",), verdict


def test_a_richer_one_gets_its_name() -> None:
    """A guideway that is tighter in some places, passed in both directions: named, alone."""
    place = {f"friction_place_{k}": -0.3 + 0.06 * (k - 1) for k in range(1, 12)}
    for k in (1, 2, 3, 4, 5, 7, 8, 9, 10, 11):
        share = 0.1 * (k - 1)
        place[f"friction_at_{k}"] = 0.12 * (2.0 * share - 1.0) - 0.1 * math.sin(2.0 * math.pi * share)
    recordings = coast_downs("position_dependent_friction", place, 0.6)
    verdict = diagnose("both ways", recordings, "friction", means=Means(2)).diagnosis.verdict
    assert verdict.effects == ("position_dependent_friction",)


def test_noise_in_place_of_motion_has_no_cause() -> None:
    """Positions that wander at random under unrelated currents: nothing may be named."""
    random = np.random.default_rng(3)
    wandering = []
    for k, recording in enumerate(campaign_with(())):
        if recording.kind != "free_wheel":
            walk = np.cumsum(np.cumsum(np.convolve(random.standard_normal(recording.y.size), np.hanning(40), "same")))
            recording = replace(recording, y=0.02 * walk / np.ptp(walk))
        wandering.append(replace(recording, split="held_out" if k in (3, 6) else "fit"))
    verdict = diagnose("noise", wandering, "sine", means=Means(2)).diagnosis.verdict
    assert verdict.status == "unknown", verdict
