"""A model that is kept only if it predicts: the same as one refined at once, and remembered."""

from __future__ import annotations

import math
import threading
from dataclasses import replace
from typing import Any

import pytest

from linid.diagnosis import refined_models
from linid.diagnosis.means import Means
from linid.diagnosis.refined_models import Attempt, Refining, refined_model
from linid.identification.model_file import model_to_text
from tests.diagnosis.machine import K, Noise
from tests.diagnosis.test_joint import TRUE, fitted, judged


def test_an_attempt_that_is_kept_is_the_model_refined_at_once() -> None:
    """Until then only the values are known: nothing but the search box tells how well."""
    judge = judged(Noise(encoder=1e-7, current=0.02), TRUE)
    one, runs, memory = fitted(judge, TRUE), judge.balance.recordings[:3], {}
    attempt = Attempt(one, runs, Means(), memory)
    found = refined_model(one, runs, Means(), {})
    values = {e.name: e.value for e in found.estimates}
    assert {e.name: e.value for e in attempt.result.estimates} == values
    (bare,) = (e for e in attempt.result.estimates if e.name == "force_constant")
    (known,) = (e for e in found.estimates if e.name == "force_constant")
    assert known.std < 0.01 * K < bare.std and bare.status == "not_identifiable"
    assert model_to_text(attempt.kept()) == model_to_text(found)
    attempt.go_on()
    further = attempt.kept().value("force_constant")
    assert further == pytest.approx(values["force_constant"], abs=3.0 * known.std)


def test_an_attempt_is_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    """What an interrupted run has refined is not refined again, whether it was kept or not."""
    judge = judged(Noise(encoder=1e-7), TRUE)
    one, runs, memory = fitted(judge, TRUE), judge.balance.recordings[:3], {}
    first = Attempt(one, runs, Means(), memory)
    kept = first.kept()

    def again(*_: Any, **__: Any) -> None:
        raise AssertionError("refined again")

    monkeypatch.setattr(refined_models, "refined_values", again)
    second = Attempt(one, runs, Means(), memory)
    assert second.ended == first.ended and model_to_text(second.result) == model_to_text(first.result)
    assert model_to_text(second.kept()) == model_to_text(kept)
    moved = replace(one, values={**one.values, "force_constant": 1.1 * K}, key="another")
    with pytest.raises(AssertionError, match="refined again"):
        Attempt(moved, runs, Means(), memory)
    assert math.isfinite(kept.value("force_constant"))


def test_an_attempt_that_is_begun_beside_other_work_is_the_one_made_when_it_is_asked_for() -> None:
    """It is there, and remembered, though its result is asked for once nothing else is begun any more."""
    judge = judged(Noise(encoder=1e-7, current=0.02), TRUE)
    one, runs, memory = fitted(judge, TRUE), judge.balance.recordings[:3], {}
    later = Refining(runs, Means(jobs=1), None).attempt(one, {})
    with Refining(runs, Means(jobs=2), None) as refining:
        begun = refining.attempt(one, memory)
        found = begun()
    assert model_to_text(found.result) == model_to_text(later().result) and found.ended == later().ended
    assert model_to_text(found.kept()) == model_to_text(later().kept())
    assert len(memory) == 2


def test_who_is_interrupted_does_not_wait_for_an_attempt(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = judged(Noise(encoder=1e-7), TRUE)
    begun, asked_for, over = threading.Event(), threading.Event(), threading.Event()

    def long(*_: Any) -> None:
        begun.set()
        asked_for.wait(60.0)
        over.set()

    monkeypatch.setattr(refined_models, "Attempt", long)
    with pytest.raises(KeyboardInterrupt), Refining(judge.balance.recordings, Means(jobs=2), None) as refining:
        refining.attempt(fitted(judge, TRUE), {})
        assert begun.wait(60.0)
        raise KeyboardInterrupt
    assert not over.is_set()
    asked_for.set()
    assert over.wait(60.0)
