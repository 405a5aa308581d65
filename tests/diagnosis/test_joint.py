"""The joint fit: known parameters come back from anywhere; what nothing tells stays; noise of inputs draws nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.balance import Balance
from linid.diagnosis.base import numbered
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge, judge_of
from linid.diagnosis.masses import _level_by_size, _scaled
from linid.physics.effects.registry import canonical
from linid.physics.model import Model
from linid.recording.recording import Recording
from tests.diagnosis.machine import COULOMB, MASS, VISCOUS, K, Noise, recording

TRUE = {
    "force_constant": K,
    "coulomb_force": COULOMB,
    "static_force": 1.01 * COULOMB,
    "stribeck_velocity": 1e-3,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 1e5,
    "bristle_damping": 100.0,
    "viscous_friction": VISCOUS,
    "mass": MASS,
}


def judged(noise: Noise, reference: dict[str, float]) -> Judge:
    runs: list[Recording] = [
        recording(f"run_{k}", noise=noise, seed=k, split="held_out" if k == 3 else "fit") for k in range(4)
    ]
    balance = Balance(Model("force"), numbered(runs), 1, 1)
    return judge_of(balance, Model("force"), reference, {"mass": MASS}, {}, 1)


def fitted(judge: Judge, first: dict[str, float]) -> Fitted:
    return judge.fits.fit(Model("force"), first, {}, (0, 1, 2), THOROUGH)


@pytest.mark.parametrize("factor", [0.02, 0.3, 3.0, 40.0])
def test_forces_come_back_from_far_away(factor: float) -> None:
    """The residual is linear in the forces: a fit that starts at a fiftieth arrives all the same."""
    judge = judged(Noise(encoder=1e-7), TRUE)
    found = fitted(judge, {**TRUE, "force_constant": factor * K, "coulomb_force": factor * COULOMB})
    assert found.values["force_constant"] == pytest.approx(K, rel=0.01)
    assert found.values["viscous_friction"] == pytest.approx(VISCOUS, rel=0.03)
    assert found.values["mass"] == MASS
    assert abs(found.level) < 0.3


def test_noise_of_the_logged_current_does_not_draw_the_force_constant_to_zero() -> None:
    """Plain least squares would lose the share of noise in the input's power (attenuation)."""
    judge = judged(Noise(encoder=1e-7, current=0.05), TRUE)
    found = fitted(judge, TRUE)
    rows = judge.fits.rows_of((0, 1, 2))
    balance = judge.balance
    current = balance.rows.current[rows]
    assert np.std(current) > 0.05
    assert found.values["force_constant"] == pytest.approx(K, rel=0.03)


def test_a_fit_knows_what_it_leaves_of_recordings_that_it_is_not_fitted_to() -> None:
    """Its own ones alone are computed on the way; a fit that is remembered says the same."""
    judge = judged(Noise(encoder=1e-7, current=0.01), TRUE)
    for _ in range(2):
        found = fitted(judge, {**TRUE, "coulomb_force": 0.5 * COULOMB})
        assert np.array_equal(found.residual, judge.balance.residual(found.model, found.vector))
    assert np.any(found.residual[judge.fits.rows_of((3,))])


def test_what_no_row_tells_stays_where_it_is() -> None:
    """A machine that only slides says nothing of its presliding."""
    judge = judged(Noise(encoder=1e-7), TRUE)
    found = fitted(judge, TRUE)
    start = TRUE["coulomb_force"] / TRUE["bristle_stiffness"]
    now = found.values["coulomb_force"] / found.values["bristle_stiffness"]
    assert 0.3 < now / start < 3.0


def test_a_block_counts_once_however_wrong_it_is() -> None:
    """A burst in one block moves the sliding friction by less than its interval."""
    plain = judged(Noise(encoder=1e-7), TRUE)
    runs = list(plain.balance.recordings)
    y = runs[0].y.copy()
    y[1500:1560] += 1e-4 * np.hanning(60)
    runs[0] = replace(runs[0], y=y)
    balance = Balance(Model("force"), runs, 1, 1)
    judge = judge_of(balance, Model("force"), TRUE, {"mass": MASS}, {}, 1)
    assert fitted(judge, TRUE).values["force_constant"] == pytest.approx(K, rel=0.03)


def weighed(reference: dict[str, float]) -> Judge:
    """Four runs of the machine, one of them with 1 kg more, the mass unknown."""
    added = (0.0, 0.0, 1.0, 0.0)
    runs = [
        recording(f"run_{k}", noise=Noise(encoder=1e-7), seed=k, split="held_out" if k == 3 else "fit", added_mass=kg)
        for k, kg in enumerate(added)
    ]
    balance = Balance(Model("force"), numbered(runs), 1, 1)
    return judge_of(balance, Model("force"), reference, {}, {}, 1)


@pytest.mark.parametrize("factor", [0.3, 0.8, 1.3, 4.0])
def test_one_recording_with_another_mass_tells_the_size_of_all_forces(factor: float) -> None:
    """Mass and forces in proportion are a valley that all other recordings leave flat."""
    forces = {"force_constant", "coulomb_force", "static_force", "bristle_stiffness", "bristle_damping", "mass"}
    forces.add("viscous_friction")
    first = {name: factor * x if name in forces else x for name, x in TRUE.items()}
    judge = weighed(first)
    found = fitted(judge, first)
    assert found.values["mass"] == pytest.approx(MASS, rel=0.01)
    assert found.values["force_constant"] == pytest.approx(K, rel=0.01)


def test_the_mass_alone_moves_no_recording_without_another_mass() -> None:
    """Forces are searched for the base's mass, so the mass is told by added masses alone."""
    judge = weighed(TRUE)
    found = fitted(judge, TRUE)
    slope = judge.fits.slopes(found)["mass"]
    owner = judge.balance.rows.recording
    told = [float(np.abs(slope[owner == k]).max()) for k in range(4)]
    assert max(told[0], told[1], told[3]) < 1e-6 * told[2]


@pytest.mark.parametrize("effect", ["", "wave: c_1 * cos(40 * y) * sign(v)", "knee: c_1 * min(max(F, -2), 2)"])
def test_the_criterion_by_the_size_of_all_forces_is_that_of_simulations(effect: str) -> None:
    """Where all forces grow together, two sizes tell the others; where a formula holds newtons, each is simulated."""
    judge = weighed(TRUE)
    model = Model("force", canonical((effect,)) if effect else ())
    own = {p.name: 0.3 for p in model.parameters if p.name.endswith("_c_1")}
    found = judge.fits.at(model, {**TRUE, **own}, {}, (0, 1, 2))
    level, rows = _level_by_size(judge.fits, found), judge.fits.rows_of((0, 1, 2))
    sizes = (-0.9, -0.2, 0.4, 0.9)
    simulated = [judge.fits.level(*judge.fits.unfitted(model, _scaled(found, one), {}), rows) for one in sizes]
    assert [level(one) for one in sizes] == pytest.approx(simulated, abs=1e-9)
    assert np.ptp(simulated) > 0.1
