"""What is said of a feed-forward: figures in a unit that reads well, effects in order, reasons, refusals."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from linid.diagnosis.compensation_data import Compensation, EffectCost, Following, FollowingCourse, Ranged
from linid.diagnosis.report_data import Diagnosis
from linid.report.diagnosis.compensation import compensation_setting, compensation_words, cost_rows, following_rows
from linid.report.diagnosis.files import diagnosis_data
from linid.report.diagnosis.markdown import diagnosis_markdown
from linid.report.page.build import page_html
from tests.report.diagnosis_samples import explained

T = np.arange(50) * 0.01
COURSE = FollowingCourse("moves", T, 0.1 * T, 30e-6 * np.sin(T), 20e-6 * np.sin(T), 1e-6 * np.sin(T))
TOLD = Compensation(
    drive="the given drive",
    reference="the references logged with moves",
    controller={"position_gain_per_s": 60.0},
    without=Following(Ranged(30e-6, 27e-6, 33e-6), Ranged(90e-6, 80e-6, 95e-6)),
    base=Following(Ranged(20e-6, 18e-6, 22e-6), Ranged(60e-6, 50e-6, 66e-6)),
    full=Following(Ranged(3e-6, 2e-6, 5e-6), Ranged(9e-6, 8e-6, 11e-6)),
    effects=(
        EffectCost("input_delay", Ranged(1e-6, 0.9e-6, 1.1e-6), Ranged(), False, "a lag of the drive"),
        EffectCost("cogging", Ranged(12e-6, 11e-6, 13e-6), Ranged(17e-6, 15e-6, 19e-6), True),
    ),
    courses=(COURSE,),
    draws=39,
    seed=7,
)


def diagnosis(**changes: object) -> Diagnosis:
    return replace(explained(), compensation=replace(TOLD, **changes))  # type: ignore[arg-type]


def test_figures_are_in_micrometres_with_their_intervals() -> None:
    assert compensation_words(diagnosis()) == (
        "Following error (RMS) in the drive's loops: 30 [27, 33] µm without feed-forward, 20 [18, 22] with that of the "
        "base model, 3 [2, 5] with that of the model after (90 % less). Cogging costs most: 12 [11, 13] µm, its part "
        "of the feed-forward saves 17 [15, 19]."
    )
    assert following_rows(diagnosis())[-1][1:] == ("3", "[2, 5]", "9", "[8, 11]", "90 %")
    assert "39 axes" in compensation_setting(diagnosis()) and "seed 7" in compensation_setting(diagnosis())


def test_effects_stand_in_order_and_say_why_nothing_is_saved() -> None:
    cogging, delay = cost_rows(diagnosis())
    assert cogging == ("Cogging (µm)", "12", "[11, 13]", "17", "[15, 19]", "")
    assert delay == ("Input delay (µm)", "1", "[0.9, 1.1]", "nothing", "-", "a lag of the drive")


def test_without_named_effects_one_feed_forward_is_told() -> None:
    plain = diagnosis(effects=())
    assert "base model" not in compensation_words(plain) and len(following_rows(plain)) == 2


def test_a_refusal_is_one_line_and_nothing_else() -> None:
    refused = replace(explained(), compensation=Compensation(refused="a friction model has no motor"))
    assert compensation_words(refused) == "No figure for the following error: a friction model has no motor."
    assert not following_rows(refused) and not cost_rows(refused) and not compensation_setting(refused)
    assert compensation_words(explained()) == ""


def test_page_markdown_and_json_hold_it() -> None:
    page, text = page_html(diagnosis()), diagnosis_markdown(diagnosis())
    figures = page.split('id="figures">')[1].split("</script>")[0]
    (plot,) = [one for one in json.loads(figures) if one["id"] == "compensation"]
    assert max(abs(y) for y in plot["data"][0]["y"]) == round(30 * np.sin(0.49), 2)
    for whole in (page, text):
        assert "What a feed-forward would save" in whole and "a lag of the drive" in whole
    data = json.loads(json.dumps(diagnosis_data(diagnosis()), allow_nan=False))["compensation"]
    assert data["full"]["rms"] == {"value": 3e-6, "low": 2e-6, "high": 5e-6} and data["saved"] == 0.9
    assert data["effects"][0]["saved"]["value"] is None and len(data["courses"][0]["t"]) == T.size
    assert diagnosis_data(explained())["compensation"] is None and "What a feed-forward" not in page_html(explained())
