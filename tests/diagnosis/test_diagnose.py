"""The whole diagnosis on the generated stand: nothing hidden, a mass that nobody wrote down, too little to decide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.diagnose import Found, diagnose
from linid.diagnosis.means import Means
from linid.errors import UsageError
from linid.identification.result import ModelKind
from linid.physics.effects.registry import find_effect
from linid.recording.recording import Recording
from tests.identification.stand import stand

NAMES = (
    "freewheel_1",
    "freewheel_2",
    "freewheel_3",
    "freewheel_4",
    "sine_current_2",
    "sine_current_3",
    "sine_position_1",
    "moves_1",
    "moves_2",
    "moves_3",
)


def recordings(config: str = "stand_axis.yaml") -> tuple[Recording, ...]:
    found = stand(config, only=NAMES).recordings
    return tuple(replace(r, number=k) for k, r in enumerate(found, 1))


def run(chosen: tuple[Recording, ...], kind: ModelKind = "sine") -> Found:
    return diagnose("stand", chosen, kind, means=Means(2))


def test_nothing_is_missing_where_nothing_is_hidden() -> None:
    found = run(recordings())
    assert found.diagnosis.verdict.status == "none"
    assert found.diagnosis.budget.excess_before < 0.3 and found.diagnosis.budget.entries == ()
    assert found.after is found.before


@pytest.mark.parametrize(
    ("kind", "config", "heavier"),
    [("sine", "stand_axis.yaml", {"moves_3"}), ("theta", "stand_axis.yaml", {"sine_position_1", "moves_3"})],
)
def test_a_wrong_added_mass_is_found_with_its_recordings(kind: ModelKind, config: str, heavier: set[str]) -> None:
    """Recordings that carried 0.15 kg more than the campaign says: a held-out one, and a fitted one with it."""
    wrong = tuple(replace(r, added_mass=r.added_mass - 0.15) if r.name in heavier else r for r in recordings(config))
    found = run(wrong, kind).diagnosis
    assert found.model == kind
    # Of the theta motor the field's third harmonic is held, for which the currents all but sum to zero.
    assert found.verdict.status == "explained" or (kind == "theta" and found.verdict.status == "partly explained")
    assert found.verdict.effects == ("payload_change",)
    (named,) = found.budget.entries
    assert found.budget.closed > 0.9 and named.share > 0.9
    values = {e.name: e.value for e in named.parameters}
    assert abs(values["payload_mass"] - 0.15) < 0.003
    assert {r.name for r in wrong if find_effect("payload_change").acts_in(values, r.number)} >= heavier


def test_what_is_seen_in_held_out_recordings_alone_is_not_named() -> None:
    """A force that only the held-out recordings have: no effect fitted to the others can be the cause."""
    random = np.random.default_rng(1)
    bent = []
    for r in recordings():
        if r.split == "held_out" and r.kind != "free_wheel":
            wave = np.convolve(random.standard_normal(r.t.size), np.hanning(60), mode="same")
            bent.append(replace(r, y=r.y + 2e-6 * wave / np.std(wave)))
        else:
            bent.append(r)
    assert run(tuple(bent)).diagnosis.verdict.status in ("unknown", "none")


def test_without_held_out_recordings_there_is_no_judge() -> None:
    with pytest.raises(UsageError, match="held-out"):
        run(tuple(replace(r, split="fit") for r in recordings()))


def test_an_effect_of_the_base_is_never_called_in_question() -> None:
    """A mass is hidden, a constant force is not: it would fail every test, but it belongs to the base."""
    wrong = tuple(
        replace(r, added_mass=r.added_mass - 0.15) if r.name in {"sine_position_1", "moves_3"} else r
        for r in recordings()
    )
    found = diagnose("stand", wrong, "sine", effects=("constant_force",), means=Means(2))
    assert found.before.effects == ("constant_force",)
    assert found.after.effects == ("constant_force", "payload_change")
    assert [entry.effect for entry in found.diagnosis.budget.entries] == ["payload_change"]
    assert "constant_force" not in {one.effect for one in found.diagnosis.tried}
