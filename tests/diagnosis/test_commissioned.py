"""A given model as the base: what has changed since is named with its size, and nothing where nothing has."""

from __future__ import annotations

from dataclasses import replace

import pytest

from linid.diagnosis.commissioned import has_a_gap, of_one_curve, parameter_changes
from linid.diagnosis.diagnose import Found, diagnose
from linid.diagnosis.held_out_tests import Part
from linid.diagnosis.lead import with_effects_of
from linid.diagnosis.means import Means
from linid.diagnosis.report_data import Entry, ParameterChange
from linid.diagnosis.select import Selection
from linid.errors import UsageError
from linid.identification.model_file import model_from_text, model_to_text
from linid.identification.result import Estimate, FitResult
from linid.physics.model import Model
from linid.report.diagnosis.changes import change_words
from linid.report.diagnosis.files import diagnosis_data
from tests.diagnosis import machine
from tests.diagnosis.machine import Noise
from tests.diagnosis.test_diagnose import NAMES, recordings
from tests.diagnosis.test_joint import TRUE, fitted, judged
from tests.diagnosis.test_lacking import EVIDENCE
from tests.identification.stand import stand

KNOWN_TO = 5e-3  # of each value: intervals of the given model


def commissioned(**factors: float) -> FitResult:
    """The stand's true motor with some parameters times a factor, as a fit would write it."""
    truth = stand("stand_axis.yaml", only=NAMES).truth
    estimates = []
    for p in Model("theta").parameters:
        value = truth.get(p.name, p.default) * factors.get(p.name, 1.0)
        half = KNOWN_TO * abs(value)
        estimates.append(Estimate(p.name, p.symbol, p.unit, value, half / 2.0, value - half, value + half))
    made = replace(machine.result(), model="theta", estimates=tuple(estimates))
    return model_from_text(model_to_text(made), "test")


def run(since: FitResult) -> Found:
    return diagnose("stand", recordings(), since.model, since=since, means=Means(2))


def test_nothing_has_changed_since_the_machine_was_as_it_is() -> None:
    since = commissioned()
    found = run(since)
    assert found.diagnosis.verdict.status == "none" and found.diagnosis.changes == ()
    assert found.before is since and found.after is since
    assert change_words(found.diagnosis).startswith("Nothing has changed")


def test_two_changed_parameters_are_told_with_their_sizes() -> None:
    """When it was commissioned the machine pushed 8 % harder and had a quarter less friction."""
    since = commissioned(force_constant=1.08, coulomb_force=0.75, static_force=0.75)
    found = run(since)
    diagnosis = found.diagnosis
    assert set(diagnosis.verdict.effects) == {"force_constant_change", "friction_level_change"}
    assert diagnosis.budget.closed > 0.98
    changes = {one.parameter: one for one in diagnosis.changes}
    truth = stand("stand_axis.yaml", only=NAMES).truth
    for name in ("force_constant", "coulomb_force"):
        # As well as the given model knows itself.
        assert changes[name].after == pytest.approx(truth[name], rel=2.0 * KNOWN_TO)
        assert changes[name].before == since.value(name)
        half = 0.5 * (changes[name].high - changes[name].low)
        assert 0.9 * KNOWN_TO < half / truth[name] < 2.0 * KNOWN_TO
    assert changes["force_constant"].share == pytest.approx(1.0 / 1.08 - 1.0, abs=2.0 * KNOWN_TO)
    said = change_words(diagnosis)
    assert "coulomb force 1.29 to 1.7" in said and "N (+3" in said
    assert {one["parameter"] for one in diagnosis_data(diagnosis)["changes"]} == set(changes)


@pytest.mark.parametrize(
    ("parameter", "factor", "effect"),
    [("static_force", 0.75, "breakaway_change"), ("commutation_offset", 0.8, "commutation_change")],
)
def test_what_recordings_tell_less_of_is_named_too(parameter: str, factor: float, effect: str) -> None:
    """When it was commissioned the machine broke away a quarter sooner, or its field stood elsewhere."""
    found = run(commissioned(**{parameter: factor}))
    assert set(found.diagnosis.verdict.effects) == {effect} and found.diagnosis.budget.closed > 0.95
    (change,) = found.diagnosis.changes
    truth = stand("stand_axis.yaml", only=NAMES).truth[parameter]
    assert change.parameter == parameter and change.after == pytest.approx(truth, rel=4e-2)
    # Of the field's phase only its product with a force constant is told, which the given model knows to 0.5 % itself.
    assert parameter == "commutation_offset" or change.low < truth < change.high


def test_an_effect_that_acts_in_some_recordings_is_no_changed_parameter() -> None:
    values = {"payload_mass": 0.2, "payload_recordings": 3.0}
    own = tuple(Estimate(name, name, "kg", value, 0.01, value - 0.02, value + 0.02) for name, value in values.items())
    since = machine.result()
    after = replace(since, effects=("payload_change",), estimates=(*since.estimates, *own))
    three = tuple(machine.recording(f"run_{k}", number=k) for k in (1, 2, 3))
    (change,) = parameter_changes(since, after, three[:2])
    assert (change.parameter, change.before, change.after) == ("mass", machine.MASS, machine.MASS + 0.2)
    assert parameter_changes(since, after, three) == ()


def test_a_model_of_another_kind_of_axis_is_refused() -> None:
    rotary = tuple(replace(r, axis="rotary") for r in recordings())
    with pytest.raises(UsageError, match="rotary axis, the model of a linear one"):
        diagnose("stand", rotary, "theta", since=commissioned(), means=Means(2))


def test_a_level_beside_a_curve_over_the_place_is_part_of_it_where_some_place_is_as_it_was() -> None:
    """A bump in the middle shows as a level and a curve that takes it back; a level everywhere is one of its own."""

    def line(effect: str, share: float, values: dict[str, float]) -> Entry:
        own = tuple(Estimate(name, name, "1", value, 0.0, value, value) for name, value in values.items())
        return Entry(effect, (), share, share - 0.1, share + 0.1, 0.5, 0.5, 9.0, own)

    def lines(level: float) -> tuple[Entry, ...]:
        curve = {f"friction_at_{k}": -0.13 * min(abs(k - 6) / 3.0, 1.0) for k in range(1, 12) if k != 6}
        return (
            line("cogging", 0.3, {}),
            line("friction_level_change", 0.5, {"friction_change": level}),
            line("position_dependent_friction", 0.1, curve),
        )

    changes = (ParameterChange("coulomb_force", "N", "friction_level_change", 1.0, 1.15, 1.14, 1.16),)
    (first, second), none = of_one_curve(lines(0.15), changes)
    assert (first.effect, second.effect, none) == ("position_dependent_friction", "cogging", ())
    assert first.share == pytest.approx(0.6) and first.high - first.share == pytest.approx(0.1 * 2**0.5)
    assert {e.name for e in first.parameters} >= {"friction_change", "friction_at_1"}
    for kept in (of_one_curve(lines(0.4), changes), of_one_curve(lines(0.15), ())):
        assert [entry.effect for entry in kept[0]] == [entry.effect for entry in lines(0.4)]


def test_what_is_named_of_next_to_no_gap_is_taken_back() -> None:
    """The base of a made balance, and the same with a residual that is a third larger, or hardly larger."""
    made = judged(Noise(encoder=1e-7), TRUE)
    at_floor = fitted(made, TRUE)
    teeth = Part("cogging", EVIDENCE, at_floor)
    found = Selection(at_floor, at_floor, (teeth,), (), (), {"cogging": ()})
    assert abs(made.excess(at_floor.residual)) < 0.1 and not has_a_gap(made, found)
    far = replace(found, base=replace(at_floor, residual=1.3 * at_floor.residual))
    assert has_a_gap(made, far)
    nothing = with_effects_of(found, found.base)
    assert nothing.best is at_floor and nothing.parts == () and nothing.dropped == (teeth,) and nothing.rivals == {}
