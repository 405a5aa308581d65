"""Captions of free runs say where step was lost, and whether noise alone does as much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.report.reproduction.captions import free_run_caption

from .samples import gap, move


def test_a_run_in_step_says_its_error_and_that_of_noise() -> None:
    one = replace(move("moves_3"), pole_pitch=0.028)
    said = free_run_caption(gap("moves_3", free_run=0.012, free_run_floor=0.01), one)
    assert said == "moves_3: in step to the end, error 1.2 % of the motion, 1 % by the sensors' noise alone"


def test_a_lost_step_has_a_time_and_a_cause_or_none() -> None:
    one = replace(move("moves_3"), pole_pitch=0.028)
    late = one.t > 0.5 * one.t[-1]
    one = replace(one, y_simulated=np.where(late, one.y_measured + 0.1, one.y_measured))
    at = f"lost step at {one.t[np.argmax(late)]:.3g} s"
    by_noise = free_run_caption(gap("moves_3", free_run=3.0, free_run_floor=2.0), one)
    assert at in by_noise and "more than noise" not in by_noise
    assert free_run_caption(gap("moves_3", free_run=3.0, free_run_floor=0.5), one).endswith(
        "more than noise is behind it"
    )
