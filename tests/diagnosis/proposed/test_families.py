"""Arguments, histories, families and waves on a synthetic axis: each finds its own force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.proposed.arguments import arguments_of
from linid.diagnosis.proposed.family import families, of_running_time, per_recording
from linid.diagnosis.proposed.history import direction_of, last_where, memory_of, travelled
from linid.diagnosis.proposed.leftover import Leftover
from linid.diagnosis.proposed.regression import Regression, Sums
from linid.diagnosis.proposed.wander import wandering
from linid.diagnosis.proposed.waves import wave_families
from linid.physics.effects.effect import ARGUMENTS
from tests.diagnosis.proposed.axis import LENGTH, RECORDINGS, STEP, axis, rows_of

SMOOTH = ("position", "velocity", "travel", "since_reversal", "motor_force", "force_rate", "time", "campaign_time")


@pytest.mark.parametrize("key", SMOOTH)
@pytest.mark.parametrize("form", ["{}", "{} x direction", "{} x velocity"])
def test_a_function_of_an_argument_is_taken_by_its_family(key: str, form: str) -> None:
    """A wave over the argument's range, alone, as friction and as damping: the family of that form takes nearly all."""
    named = form.format(key)
    factor = {"{}": lambda p: 1.0, "{} x direction": lambda p: p.friction, "{} x velocity": lambda p: 4.0 * p.rows.v}[
        form
    ]
    known = {one.form: one for one in families(axis(None), arguments_of(axis(None)))}
    if named not in known:
        pytest.skip("no such family")

    def force(p):  # type: ignore[no-untyped-def]
        x = arguments_of(p)[key].values
        low, high = np.quantile(x[np.isfinite(x)], [0.01, 0.99])
        return np.sin(3.0 * np.clip((x - low) / (high - low), 0.0, 1.0) + 0.4) * 2.0 * factor(p)

    problem = axis(force)
    family = next(one for one in families(problem, arguments_of(problem)) if one.form == named)
    regression = Regression(Sums(problem, 0.0), family)
    if key == "campaign_time":  # no other recording repeats it
        pieces = {f.form.split(",")[0]: f for f in of_running_time(problem, arguments_of(problem), 0.5)}
        if named not in pieces:
            pytest.skip("no such family")
        regression = Regression(Sums(problem, 0.5), pieces[named])
    assert regression.best[1] > 0.9 * (1.0 - problem.floor)


def test_arguments_have_names_and_values_of_all_rows() -> None:
    problem = axis(None, rests=True)
    for argument in arguments_of(problem).values():
        assert argument.name in ARGUMENTS and argument.values.shape == problem.rows.t.shape
        assert np.all(np.isfinite(argument.values))
    assert "motor_force" not in arguments_of(replace(problem, push=np.zeros(problem.rows.t.size)))
    assert "pole_phase" not in arguments_of(replace(problem, field=None))
    assert "campaign_time" not in arguments_of(replace(problem, elapsed=np.zeros(RECORDINGS)))


def test_history_is_each_recordings_own() -> None:
    problem = axis(None, rests=True)
    rows, memory = problem.rows, memory_of(axis(None, rests=True).rows)
    first = np.arange(RECORDINGS) * LENGTH
    assert (
        np.all(memory.travel[first] == 0.0)
        and np.all(memory.lasting[first] == 0.0)
        and np.all(memory.rest[first] == 0.0)
    )
    assert np.all(memory.travel >= 0.0) and np.all(memory.slid >= 0.0)
    assert np.max(memory.rest) == pytest.approx(0.5, abs=0.15)
    # A longest rest is as long as the rows that stand still.
    still = rows.standstill.reshape(RECORDINGS, LENGTH)
    runs = [max(map(len, "".join("x" if s else " " for s in row).split()), default=0) for row in still]
    assert np.max(memory.rest) == pytest.approx(max(runs) * STEP, abs=0.06)
    moving = ~rows.standstill
    assert np.array_equal(direction_of(rows)[moving], np.sign(rows.v[moving]))
    gone = travelled(rows)
    assert gone[-1] == pytest.approx(
        sum(np.abs(np.diff(y)).sum() for y in rows.y.reshape(RECORDINGS, LENGTH)), rel=1e-9
    )
    mask = np.zeros(2 * LENGTH, dtype=bool)
    mask[5] = True
    last = last_where(mask, rows.recording[: 2 * LENGTH])
    assert np.all(last[:5] == -1) and np.all(last[5:LENGTH] == 5) and np.all(last[LENGTH:] == -1)


def test_steps_of_single_recordings_are_found_in_those() -> None:
    sizes = np.random.default_rng(3).uniform(-1.0, 1.0, RECORDINGS)
    problem = axis(lambda p: sizes[p.rows.recording] * p.rows.v)
    gains = {f.form: Regression(Sums(problem, f.local), f).best[1] for f in per_recording(problem, 0.5)}
    assert max(gains, key=gains.__getitem__) == "damping per recording"
    assert gains["damping per recording"] > 0.9 * (1.0 - problem.floor)


@pytest.mark.parametrize("periods", [(0.0231,), (0.0173, 0.0419)])
def test_waves_have_the_true_periods(periods: tuple[float, ...]) -> None:
    problem = axis(lambda p: sum(np.sin(2.0 * math.pi * p.rows.y / period + k) for k, period in enumerate(periods)))
    found = {
        f.form.rsplit(", ", 1)[1]: f for f in wave_families(problem, arguments_of(problem), Leftover(problem).of_rows)
    }
    waves = sorted(2.0 * math.pi / k for k in found["force"].sides[0].wavenumbers)
    assert waves == pytest.approx(sorted(periods), rel=3e-3)
    assert Regression(Sums(problem, 0.0), found["force"]).closed() > 0.95


def test_what_wanders_is_told_by_its_neighbours_alone() -> None:
    """A force that holds for a second each is foretold, white noise is not."""
    levels = np.random.default_rng(7).standard_normal(40)
    slow = axis(lambda p: levels[(p.elapsed[p.rows.recording] + p.rows.t).astype(int)])
    none = axis(None)
    for problem, low, high in ((slow, 0.6, 1.0), (none, -0.2, 0.1)):
        family = next(iter(wandering(problem)))
        assert family.wanders and family.arguments == ("time",)
        assert low < Regression(Sums(problem, 0.0), family).best[1] < high


def test_a_new_level_of_friction_is_felt_as_the_bristles_bend() -> None:
    """Creep at a fraction of a millimetre per second: a level that steps up bends the bristles over the next way, and
    the difference of two integrations in fine steps is what the rows show."""
    n, speed, coulomb, stiffness, mass = LENGTH, 3e-4, 6.0, 4e4, 2.0
    t = STEP * np.arange(n)
    step = np.where(t > 0.4, 0.05, 0.0)
    fine = np.linspace(0.0, t[-1], 100 * n)
    bent = []
    for more in (0.0, 1.0):
        level, z = coulomb + more * np.interp(fine, t, step), np.zeros(fine.size)
        for k in range(1, fine.size):
            z[k] = z[k - 1] + (fine[1] - fine[0]) * speed * (1.0 - stiffness * z[k - 1] / level[k])
        bent.append(stiffness * np.interp(t, fine, z))
    rows = rows_of(axis(None), np.arange(RECORDINGS * LENGTH) < n).rows
    rows = replace(rows, t=t, y=speed * t, v=np.full(n, speed), standstill=np.zeros(n, dtype=bool))
    problem = replace(
        rows_of(axis(None), np.arange(RECORDINGS * LENGTH) < n),
        rows=rows,
        friction=-bent[0] / coulomb,
        follows=np.full(n, coulomb / stiffness),
        mass=np.full(n, mass),
    )
    felt = problem.resisted(step[:, None])[:, 0]
    wanted = -(bent[1] - bent[0]) / mass
    assert np.max(np.abs(wanted)) > 0.8 * 0.05 / mass
    assert np.max(np.abs(felt - wanted)) < 0.03 * np.max(np.abs(wanted))
    assert np.abs(felt[np.searchsorted(t, 0.41)]) < 0.1 * np.max(np.abs(wanted))
