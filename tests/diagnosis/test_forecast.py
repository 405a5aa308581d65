"""Intervals of the gap after: what a new recording will show, and what all held-out ones show together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.forecast import prediction_interval, together
from linid.diagnosis.gap import AheadPieces, Trace
from linid.diagnosis.report_data import Change, RecordingChange


def recording(generator: np.random.Generator, spread: float = 0.3) -> tuple[RecordingChange, Trace]:
    """A held-out recording whose residual force is white, of a size that varies from one to the next."""
    size = float(np.exp(spread * generator.standard_normal()))
    force, end = size * generator.standard_normal((2, 400))
    after = {"free_run": 1.0, "ahead": np.sqrt(np.mean(end**2)), "force": np.sqrt(np.mean(force**2))}
    none = np.zeros(0)
    pieces = AheadPieces(0.1, none, none, none, none, none, end)
    trace = Trace("r", "motor", "held_out", "linear", 0.0, none, none, none, none, none, none, force, ahead=pieces)
    changes = {name: Change(2.0, float(x), 0.1) for name, x in after.items()}
    return RecordingChange("r", "motor", "held_out", changes), trace


def test_a_new_log_normal_draw_lies_inside_as_often_as_it_says() -> None:
    generator = np.random.default_rng(8)
    inside = 0
    for _ in range(2000):
        *known, new = np.exp(0.5 * generator.standard_normal(6))
        low, high = prediction_interval(known)
        inside += low <= new <= high
    assert 0.935 < inside / 2000 < 0.965


def test_two_recordings_tell_no_scatter() -> None:
    assert not np.isfinite(prediction_interval([1.0, 2.0])).any()


def test_the_interval_over_many_recordings_holds_the_long_run() -> None:
    generator = np.random.default_rng(3)
    truth = float(np.exp(0.3**2))  # root of the mean square of a log-normal size
    inside = 0
    for trial in range(200):
        changes, traces = zip(*(recording(generator) for _ in range(12)), strict=True)
        one = together(changes, traces, trial)["force"]
        inside += one.low <= truth <= one.high
    assert 0.82 < inside / 200 < 0.98  # the plain bootstrap of twelve is a little narrow


@pytest.mark.parametrize("measure", ["force", "ahead"])
def test_of_one_recording_its_pieces_give_the_interval(measure: str) -> None:
    generator = np.random.default_rng(5)
    inside = 0
    for trial in range(300):
        change, trace = recording(generator, spread=0.0)
        one = together([change], [trace], trial)[measure]
        inside += one.low <= 1.0 <= one.high
    assert 0.88 < inside / 300 < 0.98


def test_one_free_run_has_no_interval() -> None:
    change, trace = recording(np.random.default_rng(1))
    assert np.isnan(together([change], [trace], 1)["free_run"].low)
    fitted = replace(change, split="fit")
    assert together([fitted, change], [trace, trace], 1)["force"].after == change.changes["force"].after
