"""Negative controls: a campaign too poor to decide, and motion that is nothing but noise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from linid.diagnosis.diagnose import diagnose
from linid.recording.recording import Recording, in_order
from tests.simulation.axis_with_effects import campaign_with, simulate

ENCODER = 1e-7  # m


def coast_downs(effect: str, values: dict[str, float], speed: float) -> list[Recording]:
    """Free wheels from about `speed` m/s in both directions, two in eight held out, of an axis with one effect."""
    generator = np.random.default_rng(4)
    t = np.arange(0.0, 0.7, 1e-3)
    out = []
    for k, direction in enumerate((1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, -1.0)):
        split = "held_out" if k % 4 == 3 else "fit"
        empty = Recording(
            f"wheel_{k}", t, np.zeros_like(t), kind="free_wheel", added_mass=0.3 * (k % 2), split=split,  # type: ignore[arg-type]
        )  # fmt: skip
        start = (-0.12 * direction + 0.01 * (k % 3), direction * speed * (0.9 + 0.06 * (k % 4)), math.nan)
        y = simulate((effect,), empty, start, 4, values=values, kind="friction")
        out.append(replace(empty, y=y + ENCODER * generator.standard_normal(y.size)))
    return list(in_order(out))


def test_too_poor_a_campaign_gets_no_guess() -> None:
    """Air drag and eddy currents bend the same way over a short range of speeds."""
    slow = coast_downs("quadratic_drag", {"drag_coefficient": 1.5}, 0.6)
    verdict = diagnose("slow", slow, "friction", jobs=2, seed=1).diagnosis.verdict
    assert verdict.status == "ambiguous", verdict
    assert {"quadratic_drag", "eddy_current_drag"} <= {*verdict.effects, *verdict.equivalent}


def test_a_richer_one_gets_its_name() -> None:
    """A guideway that is tighter in some places, passed in both directions: named, alone."""
    place = {"friction_low": -0.3, "friction_high": 0.3, "friction_slope": 0.12, "friction_sine_1": 0.1}
    recordings = coast_downs("position_dependent_friction", place, 0.6)
    verdict = diagnose("both ways", recordings, "friction", jobs=2, seed=1).diagnosis.verdict
    assert (verdict.status, verdict.effects) == ("identified", ("position_dependent_friction",))


def test_noise_in_place_of_motion_has_no_cause() -> None:
    """Positions that wander at random under unrelated currents: nothing may be named."""
    random = np.random.default_rng(3)
    wandering = []
    for k, recording in enumerate(campaign_with(())):
        if recording.kind != "free_wheel":
            walk = np.cumsum(np.cumsum(np.convolve(random.standard_normal(recording.y.size), np.hanning(40), "same")))
            recording = replace(recording, y=0.02 * walk / np.ptp(walk))
        wandering.append(replace(recording, split="held_out" if k in (3, 6) else "fit"))
    verdict = diagnose("noise", wandering, "sine", jobs=2, seed=1).diagnosis.verdict
    assert verdict.status == "unknown", verdict
