"""The tests that an effect must stand, one by one."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from linid.diagnosis import backward
from linid.diagnosis.backward import renewed, revived
from linid.diagnosis.balance import Balance
from linid.diagnosis.base import numbered
from linid.diagnosis.descent import THOROUGH
from linid.diagnosis.forward import CONTENDING, PROPOSED_GAIN, contenders
from linid.diagnosis.held_out_tests import Part, stands
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Evidence, Judge, judge_of
from linid.diagnosis.look_alikes import look_alike, simpler_than
from linid.diagnosis.marks import in_all
from linid.diagnosis.screen import Screened, Screening
from linid.diagnosis.steps_of_selection import foretold_without, preset_of, without_effect
from linid.identification.guess.effect_values import Trial
from linid.physics.model import Model
from tests.diagnosis import machine
from tests.diagnosis.test_joint import TRUE, fitted

NOTHING: Any = None  # the tests read figures, not models


@pytest.mark.parametrize(
    ("name", "gain", "certainty", "closed", "stays"),
    [
        ("cogging", 1.0, 9.0, 0.9, True),
        ("cogging", 1.0, 9.0, 0.04, False),  # a trifle of what is left
        ("cogging", 1.0, 9.0, 0.06, True),  # little, but beyond doubt
        ("cogging", 0.04, 9.0, 0.06, False),
        ("cogging", 1.0, 3.9, 0.06, False),
        ("cogging", 1.0, 2.0, 0.2, False),  # not sure, and not clear
        ("cogging", 1.0, 2.5, 0.5, True),  # clear
        ("cogging", 1.0, 0.9, 0.9, False),
        ("cogging", 0.002, 9.0, 0.9, False),  # nothing to speak of
        ("payload_change", 1.0, 5.0, 0.2, False),  # fits itself to much
        ("payload_change", 1.0, 6.0, 0.2, True),  # beyond doubt
        ("payload_change", 1.0, 3.0, 0.6, False),  # its recordings were chosen by what it explains there
        ("payload_change", 1.0, 5.0, 0.6, True),
        ("payload_change", 1.0, 3.5, 0.98, True),  # all but nothing is left of the gap
        ("external_disturbance", 0.1, 0.9, 0.6, True),  # a moment has no other blocks
    ],
)
def test_an_effect_stands_by_gain_certainty_and_what_it_closes(
    name: str, gain: float, certainty: float, closed: float, stays: bool
) -> None:
    assert stands(Part(name, Evidence(gain, certainty, closed, 1.0, closed), NOTHING)) is stays


def test_most_of_the_power_counts_where_the_logarithm_is_large_for_ever() -> None:
    far = Evidence(gain=0.7, certainty=3.5, closed=0.1, power=166.0, power_closed=0.86)
    assert stands(Part("payload_change", replace(far, certainty=4.5), NOTHING)) and stands(
        Part("cogging", far, NOTHING)
    )
    assert not stands(Part("cogging", replace(far, power_closed=0.3), NOTHING))


def test_what_large_effects_leave_of_their_form_is_no_further_cause() -> None:
    sure = Evidence(gain=0.09, certainty=5.7, closed=0.5, power=0.4, power_closed=0.4)
    assert stands(Part("eddy_current_drag", sure, NOTHING, share=0.003))
    assert not stands(Part("eddy_current_drag", sure, NOTHING, share=0.0002))


def test_contenders_explain_nearly_as_much_as_the_best() -> None:
    def found(name: str, explained: float, lead: float = 1e9) -> Screened:
        return Screened(name, Trial({}, {}, explained, lead))

    chosen = contenders(
        [
            found("cogging", 0.6),
            found("cable_force", 0.5),
            found("external_disturbance", 0.5, 1.2),
            found("quadratic_drag", 0.1),
        ],
        CONTENDING[0],
    )
    assert [s.name for s in chosen] == ["cogging", "cable_force"]
    assert contenders([found("cogging", 0.0005)], CONTENDING[-1]) == []


def test_contenders_are_promised_as_surely_as_a_fit_must_find_them() -> None:
    def found(name: str, explained: float, certainty: float) -> Screened:
        return Screened(name, Trial({}, {}, explained, certainty=certainty))

    unsure, sure, clear = found("cogging", 0.06, 2.4), found("cable_force", 0.05, 2.6), found("gravity", 0.2, 1.1)
    assert contenders([unsure, sure], CONTENDING[-1]) == [sure]  # what is not tried bars nobody
    assert contenders([clear], CONTENDING[0]) == [clear]  # so large that few blocks of unlike size are no doubt
    assert contenders([replace(clear, trial=replace(clear.trial, certainty=math.nan))], CONTENDING[0]) == []


def test_look_alikes_say_so_on_either_side() -> None:
    assert look_alike("constant_force", "gravity") == look_alike("gravity", "constant_force")
    assert look_alike("force_saturation", "thermal_derating") and look_alike("thermal_derating", "force_saturation")
    assert not look_alike("cogging", "payload_change")


def test_a_play_of_no_width_gives_way_to_what_it_then_is() -> None:
    """On a real shaft between two masses it was named with a gap at its lower bound."""
    assert simpler_than("drive_train_backlash", False) == ("flexible_load",)
    assert look_alike("drive_train_backlash", "flexible_load")
    assert not look_alike("flexible_load", "drive_train_backlash")  # its own fuller form is no rival


def test_marks_are_not_searched() -> None:
    model = Model("sine", ("payload_change", "cogging"))
    held = preset_of(model, {"payload_recordings": 6.0, "payload_mass": 0.2, "cogging_order_1": 1.0})
    assert held == {"payload_recordings": 6.0, "cogging_order_1": 1.0}


def test_what_adds_to_the_power_must_be_beyond_doubt() -> None:
    worse = Evidence(gain=3.6, certainty=2.6, closed=0.23, power=-5e5, power_closed=0.0)
    assert not stands(Part("cable_force", worse, NOTHING))
    assert stands(Part("cable_force", replace(worse, power=1.0), NOTHING))
    assert stands(Part("cable_force", replace(worse, certainty=6.0), NOTHING))


def of_loaded_runs() -> Judge:
    """Two of four recordings carry a load that is not told, one of them held out."""
    runs = []
    for k in range(4):
        added = 0.3 if k in (1, 3) else 0.0
        one = machine.recording(f"run_{k}", noise=machine.Noise(encoder=1e-7), seed=k, added_mass=added)
        runs.append(replace(one, added_mass=0.0, split="held_out" if k == 3 else "fit"))
    model = Model("force")
    return judge_of(Balance(model, numbered(runs), 1, 1), model, TRUE, {"mass": machine.MASS}, {}, 1)


def test_that_an_effect_acts_in_a_held_out_recording_too_shows_there() -> None:
    """A model that has the load in the fitted recording is put right."""
    judge = of_loaded_runs()
    base = fitted(judge, TRUE)
    loaded, start = base.model.with_effects(("payload_change",)), {**TRUE, "payload_mass": 0.3}
    full = judge.fits.fit(loaded, start, {"payload_recordings": 2.0}, (0, 1, 2), THOROUGH)
    sure = Part("payload_change", Evidence(1.0, 9.0, 0.9, 1.0, 0.9), base)
    one = renewed(judge.fits, Screening(judge.fits, base, 1), full, {sure.name: sure.without})
    assert one is not None and one.preset["payload_recordings"] == 10.0
    assert one.values["payload_mass"] == pytest.approx(0.3, rel=0.02)
    assert renewed(judge.fits, Screening(judge.fits, base, 1), one, {sure.name: sure.without}) is None


def test_what_failed_in_a_model_is_not_tried_in_it_again() -> None:
    """The load is found once more, unless it has failed beside the same effects."""
    judge = of_loaded_runs()
    base = fitted(judge, TRUE)
    screening = Screening(judge.fits, base, 1)
    found = revived(judge, screening, base)
    assert found is not None
    (name,) = found.model.effects
    again = revived(judge, screening, base, {(frozenset((name,)), name)})
    assert again is None or again.model.effects != (name,)
    elsewhere = revived(judge, screening, base, {(frozenset((name, "cogging")), name)})
    assert elsewhere is not None and elsewhere.model.effects == (name,)


def test_what_held_out_recordings_alone_ask_for_is_not_revived(monkeypatch: pytest.MonkeyPatch) -> None:
    """A load that only the held-out recordings had, if the rows it was fitted to told nothing of it."""
    judge = of_loaded_runs()
    base = fitted(judge, TRUE)
    screening = Screening(judge.fits, base, 1)
    asked: list[Evidence] = []
    truly = backward.gained

    def next_to_nothing(fits: Any, step: Fitted, one: Fitted) -> Evidence:
        asked.append(truly(fits, step, one))
        return replace(asked[-1], gain=0.9 * PROPOSED_GAIN)

    monkeypatch.setattr(backward, "gained", next_to_nothing)
    assert revived(judge, screening, base) is None
    assert max(e.gain for e in asked) > PROPOSED_GAIN


def test_a_changed_parameter_of_a_given_model_is_tried_in_all_recordings() -> None:
    recordings = [machine.recording(f"run_{k}", duration=0.2, number=k) for k in (1, 2, 3)]
    full: Any = SimpleNamespace(preset={"friction_change_recordings": 3.0}, values={"friction_change": -0.3})
    (found,) = in_all(full, "friction_level_change", recordings)
    assert found.trial.values == {"friction_change_recordings": 7.0}
    assert found.trial.amplitudes == {"friction_change": -0.3}
    there: Any = SimpleNamespace(preset={"friction_change_recordings": 7.0}, values=full.values)
    assert in_all(there, "friction_level_change", recordings) == () == in_all(full, "cogging", recordings)


def test_slopes_foretell_the_model_without_a_weak_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """As all others are fitted again, with the one simulation of where they start; a strong one stays strong."""
    judge = of_loaded_runs()
    fits = judge.fits
    model = Model("force").with_effects(("payload_change", "quadratic_drag", "constant_force"))
    full = fits.fit(model, {**TRUE, "payload_mass": 0.3}, {"payload_recordings": 2.0}, (0, 1, 2), THOROUGH)
    truly = {name: without_effect(fits, full, name) for name in model.effects}
    fits.slopes(full)
    simulated, count = fits.residuals, []
    monkeypatch.setattr(fits, "residuals", lambda *all_of_it: count.append(1) or simulated(*all_of_it))
    foretold = {name: foretold_without(fits, full, name) for name in model.effects}
    assert len(count) == len(model.effects)
    for name in ("quadratic_drag", "constant_force"):
        assert foretold[name].model == truly[name].model and foretold[name].preset == {"payload_recordings": 2.0}
        assert foretold[name].level == pytest.approx(truly[name].level, abs=2e-4)
        spread = float(np.std(truly[name].residual))
        assert float(np.std(foretold[name].residual - truly[name].residual)) < 0.02 * spread
    strong = "payload_change"
    assert foretold[strong].level - full.level > 0.5 * (truly[strong].level - full.level) > 0.1


def test_a_model_that_stood_is_not_tested_again_when_one_effect_more_has_failed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The effect that is tried in vain beside it goes, and all else is as it was."""
    judge = of_loaded_runs()
    base = fitted(judge, TRUE)
    fits, screening = judge.fits, Screening(judge.fits, base, 1)
    loaded = base.model.with_effects(("payload_change",))
    held = {"payload_recordings": 10.0}
    full = fits.fit(loaded, {**TRUE, "payload_mass": 0.3}, held, (0, 1, 2), THOROUGH)
    tested: list[str] = []
    truly = backward.part_of

    def counted(judge: Any, base: Fitted, full: Fitted, name: str, jobs: int) -> Part:
        tested.append(name)
        return truly(judge, base, full, name, jobs)

    def with_a_drag(judge: Any, screening: Any, one: Fitted, failed: Any) -> Fitted | None:
        drag = frozenset((*one.model.effects, "quadratic_drag"))
        if (drag, "quadratic_drag") in failed:
            return None
        more = one.model.with_effects((*one.model.effects, "quadratic_drag"))
        return fits.fit(more, one.values, one.preset, one.recordings, THOROUGH)

    monkeypatch.setattr(backward, "part_of", counted)
    monkeypatch.setattr(backward, "revived", with_a_drag)
    selection = backward.Backward(judge, screening, base)
    standing = selection.run(full)
    assert [part.name for part in standing.parts] == ["payload_change"] == tested
    assert list(selection.dropped) == ["quadratic_drag"]
    assert standing.full.model.effects == ("payload_change",)
    assert standing.full.values["payload_mass"] == pytest.approx(0.3, rel=0.02)
