"""How often a rise of errors is put down to chance where it is chance, and where it is not."""

from __future__ import annotations

import numpy as np

from linid.diagnosis.by_chance import CHANCE, by_chance
from linid.diagnosis.forecast import PIECES

WINDOWS, DRAWS = 60, 400


def errors(generator: np.random.Generator, own: float, rise: float) -> tuple[np.ndarray, np.ndarray]:
    """Errors of two models in um, windows half over each other: what both miss alike, and their own parts (RMS); those
    of the second are larger by a factor."""

    def overlapping() -> np.ndarray:
        halves = generator.standard_normal(WINDOWS + 1)
        return (halves[1:] + halves[:-1]) / np.sqrt(2.0)

    alike = np.sqrt(1.0 - own**2) * overlapping()
    return alike + own * overlapping(), rise * (alike + own * overlapping())


def found(own: float, rise: float) -> float:
    """Share of draws in which a rise is found to be more than chance."""
    generator = np.random.default_rng(11)
    return float(np.mean([not by_chance(*errors(generator, own, rise), 0.1) for _ in range(DRAWS)]))


def test_of_two_models_that_are_as_good_one_is_rarely_said_to_be_worse() -> None:
    scatter = np.sqrt(CHANCE * (1.0 - CHANCE) / DRAWS)
    assert found(0.3, 1.0) < CHANCE + 3.0 * scatter and found(1.0, 1.0) < CHANCE + 3.0 * scatter
    # That the RMS has risen by a tenth is no such test: of models whose errors are their own it is said of every third.
    generator = np.random.default_rng(11)
    pairs = [errors(generator, 1.0, 1.0) for _ in range(DRAWS)]
    assert np.mean([np.std(after) > 1.1 * np.std(before) for before, after in pairs]) > 0.2


def test_a_rise_is_found() -> None:
    assert found(0.3, 1.5) > 0.9 and found(0.1, 1.2) > 0.9


def test_few_windows_and_runs_that_diverge_are_not_put_down_to_chance() -> None:
    same = np.ones(PIECES)
    assert by_chance(same, same, 0.1) and not by_chance(same[1:], same[1:], 0.1)
    assert not by_chance(same, np.where(np.arange(PIECES) == 3, np.nan, 1.0), 0.1)
