"""Screening: what a regression promises of an effect, from bases that are not where they should be."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from linid.diagnosis.balance import Balance
from linid.diagnosis.base import fit_base_model, numbered
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.forward import CONTENDING, MOMENTS_GAIN, PROPOSED_CERTAINTY, contenders, gained
from linid.diagnosis.judge import judge_of
from linid.diagnosis.means import Means
from linid.diagnosis.screen import LEAST_CONTRAST, Screening
from linid.diagnosis.steps_of_selection import again, extended
from linid.physics.model import Model
from linid.recording.recording import Recording
from tests.diagnosis import machine
from tests.diagnosis.test_diagnose import recordings
from tests.diagnosis.test_joint import TRUE


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_a_delay_is_seen_from_a_base_at_the_wrong_phase(turn: float) -> None:
    """Inputs that come 2 ms late: commutated ones look like a wrong phase. Thrust and phase are found anew beside a
    delay, which explains more than a linear step from where the base is (0.63 of the gap without a turn)."""
    late = tuple(
        replace(r, phase_currents=np.roll(r.phase_currents, -2, axis=1)) if r.phase_currents is not None else r
        for r in recordings()
    )
    base = fit_base_model(late, "sine", {}, Means(1), [])
    fits, values = base.judge.fits, dict(base.fitted.values)
    values["commutation_offset"] += turn
    values["force_constant"] /= math.cos(turn)
    turned = fits.at(base.fitted.model, values, {}, base.fitted.recordings)
    screening = Screening(fits, turned, 1)
    (found,) = screening.screen(turned, only=["input_delay"])
    assert found.trial.explained > 0.75
    assert screening.beside(turned, found)["mass"] == pytest.approx(values["mass"], rel=0.03)
    fitted = again(fits, extended(fits, screening, (turned, found), 1), turned.recordings, THOROUGH)
    assert fitted.values["input_delay"] == pytest.approx(2e-3, abs=5e-5)


def test_no_promise_hangs_on_how_many_effects_are_tried_at_once() -> None:
    base = fit_base_model(recordings(), "sine", {}, Means(1), [])
    alone, beside = (Screening(base.judge.fits, base.fitted, jobs).screen(base.fitted) for jobs in (1, 3))
    assert len(alone) > 10
    assert alone == beside


def test_a_regression_is_as_sure_of_a_force_as_the_judge_of_its_fit() -> None:
    """A force of place that the model lacks, weak beside the noise: the promise is kept, by as many deviations."""
    runs = []
    for k in range(6):
        one = machine.recording(
            f"run_{k}", noise=machine.Noise(encoder=1e-6), seed=k, split="held_out" if k > 3 else "fit"
        )
        error = lsim(([1.0], [machine.MASS, machine.VISCOUS, 0.0]), 0.1 * np.sin(60.0 * one.y), one.t)[1]
        runs.append(replace(one, y=one.y + error))
    model = Model("force")
    judge = judge_of(Balance(model, numbered(runs), 1, 1), model, TRUE, {"mass": machine.MASS}, {}, 1)
    base = judge.fits.fit(model, TRUE, {}, (0, 1, 2, 3), THOROUGH)
    screening = Screening(judge.fits, base, 1)
    found = {one.name: one for one in screening.screen(base)}
    cogging = found["cogging"]
    evidence = gained(judge.fits, base, extended(judge.fits, screening, (base, cogging), 1))
    assert cogging.trial.certainty == pytest.approx(evidence.certainty, rel=0.2) and evidence.certainty > 5.0
    assert cogging.gain == pytest.approx(evidence.gain, rel=0.2)
    assert found["thermal_derating"].trial.certainty < PROPOSED_CERTAINTY


def pushed(one: Recording, size: float, start: float, duration: float) -> Recording:
    """A recording of the machine, which slides, while a raised cosine pushes it: m e'' + sigma_2 e' = F."""
    share = (one.t - start) / duration
    force = np.where((share > 0) & (share < 1), 0.5 * size * (1 - np.cos(2 * np.pi * share)), 0.0)
    error = lsim(([1.0], [machine.MASS, machine.VISCOUS, 0.0]), force, one.t)[1]
    return replace(one, y=one.y + error)


@pytest.mark.parametrize("count", [12, 48])
def test_a_push_stands_out_however_long_the_campaign_is(count: int) -> None:
    """0.5 N for 0.12 s: of the log power the less, the more recordings there are."""
    noise = machine.Noise(encoder=1e-6)
    runs = [
        machine.recording(f"run_{k}", noise=noise, seed=k, split="held_out" if k % 3 else "fit") for k in range(count)
    ]
    found = {}
    for size in (0.0, 0.5):
        one = tuple(numbered([*runs[:5], pushed(runs[5], size, 1.43, 0.12), *runs[6:]]))
        model = Model("force")
        judge = judge_of(Balance(model, one, 1, 1), model, TRUE, {"mass": machine.MASS}, {}, 1)
        places = tuple(k for k, r in enumerate(one) if r.split == "fit")
        base = judge.fits.fit(model, TRUE, {}, places, THOROUGH)
        (found[size],) = Screening(judge.fits, base, 1).screen(base, only=["external_disturbance"])
    push, nothing = found[0.5].trial, found[0.0].trial
    assert push.values["disturbance_recording_1"] == 6.0
    assert push.values["disturbance_start_1"] == pytest.approx(1.43, abs=0.06)
    assert push.amplitudes["disturbance_force_1"] == pytest.approx(0.5, rel=0.4)
    assert push.contrast > LEAST_CONTRAST > 3.0 * nothing.contrast
    assert contenders([found[0.5]], CONTENDING[0]) == [found[0.5]] and contenders([found[0.0]], CONTENDING[-1]) == []
    if count > 12:
        assert push.explained < MOMENTS_GAIN
