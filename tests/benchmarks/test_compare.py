"""The statistics of the comparison of two commits, on times that are made up."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks import compare as comparison
from tests.benchmarks.compare import LEAST, Checkout, compare, measure, table

ROUNDS = 15


def made_up(ratio: float, seed: int, spread: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """Times of two commits: log-normal noise, busy spells that hit both neighbours, and single outliers upwards."""
    generator = np.random.default_rng(seed)
    spell = np.where(generator.random(ROUNDS) < 0.1, 1.5, 1.0)
    noise = np.exp(spread * generator.standard_normal((2, ROUNDS)))
    noise[generator.random((2, ROUNDS)) < 0.05] *= 3.0
    return 0.1 * spell * noise[0], 0.1 * ratio * spell * noise[1]


def test_a_known_ratio_is_found_and_lies_within_its_interval() -> None:
    found = [compare(*made_up(1.3, seed)) for seed in range(60)]
    assert np.median([f.ratio for f in found]) == pytest.approx(1.3, rel=0.02)
    assert np.mean([f.low <= 1.3 <= f.high for f in found]) >= 0.9
    assert np.mean([f.verdict == "slower" for f in found]) >= 0.9
    assert not any(f.verdict == "faster" for f in found)
    reverse = [compare(*made_up(1.0 / 1.3, seed)).verdict for seed in range(60)]
    assert np.mean([verdict == "faster" for verdict in reverse]) >= 0.9


@pytest.mark.parametrize("rounds", [LEAST, ROUNDS])
def test_equal_times_are_not_called_different(rounds: int) -> None:
    verdicts = [compare(*(t[:rounds] for t in made_up(1.0, seed))).verdict for seed in range(200)]
    assert np.mean([verdict == "no difference to see" for verdict in verdicts]) >= 0.95
    same = np.full(ROUNDS, 0.2)
    assert compare(same, same).verdict == "no difference to see" and compare(same, same).ratio == 1.0


def test_a_sure_but_negligible_difference_is_none() -> None:
    times = np.full(ROUNDS, 0.1)
    assert compare(times, 1.01 * times).verdict == "no difference to see"
    assert compare(times, 1.05 * times).verdict == "slower"


def test_too_few_rounds_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 8"):
        compare([1.0] * 7, [1.0] * 7)


def test_the_table_names_every_benchmark_with_its_verdict() -> None:
    text = table({"one": ([1.0] * 8, [2.0] * 8), "two": ([1.0] * 8, [1.0] * 8)}, ("old", "new")).splitlines()
    assert text[2].startswith("| one | 1 | 2 | 2.000 |") and text[2].endswith("slower |")
    assert text[3].endswith("no difference to see |")


def test_the_quick_benchmarks_measure_every_kind_of_motor() -> None:
    times = measure()
    assert {name.split(":")[0] for name in times} == {"friction", "force", "sine", "theta"}
    assert all(seconds > 0.0 for seconds in times.values())


def test_what_a_commit_lacks_is_left_out(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def lacking(kind: str) -> dict[str, float]:
        if kind == "theta":
            raise KeyError(kind)
        return {"one simulation": 1.0}

    monkeypatch.setattr(comparison, "_simulation", lacking)
    assert set(measure()) == {"friction: one simulation", "force: one simulation", "sine: one simulation"}
    assert "theta: left out: KeyError" in capsys.readouterr().err


@pytest.mark.slow
def test_a_checkout_measures_the_code_of_its_commit_and_leaves_nothing(tmp_path: Path) -> None:
    """A commit whose `Model` is broken for theta is measured without theta: so it is that commit's code which ran."""
    repository = tmp_path / "repository"
    subprocess.run(["git", "clone", "--quiet", str(comparison.ROOT), str(repository)], check=True)

    def git(*arguments: str) -> str:
        command = ["git", "-c", "user.name=t", "-c", "user.email=t@example.org", *arguments]
        return subprocess.run(command, cwd=repository, check=True, capture_output=True, text=True).stdout.strip()

    model = repository / "linid" / "physics" / "model.py"
    model.write_text(model.read_text() + "\n\ndel MOTORS['theta']\n")
    git("commit", "--quiet", "--all", "--message", "broken")
    folder = tmp_path / "work"
    folder.mkdir()
    original = comparison.ROOT
    comparison.ROOT = repository
    try:
        checkout = Checkout("HEAD", folder)
        times = checkout.round(commands=False)
        checkout.remove()
    finally:
        comparison.ROOT = original
    assert "sine: one simulation" in times and "theta: one simulation" not in times
    assert not checkout.tree.exists() and len(git("worktree", "list").splitlines()) == 1
