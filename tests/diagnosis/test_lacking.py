"""A term in the stead of effects: those of the model beside which it acts stay, the others are dropped."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from linid.diagnosis.held_out_tests import Part, is_likely, is_trifle
from linid.diagnosis.instead import HOPELESS, does_without_effects, leaves_no_more
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Evidence
from linid.diagnosis.lacking import worse_somewhere
from linid.diagnosis.lead import _leaves_little, passing, with_effects_of
from linid.diagnosis.report_data import Change, RecordingChange
from linid.diagnosis.select import Selection
from linid.physics.model import Model
from tests.diagnosis.machine import Noise
from tests.diagnosis.test_joint import TRUE, fitted, judged

EVIDENCE = Evidence(gain=0.5, certainty=4.0, closed=0.6, power=3.0, power_closed=0.8)


def model(*effects: str) -> Fitted:
    plain = fitted(judged(Noise(encoder=1e-7), TRUE), TRUE)
    return replace(plain, model=Model("force", effects))


def test_the_effects_that_a_term_does_without_are_dropped_with_their_rivals() -> None:
    base, both, lasting = model(), model("cogging", "external_disturbance"), model("cogging")
    push, teeth = Part("external_disturbance", EVIDENCE, lasting), Part("cogging", EVIDENCE, base)
    rivals = {"external_disturbance": (("dwell_stiction", base),), "cogging": (("cable_force", base),)}
    found = Selection(base, both, (teeth, push), (), (), rivals)
    left = with_effects_of(found, lasting)
    assert left.best is lasting and left.parts == (teeth,) and left.dropped == (push,)
    assert list(left.rivals) == ["cogging"]
    none = with_effects_of(found, base)
    assert none.best is base and none.parts == () and none.dropped == (teeth, push) and none.rivals == {}


def test_effects_of_single_moments_or_recordings_that_leave_something_are_doubted() -> None:
    """What always acts may look like one of them, in the recording or at the moment where it is strongest."""
    base, both = model(), model("cogging", "friction_level_change", "external_disturbance")
    names = ("cogging", "friction_level_change", "external_disturbance")
    parts = tuple(Part(name, EVIDENCE, base) for name in names)
    assert [part.name for part in passing(Selection(base, both, parts, (), (), {}))] == list(names[1:])
    sure = tuple(replace(part, evidence=replace(EVIDENCE, closed=0.95)) for part in parts)
    assert not passing(Selection(base, both, sure, (), (), {}))


def test_what_takes_next_to_nothing_is_a_trifle_unless_it_brings_the_model_to_the_floor() -> None:
    part = Part("phase_gain_imbalance", EVIDENCE, model())
    assert is_trifle(part, 0.005) and is_trifle(part, -0.05) and not is_trifle(part, 0.02)
    assert not is_trifle(replace(part, evidence=replace(EVIDENCE, closed=0.95)), 0.005)
    # What takes half of the logarithm shows in most recordings, though one where it does not has all the power.
    assert not is_trifle(replace(part, log_share=0.5), -0.05) and is_trifle(replace(part, log_share=0.02), -0.05)
    assert is_likely(part) and not is_likely(replace(part, evidence=replace(EVIDENCE, closed=0.3)))


def test_a_term_takes_the_place_of_effects_that_leave_most_to_a_term_beside_them() -> None:
    # An effect that closes a fifth, and a term beside it that does the rest: two causes for one.
    assert does_without_effects(by_term=0.06, by_effects=0.78, beside=0.1, its_shape=False)
    assert not does_without_effects(by_term=0.06, by_effects=0.78, beside=0.1, its_shape=True)
    # Without a term beside it there is nothing that counts twice; effects that close most stand.
    assert not does_without_effects(by_term=0.7, by_effects=0.78, beside=1.0, its_shape=False)
    assert not does_without_effects(by_term=0.32, by_effects=0.42, beside=0.84, its_shape=False)
    # What leaves a ninth is the cause in another form, however well a curve of the same arguments does.
    assert not does_without_effects(by_term=0.025, by_effects=0.11, beside=0.68, its_shape=True)
    # Half of what effects and term leave together is told by anything.
    assert does_without_effects(by_term=0.01, by_effects=0.22, beside=0.1, its_shape=True)


def test_a_model_with_a_term_is_asked_only_where_it_may_turn_what_the_term_leaves_as_found() -> None:
    asked = []

    class Found:
        """What a lead tells: the excess that a term closes as found, and in the model."""

        def __init__(self, as_found: float, in_model: float) -> None:
            self.proposal, self.in_model = SimpleNamespace(closed=as_found), in_model

        @property
        def closes(self) -> float:
            asked.append(self.in_model)
            return self.in_model

    def leaves_little(as_found: float, in_model: float) -> bool:
        asked.clear()
        lead: Any = Found(1.0 - as_found, 1.0 - in_model)
        return _leaves_little(lead, 0.5, None, leaves_no_more)

    near, far = 0.5 * (0.9 * HOPELESS), 0.5 * (1.1 * HOPELESS)
    assert leaves_little(0.4, 0.9) and not asked
    assert leaves_little(near, 0.4) and asked
    assert not leaves_little(near, 0.6) and asked
    assert not leaves_little(far, 0.0) and not asked


def changes(*ahead: tuple[float, float]) -> list[RecordingChange]:
    """Held-out recordings with the errors 0.1 s ahead, in um, without and with a term."""
    return [
        RecordingChange(f"r{n}", "motor", "held_out", {"ahead": Change(before, after, 0.1)})
        for n, (before, after) in enumerate(ahead)
    ]


def test_a_term_that_mends_most_is_not_given_up_for_a_rise_of_next_to_nothing() -> None:
    def worse(*ahead: tuple[float, float], chance: bool = False) -> bool:
        return worse_somewhere(changes(*ahead), [chance] * len(ahead))

    mended = (1600.0, 40.0)
    assert not worse(mended, (1.0, 17.0), (250.0, 235.0))
    assert worse(mended, (1.0, 170.0), (250.0, 235.0))
    # Where nothing is mended, a rise is one; one within what the windows tell is none.
    assert worse((30.0, 28.0), (1.0, 17.0)) and not worse((30.0, 31.0), (1.0, 1.05))
    # A simulation that ran away is no mending of anything.
    assert worse((30.0, math.inf), (1.0, 0.5)) and worse((1.0, math.nan)) and worse((30.0, math.inf), chance=True)
    assert not worse()
    # What chance explains is no rise where more is mended elsewhere.
    assert worse((100.0, 60.0), (80.0, 92.0)) and not worse((100.0, 60.0), (80.0, 92.0), chance=True)
    assert worse((100.0, 99.0), (80.0, 92.0), chance=True)
