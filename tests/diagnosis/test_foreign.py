"""A simulation of the user's own as the base: what it has wrong is told without a look inside it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import linid
from linid.api import diagnose
from linid.errors import DataError, UsageError
from linid.interface.campaign import Campaign
from linid.recording.recording import Recording
from tests.diagnosis import machine

HEAVIER = 0.3  # kg that the machine moves and its simulation does not know
SPEEDS = (0.2, 0.3, 0.5, 0.8, 1.1, 1.4, 0.35, 0.9)  # m/s at the starts
NOISE = 2e-7  # m


def both(seed: int = 3) -> tuple[Recording, ...]:
    """The machine and its simulation, each solved by hand, under the same inputs."""
    out = []
    for k, speed in enumerate(SPEEDS, 1):
        one = machine.recording(f"run_{k}", duration=2.0, number=k, split="held_out" if k % 4 == 0 else "fit")
        noise = NOISE * np.random.default_rng([seed, k]).standard_normal(one.t.size)
        y = machine.position(one.t, v0=speed, added=HEAVIER) + noise
        out.append(replace(one, y=y, simulated=machine.position(one.t, v0=speed)))
    return tuple(out)


def campaign(recordings: tuple[Recording, ...]) -> Campaign:
    return Campaign.of(recordings, known={"force_constant": machine.K})


def test_what_a_simulation_has_wrong_is_told_without_a_look_inside() -> None:
    recordings = both()
    found = diagnose(campaign(recordings), "force", simulated=True, jobs=2)
    told = found.found.diagnosis
    # The model in the simulation's place has the mass that the simulation has.
    assert found.before["mass"].value == pytest.approx(machine.MASS, rel=1e-3)
    (change,) = told.changes
    assert change.parameter == "mass" and change.after == pytest.approx(machine.MASS + HEAVIER, rel=2e-3)
    assert told.verdict.status == "explained" and told.verdict.effects == ("payload_change",)
    held = [r for r in recordings if r.split == "held_out"]
    errors = [np.sqrt(np.mean((r.simulated - r.y) ** 2)) / np.std(r.y) for r in held]
    assert f"misses {100.0 * np.sqrt(np.mean(np.square(errors))):.3g} % of the motion" in told.assumptions[0]


def test_a_simulation_that_is_missing_or_no_number_is_refused() -> None:
    first, *others = both()
    with pytest.raises(UsageError, match="run_1: has no simulated position"):
        diagnose(campaign((replace(first, simulated=None), *others)), "force", simulated=True)
    broken = np.where(first.t < 1.0, first.simulated, np.nan)
    with pytest.raises(DataError, match="simulated to no number from 1 s on"):
        diagnose(campaign((replace(first, simulated=broken), *others)), "force", simulated=True)


def test_simulated_positions_are_a_column_or_a_file_on_their_own_grid(tmp_path: Path) -> None:
    t = np.arange(0.0, 1.0005, 1e-3)
    rows = [f"{x:.3f};{1e3 * np.sin(3 * x):.6f};{1e3 * np.sin(3 * x + 0.1):.6f};{np.cos(x):.3f}" for x in t]
    head = "time (s);position (mm);mine (mm);i_q (A)"
    (tmp_path / "run.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    fine = np.arange(-0.01, 1.02, 2.5e-4)
    other = [f"{x:.5f};{1e3 * np.sin(3 * x + 0.1):.6f}" for x in fine]
    (tmp_path / "simulation.csv").write_text("\n".join(["time (s);position (mm)", *other]) + "\n", encoding="utf-8")
    expected = np.sin(3 * t + 0.1)
    for line in ("channels: {simulated: mine}", "simulated: simulation.csv"):
        text = f"recordings:\n  - {{file: run.csv, {line}}}\n"
        (tmp_path / "campaign.yaml").write_text(text, encoding="utf-8")
        (one,) = linid.read(tmp_path / "campaign.yaml").recordings
        assert one.simulated is not None
        np.testing.assert_allclose(one.simulated, expected, atol=2e-9)
    (tmp_path / "simulation.csv").write_text(
        "\n".join(["time (s);position (mm)", *other[:2000]]) + "\n", encoding="utf-8"
    )
    with pytest.raises(DataError, match="Simulate the whole recording"):
        linid.read(tmp_path / "campaign.yaml")
