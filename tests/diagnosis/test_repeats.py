"""Declared repeats put what does not repeat into the floor, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.measures import measure_gaps
from linid.diagnosis.repeats import aligned, repeats_of
from linid.identification.settings import HORIZON

from .machine import Noise, drift, recording, result

QUIET = Noise(encoder=1e-8)


def test_repeats_are_those_that_were_declared() -> None:
    a, b, c = recording("a"), recording("b", repeat_of="a"), recording("c", repeat_of="a")
    other = recording("d")
    every = (a, b, c, other)
    assert [r.name for r in repeats_of(a, every)] == ["b", "c"]
    assert [r.name for r in repeats_of(b, every)] == ["a", "c"]
    assert repeats_of(other, every) == ()


def test_scatter_between_repeats_is_the_floor_and_a_common_error_is_not() -> None:
    """The machine pushes with 0.3 N that the model lacks, give or take 0.02 N that differ between the repeats."""
    a = recording("a", extra=0.32, noise=QUIET)
    b = recording("b", extra=0.28, noise=QUIET, seed=1, repeat_of="a")
    alone = measure_gaps(result(), [a])[0][0]
    gap = measure_gaps(result(), [a], among=(a, b))[0][0]
    assert (alone.repeats, gap.repeats) == (0, 1)
    assert alone.force_floor < 0.002
    assert gap.force == alone.force == pytest.approx(0.32, rel=1e-2)
    # standard deviation of the two values 0.32 and 0.28
    assert gap.force_floor == pytest.approx(np.std([0.32, 0.28], ddof=1), rel=0.02)
    assert gap.ahead_floor == pytest.approx(abs(float(drift(HORIZON, 0.04))) / np.sqrt(2.0), rel=0.02)


def test_noise_alone_does_not_raise_the_floor() -> None:
    noise = Noise(encoder=5e-6)
    a = recording("a", noise=noise)
    b = recording("b", noise=noise, seed=1, repeat_of="a")
    alone = measure_gaps(result(), [a])[0][0]
    gap = measure_gaps(result(), [a], among=(a, b))[0][0]
    assert gap.force_floor == pytest.approx(alone.force_floor, rel=0.15)
    assert gap.ahead_floor == pytest.approx(alone.ahead_floor, rel=0.25)


@pytest.mark.parametrize("lag", [-37, 0, 120])
def test_late_or_early_scopes_are_aligned(lag: int) -> None:
    whole = recording("a", duration=3.5)

    def part(first: int, name: str) -> object:
        rows = slice(first, first + 3000)
        assert whole.drive_input is not None
        return replace(whole, name=name, t=whole.t[:3000], y=whole.y[rows], drive_input=whole.drive_input[rows])

    pair = aligned(part(200, "a"), part(200 + lag, "b"))  # type: ignore[arg-type]
    assert pair is not None
    one, other = pair
    assert one.t.size == other.t.size == 3000 - abs(lag)
    np.testing.assert_array_equal(one.y, other.y)
    np.testing.assert_array_equal(one.drive_input, other.drive_input)


def test_what_cannot_be_aligned_is_left_out() -> None:
    one = recording()
    assert aligned(one, replace(one, t=one.t * 2.0)) is None
    assert aligned(one, replace(one, kind="free_wheel")) is None
