"""Screening: what a regression promises of an effect, from bases that are not where they should be."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.base import fit_base_model
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.means import Means
from linid.diagnosis.screen import Screening
from linid.diagnosis.steps_of_selection import again, extended
from tests.diagnosis.test_diagnose import recordings


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
    assert found.trial.values["mass"] == pytest.approx(values["mass"], rel=0.03)
    fitted = again(fits, extended(fits, screening, (turned, found), 1), turned.recordings, THOROUGH)
    assert fitted.values["input_delay"] == pytest.approx(2e-3, abs=5e-5)


def test_no_promise_hangs_on_how_many_effects_are_tried_at_once() -> None:
    base = fit_base_model(recordings(), "sine", {}, Means(1), [])
    alone, beside = (Screening(base.judge.fits, base.fitted, jobs).screen(base.fitted) for jobs in (1, 3))
    assert len(alone) > 10
    assert alone == beside
