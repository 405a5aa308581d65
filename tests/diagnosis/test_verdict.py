"""The four verdicts, each from the figures that call for it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from linid.diagnosis.report_data import Share
from linid.diagnosis.select import Confirmed
from linid.diagnosis.verdict import decide

FITTED: Any = None  # the verdict reads figures, not models
COGGING = Confirmed(("cogging",), 0.9, FITTED, 0.95, 0.9, 1.0, 0.0, 9.0, 1.0)
NONE = np.zeros(0)
WHERE = (Share("position", "position", "m", 0.6, 0.01, NONE, NONE, NONE),)


def said(
    chosen: Confirmed | None, excess: float, rivals: tuple[str, ...] = (), motion: float = 0.99
) -> tuple[str, str]:
    verdict = decide(chosen, (rivals,), excess, WHERE, 0.8, (("cogging", 0.9),), motion)
    return verdict.status, verdict.sentence


def test_what_lies_at_the_floor_misses_nothing() -> None:
    assert said(None, 0.05)[0] == "none"


def test_a_gap_that_closes_is_identified_and_with_a_rival_ambiguous() -> None:
    assert said(COGGING, 20.0)[0] == "identified"
    status, sentence = said(COGGING, 20.0, ("end_effect",))
    assert status == "ambiguous" and "cogging or end effect" in sentence


@pytest.mark.parametrize("excess", [0.4, 2.0, 30.0])
def test_a_gap_that_stays_open_is_unknown_and_says_where_it_lies(excess: float) -> None:
    status, sentence = said(replace(COGGING, closure=0.2), excess)
    assert status == "unknown" and "20 %" in sentence and "position" in sentence
    assert said(None, excess)[0] == "unknown"


def test_a_faint_effect_after_which_nothing_is_left_is_identified() -> None:
    """Most of a tiny excess is doubt about the floor: what counts is that nothing more is missing."""
    assert said(replace(COGGING, closure=0.3), 0.2)[0] == "identified"


@pytest.mark.parametrize("motion", [-3.0, 0.2, np.nextafter(0.5, 0.0)])
def test_a_model_that_misses_the_motion_names_nothing(motion: float) -> None:
    status, sentence = said(COGGING, 20.0, motion=float(motion))
    assert status == "unknown" and "units, signs or channels" in sentence
