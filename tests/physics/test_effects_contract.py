"""What every effect must keep, whoever wrote it: finite, neutral at zero amplitude, compiled as in plain Python."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.physics.effects.effect import ALL_KINDS, ARGUMENTS, INPUTS, Effect, Outlook, Values
from linid.physics.effects.registry import EFFECTS, find_effect
from linid.physics.parameter import _ROTARY

DESIGN = {
    "cogging": "FORCE",
    "force_ripple": "FORCE",
    "phase_gain_imbalance": "DRIVE",
    "current_offset": "DRIVE",
    "asymmetric_friction": "FORCE",
    "constant_force": "FORCE",
    "cable_force": "FORCE",
    "position_dependent_friction": "FORCE",
    "quadratic_drag": "FORCE",
    "input_delay": "DRIVE",
    "force_saturation": "DRIVE",
    "thermal_derating": "DRIVE",
    "end_effect": "FORCE",
    "flexible_load": "FORCE",
    "encoder_periodic_error": "SENSOR",
    "external_disturbance": "FORCE",
    "friction_drift": "FORCE",
    "payload_change": "FORCE",
}
PHASES = Outlook(0.02, 0.42, 200.0, 1.5, 2.0, (4.0, 1.5, 2.0), (1, 2, 5), 1e-3, 12.0)
ONE_INPUT = Outlook(-0.3, 12.0, None, 30.0, 5.0, (10.0,), (1,), 1e-3, 10.0)
TURNING = replace(PHASES, axis="rotary")
STATES = ((0.0, 0.0), (1.0, 0.2), (-1.0, -0.2))
PLACES = (-0.4, 0.0, 0.07, 0.12, 0.19, 0.25, 0.31, 0.37, 0.45)
POINTS = tuple(product((0.0, 1.3), PLACES, (-2.0, -1e-6, 0.0, 0.5)))  # t, y, v

every_effect = pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)


def grid_of(effect: Effect) -> tuple[Values, ...]:
    """The starting values on a linear axis, or where it has none on a rotary one."""
    return effect.grid(PHASES) or effect.grid(TURNING)


def corners(effect: Effect) -> list[list[float]]:
    """All parameters at their defaults, each at its own bounds, and all at either bound."""
    base = [p.default for p in effect.parameters]
    out = [base, [p.lower for p in effect.parameters], [p.upper for p in effect.parameters]]
    for k, parameter in enumerate(effect.parameters):
        out += [[*base[:k], value, *base[k + 1 :]] for value in (parameter.lower, parameter.upper)]
    return out


def arguments(effect: Effect, name: str, point: tuple[float, float, float], states: tuple[float, float]) -> list[float]:
    known = dict(
        t=point[0],
        y=point[1],
        v=point[2],
        i_1=0.7,
        i_2=-0.4,
        i_3=-0.3,
        record=1.0,
        elapsed=5.0,
        s_1=states[0],
        s_2=states[1],
        h=1e-3,
        a=3.0,
        push=-40.0,
    )
    return [known[argument] for argument in effect.arguments_of(name)]


def cases(effect: Effect, parameters: list[list[float]]) -> list[tuple[str, list[float]]]:
    states = STATES if effect.advance is not None else STATES[:1]
    return [
        (name, arguments(effect, name, point, state) + list(values))
        for name in effect.terms
        for values in parameters
        for point in POINTS
        for state in states
    ]


def test_the_design_names_are_all_there_with_their_slots() -> None:
    slots = {effect.name: effect.slot for effect in EFFECTS}
    assert {name: slots.get(name) for name in DESIGN} == DESIGN
    assert len(slots) == len(EFFECTS) >= 22


@every_effect
def test_finite_at_all_bounds_and_compiled_as_in_python(effect: Effect) -> None:
    for name, values in cases(effect, corners(effect)):
        compiled = np.atleast_1d(effect.terms[name](*values))
        plain = np.atleast_1d(effect.terms[name].py_func(*values))
        assert np.all(np.isfinite(compiled)), (name, values)
        assert np.allclose(compiled, plain, rtol=1e-12, atol=1e-14), (name, values)
        if name in ("thrust", "friction", "level"):
            assert compiled[0] > 0.0, (name, values)


@every_effect
def test_absent_at_zero_amplitude(effect: Effect) -> None:
    """With all amplitudes 0 every term is neutral, whatever the other parameters are."""
    free = [p.name not in effect.amplitudes for p in effect.parameters]
    zeroed = [[x if keep else 0.0 for x, keep in zip(row, free, strict=True)] for row in corners(effect)]
    for name, values in cases(effect, zeroed):
        if name in ("initial", "advance"):
            continue
        found = effect.terms[name](*values)
        if name == "drive":
            assert np.allclose(found, values[3:6], rtol=1e-15, atol=0.0)
        else:
            neutral = {"field": values[1] if name == "field" else 0.0, "thrust": 1.0, "friction": 1.0, "level": 1.0}
            assert found == neutral.get(name, 0.0), (name, values)


@every_effect
def test_amplitudes_act(effect: Effect) -> None:
    """Each amplitude alone changes some term at some point."""
    start = {k: v for entry in grid_of(effect)[:1] for k, v in entry.items()}
    base = {p.name: start.get(p.name, p.default) for p in effect.parameters}
    if effect.name == "external_disturbance":
        for k in range(1, effect.parts + 1):
            base |= {f"disturbance_start_{k}": 0.0, f"disturbance_duration_{k}": 2.0, f"disturbance_recording_{k}": 1.0}
    for amplitude in effect.amplitudes:
        changed = base | {amplitude: 0.1 * max(p.upper for p in effect.parameters if p.name == amplitude)}
        before = [np.atleast_1d(effect.terms[n](*x)) for n, x in cases(effect, [list(base.values())])]
        after = [np.atleast_1d(effect.terms[n](*x)) for n, x in cases(effect, [list(changed.values())])]
        assert any(not np.array_equal(a, b) for a, b in zip(before, after, strict=True)), amplitude


@every_effect
def test_grid_gives_every_parameter_but_the_amplitudes(effect: Effect) -> None:
    bounds = {p.name: (p.lower, p.upper) for p in effect.parameters}
    for outlook, kind in ((PHASES, "sine"), (TURNING, "sine"), (ONE_INPUT, "force")):
        wanted = {p.name for p in effect.parameters_of(kind) if p in effect.part(1)} - set(effect.amplitudes)
        if kind == "force":  # all orders but the first are chosen by what they explain
            wanted -= set(effect.orders[1:])
        for entry in effect.grid(outlook):
            assert set(entry) == wanted
            assert all(bounds[name][0] <= value <= bounds[name][1] for name, value in entry.items()), entry
    for kind in ALL_KINDS:
        assert effect.applies(kind, TURNING) == (kind in effect.kinds)
        assert effect.applies(kind, PHASES) == (kind in effect.kinds and effect.name != "gravity")


@every_effect
def test_told_to_people(effect: Effect) -> None:
    units = {"1", "s", "Hz", "A", "1/A^2", *_ROTARY}
    for parameter in effect.parameters:
        assert parameter.unit in units and parameter.meaning and parameter.symbol
        metric = {"m", "N", "kg"} & set(parameter.unit.replace("/", " ").replace("^2", "").split())
        assert bool(metric) == (parameter.unit_on("rotary") != parameter.unit), parameter
    assert effect.physics.endswith(".") and "\n" not in effect.physics and len(effect.physics) < 121
    answers = effect.depends_on
    assert answers and len({frozenset(one) for one in answers}) == len(answers)
    assert all(set(one) <= set(ARGUMENTS) and len(set(one)) == len(one) for one in answers)
    assert effect.exposed_by and set(effect.confused_with) <= {other.name for other in EFFECTS} - {effect.name}


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.advance is not None], ids=lambda e: e.name)
@settings(max_examples=40, deadline=None)
@given(
    v=st.floats(-2.0, 2.0),
    current=st.floats(-3.0, 3.0),
    a=st.floats(-20.0, 20.0),
    split=st.floats(0.05, 0.95),
    h=st.floats(1e-6, 0.05),
    s_1=st.floats(-0.9, 0.9),
    s_2=st.floats(-0.5, 0.5),
)
def test_hidden_states_advance_exactly(effect: Effect, v, current, a, split, h, s_1, s_2) -> None:
    """Two part steps under the same conditions are one whole step."""
    start = grid_of(effect)[0]
    parameters = [start.get(p.name, 1e-4 if p.name in effect.amplitudes else p.default) for p in effect.parameters]
    rest = (0.0, 0.1, v, a, current, -0.5 * current, -0.5 * current, 1.0, 0.0)
    states = (s_1, s_2)[: effect.states]
    once = effect.advance(h, *rest, *states, *parameters)
    half = effect.advance(split * h, *rest, *states, *parameters)
    twice = effect.advance((1.0 - split) * h, *rest, *half, *parameters)
    assert np.allclose(once, twice, rtol=1e-9, atol=1e-9)
    assert effect.advance(0.0, *rest, *states, *parameters) == pytest.approx(states, abs=1e-15)


def values_of(effect: Effect, name: str, **known: float) -> list[float]:
    """A term at all corners of its parameters, for arguments that are changed so."""
    usual = dict(zip(effect.arguments_of(name), arguments(effect, name, (0.3, 0.1, 0.2), (0.3, 0.02)), strict=True))
    given = list((usual | {key: x for key, x in known.items() if key in usual}).values())
    grids = [[start.get(p.name, 0.5 * p.upper) for p in effect.parameters] for start in grid_of(effect)]
    return [x for values in grids for x in np.atleast_1d(getattr(effect, name)(*given, *values))]


@every_effect
def test_what_forces_and_hidden_states_hang_on_is_told(effect: Effect) -> None:
    """Derivatives ask for nothing else."""
    pushing = [name for name in ("thrust", "force") if name in effect.terms]
    by_speed = [values_of(effect, name, v=v) != values_of(effect, name) for name in pushing for v in (-0.7, 0.21, 0.0)]
    assert any(by_speed) == effect.pushes_by_speed
    for terms, told in ((pushing, effect.pushes_by_inputs), (("level", "load", "advance"), None)):
        mine = [name for name in terms if name in effect.terms]
        by_inputs = [
            values_of(effect, name, i_1=x, i_3=-x) != values_of(effect, name) for name in mine for x in (0.7, 3)
        ]
        assert any(by_inputs) == (effect.reads(mine, *INPUTS) if told is None else told)
    for argument in ("y", "v", "a"):
        changed = False
        if effect.advance is not None:
            tried = [values_of(effect, "advance", **{argument: x}) for x in (-0.7, 0.21, 4.0)]
            changed = any(one != values_of(effect, "advance") for one in tried)
        assert changed == effect.states_are_driven_by(argument), argument


def test_cogging_leaves_the_first_wave_of_a_revolution_to_gravity() -> None:
    """Of rotary axes without known poles whole orders from two on; as fine as the stroke tells, from about one wave."""
    for stroke, first, apart in ((60.0, 2, 1), (6.3, 2, 1), (3.2, 2, 1), (0.6, 10, 2), (0.05, 125, 31)):
        outlook = replace(ONE_INPUT, axis="rotary", stroke_low=-0.5 * stroke, stroke_high=0.5 * stroke)
        entries = find_effect("cogging").grid(outlook)
        orders = [entry["cogging_order_1"] for entry in entries]
        assert orders[0] == first and set(np.diff(orders)) == {apart} and max(orders) <= 2000.0
        assert {entry["cogging_wavenumber"] for entry in entries} == {1.0}
    linear = find_effect("cogging").grid(replace(ONE_INPUT, stroke_low=0.0, stroke_high=0.3))
    assert linear[0]["cogging_order_1"] * linear[0]["cogging_wavenumber"] == pytest.approx(2.0 * math.pi / 0.3)


def test_saturation_takes_the_space_vector() -> None:
    """The amplitude of balanced currents does not depend on their angle; a single input is its own."""
    from linid.physics.effects.force_saturation import squared_amplitude

    for angle in np.linspace(0.0, 6.0, 7):
        turned = [1.7 * math.cos(angle - k * 2.0 * math.pi / 3.0) for k in range(3)]
        assert squared_amplitude(*turned) == pytest.approx(1.7**2, rel=1e-12)
    assert squared_amplitude(-1.7, 0.0, 0.0) == 1.7 * 1.7


@every_effect
def test_a_search_range_holds_the_starting_values(effect: Effect) -> None:
    amplitudes = {*effect.amplitudes, *effect.preset}
    for entry in grid_of(effect):
        for parameter in (p for p in effect.parameters if p.name in entry and p.name not in amplitudes):
            low, high = effect.range_about(parameter, entry[parameter.name], entry)
            assert low <= entry[parameter.name] <= high, parameter.name


@given(st.floats(1e-3, 10.0), st.floats(0.0, 1.0), st.integers(1, 12))
def test_however_often_it_is_fitted_an_end_leaves_the_middle_its_thrust(stroke: float, share: float, fits: int) -> None:
    """Ends that meet take from all thrust: the force constant makes up for it, and input noise counts for more."""
    effect = find_effect("end_effect")
    values = {"end_low": -0.3 * stroke, "end_high": 0.7 * stroke}
    reaches = [p for p in effect.parameters if p.name.startswith("end_reach")]
    values |= {p.name: max(share, 1e-3) * stroke for p in reaches}
    for _ in range(fits):
        ranges = {p.name: effect.range_about(p, values[p.name], values) for p in reaches}
        assert all(low < high for low, high in ranges.values())
        values |= {name: high for name, (_, high) in ranges.items()}  # as far as that fit lets it
    free = values["end_high"] - values["end_reach_high"] - (values["end_low"] + values["end_reach_low"])
    assert free > 0.19 * stroke
