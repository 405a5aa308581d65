"""Campaigns: the same bytes for the same seed, splits, keys, plan."""

from __future__ import annotations

import hashlib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from linid.challenge.axes import draw_axis, thrust_per_ampere
from linid.challenge.catalogue import ENTRIES, FIRST, LISTED, OUTSIDE
from linid.challenge.create import make_challenge
from linid.challenge.files import Key, read_keys
from linid.challenge.hidden_axis import AXES, LAWS, AxisKind
from linid.challenge.make import RATES, Plan, assignment, variant
from linid.challenge.plant import simulate
from linid.errors import UsageError
from linid.recording.campaign import read_campaign
from linid.stand.plant import plant_parameters, thrust
from tests.workflow.small import linid

# The cheapest to make.
PLAN = Plan(11, effects=("current_offset", "external_disturbance", "payload_change"), kinds=("single", "none"))


def digests(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Key]]:
    folder = tmp_path_factory.mktemp("challenge") / "proof"
    return folder, make_challenge(PLAN, 2, folder, keys_path=folder.parent / "keys.yaml")


def test_equal_seeds_give_equal_bytes_whatever_jobs_and_count(
    made: tuple[Path, dict[str, Key]], tmp_path: Path
) -> None:
    folder, keys = made
    again = make_challenge(PLAN, 3, tmp_path / "again", jobs=2)
    ours = digests(folder)
    theirs = digests(tmp_path / "again")
    assert len(ours) == 2 * (20 + 6) and set(ours) <= set(theirs)
    assert all(theirs[name] == digest for name, digest in ours.items())
    assert {name: again[name] for name in keys} == keys


def test_another_seed_gives_another_axis(made: tuple[Path, dict[str, Key]], tmp_path: Path) -> None:
    other = make_challenge(Plan(12, kinds=("none",)), 1, tmp_path / "other")
    assert other["axis_0001"].base != made[1]["axis_0001"].base


def test_campaigns_are_read_with_every_mode_in_both_splits(made: tuple[Path, dict[str, Key]]) -> None:
    for name in made[1]:
        campaign = read_campaign(made[0] / name / "campaign.yaml")
        assert len(campaign.recordings) == 19
        splits: dict[str, set[str]] = {}
        for recording in campaign.recordings:
            splits.setdefault(recording.name.rsplit("_", 1)[0], set()).add(recording.split)
            assert 1 / (recording.t[1] - recording.t[0]) == pytest.approx(1000)
        assert len(splits) == 6 and all(both == {"fit", "held_out"} for both in splits.values())
        assert len({r.added_mass for r in campaign.recordings if r.kind == "free_wheel"}) == 3
        fresh = read_campaign(made[0] / "fresh" / name / "campaign.yaml")
        assert {r.split for r in fresh.recordings} == {"held_out"}
        assert not {r.name for r in fresh.recordings} & {r.name for r in campaign.recordings}


def test_nothing_but_the_keys_file_tells_what_is_hidden(made: tuple[Path, dict[str, Key]]) -> None:
    folder, keys = made
    assert not list(folder.rglob("*keys*")) and not list(folder.rglob("*truth*"))
    words = [name for key in keys.values() for name in key.effects]
    assert words
    for path in folder.rglob("*.yaml"):
        assert not any(word in path.read_text(encoding="utf-8") for word in (*words, "seed", "strength"))


def test_keys_come_back_from_their_file(made: tuple[Path, dict[str, Key]]) -> None:
    folder, keys = made
    assert read_keys(folder.parent / "keys.yaml") == keys
    for key in keys.values():
        assert key.base["mass"] > 0 and set(key.strength) == set(key.parameters) == set(key.effects)
        assert all(0.05 * 0.97 <= s <= 1.0 * 1.03 for s in key.strength.values())


def test_kinds_and_effects_are_shared_out_evenly() -> None:
    given_out = [assignment(Plan(4), index) for index in range(600)]
    kinds = Counter(kind for kind, _, _ in given_out)
    assert kinds == {"single": 360, "pair": 120, "none": 60, "unknown": 60}
    singles = Counter(names[0] for kind, names, _ in given_out if kind == "single")
    assert singles == dict.fromkeys(FIRST, 20)
    unknowns = Counter(names[0] for kind, names, _ in given_out if kind == "unknown")
    assert set(unknowns) == set(OUTSIDE) and max(unknowns.values()) - min(unknowns.values()) <= 1
    assert all(len(set(names)) == 2 for kind, names, _ in given_out if kind == "pair")
    strengths = np.log([s for _, _, wanted in given_out for s in wanted])
    assert np.exp(strengths.min()) >= 0.05 and np.exp(strengths.max()) <= 1.0
    # Uniform in the logarithm: the mean within four standard errors of the middle.
    span = np.log(1 / 0.05)
    assert abs(strengths.mean() - np.log(0.05) / 2) < 4 * span / np.sqrt(12 * strengths.size)


def test_crowds_hold_three_to_six_different_effects_equally_often() -> None:
    given_out = [assignment(Plan(4, kinds=("crowd",)), index) for index in range(600)]
    assert {kind for kind, _, _ in given_out} == {"crowd"}
    assert all(len(set(names)) == len(names) == len(wanted) for _, names, wanted in given_out)
    sizes = Counter(len(names) for _, names, _ in given_out)
    assert set(sizes) == {3, 4, 5, 6}
    # Four equal chances: 600 draws lie within four standard deviations of 150 each.
    assert all(abs(number - 150) < 4 * np.sqrt(600 * 3 / 16) for number in sizes.values())
    shown = Counter(name for _, names, _ in given_out for name in names)
    assert set(shown) == {name for name in LISTED if "phase" in ENTRIES[name].axes}
    strengths = [s for _, _, wanted in given_out for s in wanted]
    assert min(strengths) >= 0.05 and max(strengths) <= 1.0


def test_all_effects_are_hidden_where_they_can_be() -> None:
    plan = Plan(4, effects=("all",), kinds=("single",), axes=AXES, laws=LAWS, rates=RATES, encoders=(1e-7, 1e-5))
    axes = [draw_axis("axis", np.random.default_rng(k)) for k in range(3)]
    shown, seen = Counter[str](), Counter[object]()
    for index in range(3 * len(LISTED)):
        _, names, _ = assignment(plan, index)
        axis = variant(plan, index, axes[index % 3], names)
        assert axis.kind in ENTRIES[names[0]].axes
        assert 1e-7 <= axis.measurement.position_resolution_m <= 1e-5
        shown.update(names)
        seen.update((axis.kind, axis.law, 1 / axis.measurement.sample_period_s))
    assert shown == dict.fromkeys(LISTED, 3)
    assert set(seen) == {*AXES, *LAWS, *RATES}


def test_crowds_hold_what_their_axis_can_have_and_what_is_named_beside_it() -> None:
    plan = Plan(5, effects=("all", "floor_vibration"), kinds=("crowd",), axes=AXES)
    names = [assignment(plan, index)[1] for index in range(300)]
    for index, crowd in enumerate(names):
        kind = variant(plan, index, draw_axis("axis", np.random.default_rng(1)), crowd).kind
        assert all(kind in ENTRIES[name].axes for name in crowd)
    together = {name for crowd in names for name in crowd}
    assert together == {*LISTED, "floor_vibration"}


def test_strengths_keep_within_what_an_effect_can_reach() -> None:
    plan = Plan(6, effects=("dwell_stiction",), strength=(0.1, 1.0), kinds=("single",))
    wanted = [assignment(plan, index)[2][0] for index in range(200)]
    most = ENTRIES["dwell_stiction"].most
    assert min(wanted) >= 0.1 and 0.9 * most < max(wanted) <= most


@pytest.mark.parametrize("kind", AXES)
def test_campaigns_of_every_kind_of_axis_are_read_back(kind: AxisKind, tmp_path: Path) -> None:
    plan = Plan(
        13,
        effects=("payload_change",),
        kinds=("single",),
        axes=(kind,),
        laws=("dahl",),
        rates=(500.0,),
        encoders=(2e-6, 2e-6),
    )
    key = make_challenge(plan, 1, tmp_path / "made")["axis_0001"]
    campaign = read_campaign(tmp_path / "made/axis_0001/campaign.yaml")
    rotary = kind == "q_rotary"
    assert campaign.axis == ("rotary" if rotary else "linear")
    assert (key.axis, key.law, key.rate) == (kind, "dahl", 500.0)
    assert key.shares["payload_change"] + key.unexplained == pytest.approx(1.0) and key.gap is not None
    for recording in campaign.recordings:
        assert recording.t[1] - recording.t[0] == pytest.approx(2e-3)
        if recording.kind == "motor":
            assert (recording.phase_currents is None) == (kind != "phase")
    if kind == "phase":
        return
    # On a free wheel the friction of the key brakes the inertia of the key.
    wheel = next(r for r in campaign.recordings if r.kind == "free_wheel" and r.added_mass > 0)
    moving = wheel.t < wheel.t[0] + 0.1
    speed, acceleration = np.polyfit(wheel.t[moving] - wheel.t[0], wheel.y[moving], 3)[[2, 1]] * [1, 2]
    expected = -np.sign(speed) * key.base["coulomb_force"] - key.base["viscous_friction"] * speed
    assert acceleration * (key.base["mass"] + wheel.added_mass) == pytest.approx(expected, rel=0.03)


@hypothesis_settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_drawn_axes_are_realistic_and_move_plausibly(seed: int) -> None:
    axis = draw_axis("axis", np.random.default_rng(seed))
    assert 0.3 <= axis.mass_kg <= 3.0
    double = 2 if axis.motor.kind == "theta" else 1
    assert 8e-3 <= np.pi / (double * axis.motor.electrical_wavenumber_per_m) <= 30e-3
    mean = np.mean([thrust(y, 1.0, plant_parameters(axis)) for y in np.linspace(0, 0.3, 2000)])
    assert thrust_per_ampere(axis) == pytest.approx(mean, rel=0.02)
    # Open-loop oscillations and free wheels of the axis without effects stay within the stroke.
    for mode in axis.campaign[:2] + axis.campaign[8:9]:
        run = simulate(axis, mode, substeps=1)
        assert axis.stroke.lower_m <= run.peak[0] and run.peak[1] <= axis.stroke.upper_m
        assert np.ptp(run.y) > 1e-3 and np.abs(run.v).max() < 3.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"effects": ("coging",)},
        {"strength": (0.5, 0.1)},
        {"strength": (0.0, 1.0)},
        {"kinds": ("triple",)},
        {"kinds": ()},
        {"effects": ("cogging",), "kinds": ("pair",)},
        {"effects": ("cogging", "end_effect"), "kinds": ("crowd",)},
        {"laws": ("stribeck",)},
        {"axes": ()},
        {"axes": ("rotary",)},
        {"rates": (300.0,)},
        {"encoders": (1e-5, 1e-7)},
        {"encoders": (0.1, 10.0)},
    ],
    ids=str,
)
def test_a_wrong_plan_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(UsageError):
        Plan(1, **wrong)  # type: ignore[arg-type]


def test_a_folder_that_holds_something_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "note.txt").write_text("mine", encoding="utf-8")
    result = linid("challenge", "make", "--count", 1, "--out", tmp_path)
    assert result.exit_code == 2 and "not an empty folder" in result.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["note.txt"]
