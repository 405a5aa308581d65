"""What is named must help to predict the motion, whatever the balance of forces says of it."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from linid.diagnosis.balance import Balance
from linid.diagnosis.base import numbered
from linid.diagnosis.foretold import ahead_gain, idle, speaks_against, telling
from linid.diagnosis.held_out_tests import Part
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Evidence, Judge, judge_of
from linid.physics.model import Model
from tests.diagnosis import machine
from tests.diagnosis.machine import MASS
from tests.diagnosis.test_joint import TRUE

EXTRA = 0.3  # N, of a force that the base lacks
MODEL = Model("force")
PUSHED = MODEL.with_effects(("constant_force",))
CERTAIN, BEYOND_DOUBT = Evidence(1.0, 3.5, 0.9, 1.0, 0.9), Evidence(1.0, 9.0, 0.9, 1.0, 0.9)


@pytest.fixture(scope="module")
def judge() -> Judge:
    """Of two runs under a force that the base lacks, the second one held out."""
    runs = [
        machine.recording(f"run_{k}", extra=EXTRA, noise=machine.Noise(encoder=1e-7), seed=k, split=split)
        for k, split in enumerate(("fit", "held_out"))
    ]
    return judge_of(Balance(MODEL, numbered(runs), 1, 1), MODEL, TRUE, {"mass": MASS}, {}, 1)


def with_force(judge: Judge, force: float) -> Fitted:
    """The true machine under a constant force in N, as if it had been fitted."""
    return judge.fits.at(PUSHED, {**TRUE, "constant_force": force}, {}, (0,))


def test_a_force_that_is_there_lessens_the_error_to_the_noise(judge: Judge) -> None:
    """Without it the axis drifts away, by what the closed form says of 0.1 s."""
    without = judge.fits.at(MODEL, TRUE, {}, (0,))
    gain = ahead_gain(judge, without, with_force(judge, EXTRA), "constant_force")
    drift = float(machine.drift(0.1, EXTRA))
    left = drift * math.exp(-0.5 * gain)
    assert 1e-7 < left < 1e-5 < drift
    # Half of it leaves half of the drift.
    half = ahead_gain(judge, without, with_force(judge, 0.5 * EXTRA), "constant_force")
    assert half == pytest.approx(2.0 * math.log(2.0), rel=0.02)


def test_what_predicts_no_better_is_idle(judge: Judge) -> None:
    without = judge.fits.at(MODEL, TRUE, {}, (0,))
    parts = [Part("constant_force", CERTAIN, without)]
    assert idle(judge, with_force(judge, EXTRA), parts) == []
    assert idle(judge, with_force(judge, -EXTRA), parts) == parts
    same = with_force(judge, 0.0)  # predicts exactly as well
    assert idle(judge, same, parts) == parts
    assert idle(judge, same, [Part("constant_force", BEYOND_DOUBT, without)]) == []


@pytest.mark.parametrize(
    ("gain", "certainty", "against"),
    [
        (0.01, 3.0, False),
        (-0.01, 3.0, True),  # doubtful by the balance of forces, and no help
        (-0.01, 8.0, False),  # beyond doubt there, and too quick for a prediction over 0.1 s
        (-0.3, 8.0, True),  # errors rise by a sixth
    ],
)
def test_the_prediction_speaks_against_what_is_doubtful_or_harms(gain: float, certainty: float, against: bool) -> None:
    assert speaks_against(gain, certainty) is against


def test_a_prediction_that_diverges_helps_nobody(judge: Judge) -> None:
    without, lost = with_force(judge, 0.0), with_force(judge, EXTRA)
    broken: Any = SimpleNamespace(
        model=lost.model, values=lost.values, preset={}, vector=np.where(lost.vector == EXTRA, np.nan, lost.vector)
    )
    assert ahead_gain(judge, without, broken, "constant_force") < -10.0


def test_what_acts_in_single_recordings_is_judged_where_it_acts() -> None:
    """By held-out ones among these, if there are any."""
    splits = ("fit", "fit", "held_out", "held_out")
    runs = [machine.recording(f"run_{k}", duration=0.2, number=k, split=split) for k, split in enumerate(splits, 1)]
    names = {"cogging": {}, "payload_change": {}}

    def judged(name: str, **values: float) -> list[int]:
        full: Any = SimpleNamespace(values=names[name], preset=values)
        return [r.number for r in telling(runs, full, name)]

    assert judged("cogging") == [3, 4]
    assert judged("payload_change", payload_recordings=0b0110) == [3]
    assert judged("payload_change", payload_recordings=0b0011) == [1, 2]


def test_a_hidden_state_is_no_handicap(judge: Judge) -> None:
    """Models with one start their windows from the same states as those without."""
    resting = MODEL.with_effects(("dwell_stiction",))
    values = {**TRUE, "dwell_growth": 0.0, "dwell_length": 1e-5, "dwell_time": 1.0}
    nothing = judge.fits.at(resting, values, {}, (0,))
    assert resting.effect_states
    assert ahead_gain(judge, judge.fits.at(MODEL, TRUE, {}, (0,)), nothing, "dwell_stiction") == pytest.approx(
        0, abs=1e-9
    )
