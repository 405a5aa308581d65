"""Decisions are told again from what was recorded of them, and other thresholds turn those that they should."""

from __future__ import annotations

import math

from linid.diagnosis import held_out_tests, instead, lacking
from tests.benchmarks.decisions import report, turned


def test_a_threshold_turns_what_lies_between() -> None:
    left = instead.INSTEAD
    # by the term, by the effects, beside, whether its shape is an effect's: half of what both leave decides.
    given = [[0.6 * left * 0.9, 0.9, 1.0, True], [1.5 * left * 0.9, 0.9, 1.0, True], [0.01, 0.9, 1.0, True]]
    assert turned("INSTEAD", given, 0.5) == 1 and turned("INSTEAD", given, 2.0) == 1
    little = instead.NEXT_TO_NOTHING
    # Terms that leave next to none of what these do, which would win, and one that would not.
    alone = [[1e-4, x * little, 1.0, False] for x in (0.6, 1.1, 2.2)] + [[0.9, 0.1 * little, 1.0, False]]
    assert turned("NEXT_TO_NOTHING", alone, 0.5) == 1 and turned("NEXT_TO_NOTHING", alone, 2.0) == 1
    many = instead.HOPELESS
    # The same, and whether the model said otherwise.
    asked = [[x * many * 0.9, 0.9, 1.0, turned_by_it] for x in (0.6, 1.1, 2.2) for turned_by_it in (True, False)]
    assert turned("HOPELESS", asked, 0.5) == 1 and turned("HOPELESS", asked, 2.0) == 1
    likely = [[held_out_tests.CERTAINTY + 1.0, x * held_out_tests.LIKELY] for x in (0.6, 1.1, 1.9)]
    assert turned("LIKELY", likely, 0.5) == 1 and turned("LIKELY", likely, 2.0) == 2
    rise = lacking.SMALL_RISE
    # metres: one error falls by far, the other rises by a share of that.
    worse = [[[1e-3, 1e-4, 1e-6, 0], [1e-4, 1e-4 + x * rise * 9e-4 / math.sqrt(2.0), 1e-6, 0]] for x in (0.3, 0.8, 1.6)]
    assert turned("SMALL_RISE", worse, 0.5) == 1 and turned("SMALL_RISE", worse, 2.0) == 1


def test_the_report_counts_what_was_recorded() -> None:
    record = {"instead": [[0.01, 0.9, 1.0, True]], "hopeless": [], "likely": [], "worse": [], "mass": [2.0, 1.0]}
    text = report({"axis_0001": record})
    assert text[2] == f"| `INSTEAD` | {instead.INSTEAD:g} | 1 | 1 | 0 | 0 |"
    assert "a factor of 2.00 off" in text[-1]
