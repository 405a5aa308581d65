"""The four verdicts, each from the figures that call for it, and what their sentences say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.report_data import Budget, Change, Entry, Share
from linid.diagnosis.verdict import decide, so_far, status_of
from tests.report.proposal_samples import term as proposed

NONE = np.zeros(0)
WHERE = (Share("position", "position", "m", 0.6, 0.01, NONE, NONE, NONE),)


def entry(name: str = "cogging", share: float = 0.9, **more: object) -> Entry:
    return Entry(name, (), share, share - 0.1, share + 0.1, share, share, 9.0, **more)  # type: ignore[arg-type]


def budget(entries: tuple[Entry, ...], before: float, after: float) -> Budget:
    closed = sum(e.share for e in entries)
    rest = 1.0 - closed
    return Budget(2.0, 1.0, 0.5, before, after, closed, closed, closed, rest, rest, rest, entries, 0.4, ("velocity",))


def said(entries: tuple[Entry, ...], before: float, after: float, motion: float = 0.99) -> tuple[str, str]:
    verdict = decide(budget(entries, before, after), WHERE, (("cogging", 0.9),), motion, (), "linear")
    return verdict.status, verdict.sentence


@pytest.mark.parametrize(
    ("entries", "before", "after", "status"),
    [
        ((), 0.05, 0.05, "none"),
        ((), 2.0, 2.0, "unknown"),
        ((), 30.0, 30.0, "unknown"),
        ((entry(),), 20.0, 0.1, "explained"),
        ((entry(),), 20.0, 2.0, "partly explained"),
        ((entry(), entry("cable_force", 0.05)), 20.0, 0.29, "explained"),
        # What evidence was found for is named, however small the gap in which it stood.
        ((entry(),), 0.2, 0.0, "explained"),
    ],
)
def test_status_follows_from_entries_and_what_is_left(
    entries: tuple[Entry, ...], before: float, after: float, status: str
) -> None:
    assert status_of(budget(entries, before, after)) == status
    assert said(entries, before, after)[0] == status


def test_a_few_pieces_of_much_power_are_no_gap() -> None:
    """Where the mean logarithm is at the floor, stops that a coarse encoder blurs decide nothing."""
    assert status_of(replace(budget((), 1.1, 1.1), level_before=0.05)) == "none"
    assert status_of(replace(budget((), 1.1, 1.1), level_before=0.5)) == "unknown"
    nearly = replace(budget((entry(share=0.98),), 20.0, 0.5), level_after=0.05)
    assert status_of(nearly) == "explained"
    assert status_of(replace(nearly, unexplained=0.2)) == "partly explained"


def test_short_pieces_above_the_floor_are_told() -> None:
    """A push that hides in the mean logarithm is no noise, and whoever has it in a recording is not told so."""
    pushed = decide(replace(budget((), 319.0, 319.0), level_before=0.05), WHERE, (), 0.99, (), "rotary")
    quiet = decide(budget((), 0.05, 0.05), WHERE, (), 0.99, (), "rotary")
    assert pushed.status == quiet.status == "none"
    assert "torque" in pushed.sentence and "short pieces" in pushed.sentence and "Repeat" in pushed.next_experiment
    assert "short pieces" not in quiet.sentence and "no effect is missing" in quiet.sentence


def test_the_sentence_gives_each_cause_its_share_and_names_the_rest() -> None:
    sentence = said((entry(share=0.6), entry("cable_force", 0.3)), 20.0, 2.0)[1]
    assert "cogging (60 %)".capitalize() in sentence and "cable force (30 %)" in sentence
    assert "10 % stay unexplained" in sentence and "velocity" in sentence


def test_what_is_known_before_the_models_are_is_said_in_a_line() -> None:
    assert so_far({"cable_force": 0.29, "cogging": 0.71}, -0.001) == (
        "so far: cogging (71 %) and cable force (29 %), 0 % unexplained; next: what the models predict"
    )
    assert so_far({}, 1.0) == "so far: no effect; next: what the models predict"


def test_a_rival_belongs_to_its_entry() -> None:
    twin = Entry("current_offset", ("constant_force",), 0.9, 0.8, 1.0, 0.9, 0.9, 9.0)
    found = decide(budget((twin,), 20.0, 0.1), WHERE, (), 0.99, (), "linear")
    assert found.status == "explained" and found.equivalent == ("constant_force",)
    assert "urrent offset or constant force" in found.sentence


def test_an_effect_that_worsens_a_measure_is_not_named_without_saying_so() -> None:
    worse = entry(measures={"ahead": Change(1.0, 3.0, 0.1), "force": Change(3.0, 1.0, 0.1)})
    sentence = said((worse,), 20.0, 0.1)[1]
    assert "0.1 s ahead" in sentence and "worse" in sentence and "force balance" not in sentence


def test_what_changes_below_the_floor_of_a_measure_is_not_worse() -> None:
    """A free run of a stick-slip axis misses it by as much whenever it is repeated."""
    same = entry(measures={"free_run": Change(1.68, 2.46, 3.1), "force": Change(3.0, 1.0, 0.1)})
    assert same.worsens == () and "worse" not in said((same,), 20.0, 0.1)[1]
    # One that misses by more than noise explains may miss by as much more as it explains.
    scattered = entry(measures={"free_run": Change(3.82, 5.93, 3.55)})
    risen = entry(measures={"free_run": Change(3.82, 7.5, 3.55)})
    assert scattered.worsens == () and risen.worsens == ("free_run",)


@pytest.mark.parametrize("motion", [-3.0, 0.2, float(np.nextafter(0.5, 0.0))])
def test_a_model_that_misses_the_motion_says_so_and_blames_no_channel_without_evidence(motion: float) -> None:
    status, sentence = said((), 20.0, 20.0, motion)
    assert status == "unknown" and "of the held-out accelerations" in sentence
    assert "channels" not in sentence and "units" not in sentence


def test_what_is_at_the_floor_is_the_residual_force() -> None:
    """The verdict is on the force alone: other measures have floors of their own."""
    for entries in ((), (entry(),)):
        gap = budget(entries, 20.0 if entries else 0.05, 0.05)
        for axis, word in (("linear", "residual force"), ("rotary", "residual torque")):
            sentence = decide(gap, WHERE, (), 0.99, (), axis).sentence
            assert word in sentence and "at the noise floor" in sentence


def test_the_next_recording_is_a_sentence_that_says_what_for() -> None:
    unknown = decide(budget((), 20.0, 20.0), WHERE, (("payload_change", 0.4),), 0.99, (), "linear")
    assert unknown.next_experiment == (
        "To see whether payload change is behind it, record the same accelerations in every recording."
    )
    one = decide(budget((entry("payload_change"),), 20.0, 2.0), WHERE, (), 0.99, (), "linear")
    assert one.next_experiment == "To measure payload change better, record the same accelerations in every recording."


def test_a_proposed_term_stands_in_the_verdict_in_place_of_single_coordinates() -> None:
    term = proposed(None, ("velocity", "motor_force"))
    # Where few pieces have the gap, a term that predicts them says that there is one.
    for gap in (budget((), 20.0, 20.0), replace(budget((), 1.1, 1.1), level_before=0.05)):
        assert decide(gap, WHERE, (), 0.99, (), "linear", term).status == "unknown"
    unknown = decide(budget((), 20.0, 20.0), WHERE, (("payload_change", 0.4),), 0.99, (), "linear", term)
    assert "library explains the gap; a term of velocity and motor force closes 83 % of it." in unknown.sentence
    assert unknown.next_experiment == term.next_experiment
    partly = decide(budget((entry(share=0.6),), 20.0, 2.0), WHERE, (), 0.99, (), "rotary", term).sentence
    assert "40 % stay unexplained, of which a term of velocity and motor torque closes 83 %." in partly
    constant = decide(budget((entry(share=0.6),), 20.0, 2.0), WHERE, (), 0.99, (), "rotary", proposed(None, ()))
    assert "40 % stay unexplained, of which a constant torque closes 83 %." in constant.sentence


@pytest.mark.parametrize("share", [1.0, 1.03])
def test_a_gap_that_closes_above_the_floor_leaves_no_share_to_speak_of(share: float) -> None:
    """Effects may close more than all of a gap while what is left is still above the floor."""
    whole = replace(budget((entry(share=share),), 20.0, 2.0), unexplained=1.0 - share, depends_on=())
    said = decide(whole, WHERE, (), 0.99, (), "linear").sentence
    assert said.endswith("of the gap; the residual force is still above the noise floor.")
    said = decide(whole, WHERE, (), 0.99, (), "rotary", proposed(None, ("velocity",))).sentence
    assert said.endswith(
        "residual torque is still above the noise floor, and a term of velocity closes 83 % of what is left."
    )
    said = decide(replace(whole, depends_on=("velocity",)), WHERE, (), 0.99, (), "linear").sentence
    assert said.endswith("the residual force is still above the noise floor, and depends on velocity.")
