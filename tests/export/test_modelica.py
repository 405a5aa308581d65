"""The exported Modelica package, parsed by pymoca and run from its tree, against the simulation that it comes from."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from linid.export.target import Exported
from linid.export.targets.modelica.target import TARGET, _name, modelica_unit
from linid.export.translate.tree import (
    Break,
    Continue,
    For,
    Function,
    If,
    Let,
    Number,
    Operation,
    Return,
    Variable,
    While,
    without_continue,
)
from linid.export.translate.writers.modelica import ModelicaWriter, quoted
from linid.physics.effects.registry import EFFECTS
from linid.physics.laws.registry import LAWS
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.export.axis import EIGHT, OWN, OWN_VALUES, exported, result_of, simulated
from tests.export.modelica_package import Package, SampledBlock, attribute
from tests.simulation.axis_with_effects import NAMES, start_of_run, synchronous_run

SAME = 1e-11  # m: rounding, as reversals carry it on
UNKNOWN = 1e90
PLACE = float(start_of_run()[0])
# A number, a unit without brackets, and one below: `unit_expression` of the Modelica specification, section 19.1.
UNIT = re.compile(r"1|((1|[A-Za-z]+\d*(\.[A-Za-z]+\d*)*)(/([A-Za-z]+\d*|\([A-Za-z]+\d*(\.[A-Za-z]+\d*)+\)))?)")


def package_of(model: Exported) -> Package:
    """The exported package, parsed."""
    ((name, content),) = TARGET.files(model).items()
    assert name == "axis_model.mo"
    return Package(content.decode())


def arrays(block: SampledBlock) -> list[Any]:
    """What the package's functions take first."""
    return [block.now[name] for name in ("parameters", "own_parameters") if name in block.now]


def recorded(model: Exported, recording: Recording, coefficients: np.ndarray, stepping: bool) -> np.ndarray:
    """Outputs (n, 4) of the package over a whole recording."""
    package = package_of(model)
    dt = float(recording.t[-1] - recording.t[0]) / (recording.t.size - 1)
    start, run = [PLACE, 0.0, UNKNOWN], [float(recording.number), float(recording.elapsed), 0.0]
    given = (coefficients.ravel().tolist(), float(recording.t[0]), dt, model.result.substeps, start, run, stepping)
    (out,) = package["simulate"](*arrays(SampledBlock(package)), *given)
    return np.array(out)


@pytest.mark.parametrize(
    ("effects", "more"),
    [
        (NAMES, {}),
        ((*EIGHT, "input_delay", OWN), {"values": OWN_VALUES}),
        *(((), {"law": law}) for law in LAWS),
        ((), {"kind": "theta", "values": {"nome": 0.95, "winding_length": 0.7}}),
    ],
    ids=["all effects", "ten effects and an own term", *LAWS, "theta"],
)
def test_a_recording_runs_as_linid_runs_it(effects: tuple[str, ...], more: dict[str, Any]) -> None:
    model, recording = exported(effects, **more), synchronous_run()
    y, v, inputs = simulated(model, recording)
    found = recorded(model, recording, inputs.coefficients, bool(inputs.steps[0]))
    assert np.ptp(y) > 0.05 and np.count_nonzero(np.diff(np.sign(v))) > 2  # m: it moves, and reverses
    assert np.abs(found[:, 0] - y).max() < SAME and np.abs(found[:, 1] - v).max() < 1e3 * SAME


def test_one_input_runs_as_linid_runs_it_with_friction_and_thrust_in_balance() -> None:
    t = np.arange(0.0, 0.6, 1e-3)
    drive = np.where(t < 0.2, 0.3, 2.5) * np.sin(14.0 * t)  # first below breakaway
    recording = Recording("one", t, np.zeros_like(t), drive_input=drive)
    model = Exported(result_of((), kind="force", values={"force_constant": 4.0}, substeps=4), "axis_model")
    inputs = pack_inputs([recording])
    start = np.array([[(PLACE, 0.0, np.nan)]])
    y = Simulator(model.model, inputs, 4).run(model.vector[None, :], whole_recordings(inputs), start)[0][0]
    found = recorded(model, recording, inputs.coefficients, bool(inputs.steps[0]))
    breakaway = model.values["static_force"] / model.values["bristle_stiffness"]
    assert np.ptp(y[:150]) < breakaway and np.ptp(y) > 0.01  # m: presliding, then motion
    assert np.abs(found[:, 0] - y).max() < SAME
    settled = np.abs(t - 0.2) > 3e-3  # s: at a step the input before it is seen
    assert np.allclose(found[settled, 3], 4.0 * drive[settled], atol=1e-9)
    force = model.values["mass"] * np.gradient(found[:, 1], t)
    sliding = np.abs(found[:, 1]) > 0.05  # m/s, where the acceleration is smooth from sample to sample
    missing = (found[:, 3] - found[:, 2] - force)[sliding]
    assert sliding.sum() > 100 and np.sqrt(np.mean(missing**2)) < 0.01 * np.sqrt(np.mean(drive[sliding] ** 2)) * 4.0


def lines(inputs: np.ndarray, dt: float, order: int) -> np.ndarray:
    """Coefficients (n - 1, 4, 4) of inputs (c, n) that go on after each sample along what was known then."""
    out = np.zeros((inputs.shape[1] - 1, 4, 4))
    for n in range(out.shape[0]):
        bend = min(order, n)
        powers = np.polynomial.polynomial.polyfit(dt * np.arange(-bend, 1), inputs[:, n - bend : n + 1].T, bend)
        out[n, : len(inputs), : bend + 1] = powers.T
    return out


@pytest.mark.parametrize(("order", "effects"), [(0, (*EIGHT, "input_delay")), (1, EIGHT), (2, ("input_delay",))])
def test_the_block_samples_as_linid_runs_such_inputs(order: int, effects: tuple[str, ...]) -> None:
    recording = synchronous_run(0.3)
    dt, model = 1e-3, exported(effects)
    model = replace(model, step=dt / model.result.substeps)
    assert recording.phase_currents is not None
    inputs = pack_inputs([recording])
    given = lines(recording.phase_currents, dt, order)
    inputs = inputs._replace(coefficients=given, steps=np.array([True]), t_starts=np.zeros(1), dts=np.array([dt]))
    start = np.array([[(PLACE, 0.0, np.nan)]])
    y, v, _ = Simulator(model.model, inputs, 2).run(
        model.vector[None, :], whole_recordings(inputs), start, velocity=True
    )
    more = {"recording": float(recording.number), "elapsed": recording.elapsed, "start_position": PLACE}
    block = SampledBlock(package_of(model), input_order=order, **more)
    assert block.now["period"] == dt
    rows = [block.begin(*recording.phase_currents[:, 0])]
    found = [(rows[0]["position"], rows[0]["speed"])]
    for currents in recording.phase_currents.T[1:]:
        now = block.sample(*currents)
        found.append((now["position"], now["speed"]))
    assert np.ptp(y) > 0.02  # m
    assert np.abs(np.array(found) - np.stack([y[0], v[0]], 1)).max(0)[0] < 1e3 * SAME  # instants are added up


def test_every_parameter_has_its_value_its_unit_and_its_meaning() -> None:
    model = exported((*NAMES, OWN), values=OWN_VALUES)
    package = package_of(model)
    symbols, block = package.tree.classes["Axis"].symbols, SampledBlock(package)
    for parameter in model.model.parameters:
        symbol = symbols[parameter.name]
        assert block.now[parameter.name] == model.values[parameter.name]
        assert attribute(symbol, "unit") == modelica_unit(parameter.unit)
        assert symbol.comment == (parameter.meaning or parameter.name)
    assert [n for n, s in symbols.items() if "output" in s.prefixes] == [
        "position",
        "speed",
        "friction_force",
        "thrust",
    ]
    assert [n for n, s in symbols.items() if "input" in s.prefixes] == ["current_u", "current_v", "current_w"]
    block = SampledBlock(package, mass=3.0)
    assert block.now["parameters"][package.constants["P_mass"] - 1] == 3.0


def test_units_are_those_of_modelica() -> None:
    assert [modelica_unit(u) for u in ("N s^2/m^2", "N m s/rad", "kg m^2", "1/A^2", "N/(m s)", "1")] == [
        "N.s2/m2",
        "N.m.s/rad",
        "kg.m2",
        "1/A2",
        "N/(m.s)",
        "1",
    ]
    parameters = [p for kind in ("sine", "theta", "force") for p in Model(kind).parameters]
    parameters += [p for effect in EFFECTS for p in effect.parameters]
    units = {modelica_unit(p.unit_on(axis)) for p in parameters for axis in ("linear", "rotary")}
    assert [one for one in units if not UNIT.fullmatch(one)] == []


X = Variable("x", "float")


@pytest.mark.parametrize(
    ("node", "text"),
    [
        (Operation("*", (X, Operation("neg", (X,), "float")), "float"), "x * (-x)"),
        (Operation("+", (X, Number(-2.0, "float")), "float"), "x + (-2.0)"),
        (Operation("-", (Operation("neg", (X,), "float"), X), "float"), "(-x) - x"),
        (Operation("<", (X, Number(-2.0, "float")), "bool"), "x < -2.0"),
        (Operation("**", (X, Operation("neg", (X,), "float")), "float"), "((x) ^ (-x))"),
        (Operation("!=", (X, Number(float("inf"), "float")), "bool"), "x <> infinite"),
        (Operation("select", (Operation("isnan", (X,), "bool"), X, X), "float"), "(if undefined(x) then x else x)"),
        (Operation("//", (Variable("k", "int"), Number(3, "int")), "int"), "integer((k) / (3))"),
        (Variable("der", "float"), "der_"),
    ],
)
def test_signs_and_words_stand_where_modelica_takes_them(node: Any, text: str) -> None:
    writer = ModelicaWriter()
    writer.program([])
    assert writer.expression(node) == text


@pytest.mark.parametrize(
    ("name", "arguments", "wanted"),
    [
        ("copysign", (2.0, -3.0), -2.0),
        ("copysign", (-2.0, 3.0), 2.0),
        ("expm1", (1e-12,), np.expm1(1e-12)),
        ("expm1", (-3.0,), np.expm1(-3.0)),
        ("expm1", (-900.0,), -1.0),
        ("truncated", (-2.7,), -2),
        ("truncated", (2.7,), 2),
        ("nearest", (2.5,), 2),
        ("nearest", (3.5,), 4),
        ("nearest", (-2.5,), -2),
        ("nearest", (-1.2,), -1),
        ("doubled", (3, 4), 48),
        ("undefined", (UNKNOWN,), True),
        ("undefined", (float("nan"),), True),
        ("undefined", (-1e6,), False),
        ("nth", ([1.0, 5.0], 2), 5.0),
    ],
)
def test_functions_that_modelica_has_not_are_those_of_the_library(name: str, arguments: Any, wanted: Any) -> None:
    found = package_of(exported())[f"Core.{name}"](*arguments)[0]
    assert type(found) is type(wanted) or isinstance(found, float)
    assert found == pytest.approx(wanted, rel=4e-16, abs=0.0)


def test_loops_mean_the_same_without_continue() -> None:
    def when(value: float, *then: Any) -> If:
        return If(Operation("==", (X, Number(value, "float")), "bool"), then)

    last = Let("y", X)
    turn = (Let("x", X), when(1.0, Let("y", X), Continue()), when(2.0, Break()), when(3.0, when(4.0, Continue()), last))
    (loop,) = without_continue((While(Number(True, "bool"), (*turn, Return((X,)))),))
    assert isinstance(loop, While)
    first, branch = loop.body
    assert first == Let("x", X) and isinstance(branch, If)
    assert branch.then == (Let("y", X),)
    stop, nested = branch.otherwise
    assert stop == when(2.0, Break()) and isinstance(nested, If)
    assert nested.then == (If(when(4.0).condition, (), (last, Return((X,)))),)
    assert nested.otherwise == (Return((X,)),)
    inner = For("k", Number(0, "int"), Number(2, "int"), (when(1.0, Continue()), last))
    assert without_continue((inner,)) == (replace(inner, body=(If(when(1.0).condition, (), (last,)),)),)


def test_functions_and_parameters_take_no_name_that_is_taken() -> None:
    writer = ModelicaWriter()
    function = Function("sample", (X,), ("float",), (Return((X,)),), {}, frozenset(), frozenset())
    text = writer.program([function])
    assert "function sample_of\n" in text
    assert text.endswith("\n".join(("algorithm", "  result_1 := x;", "end sample_of;")))
    assert writer.call(function, ["1.0"]) == "sample_of(1.0)"
    assert [_name(writer, one) for one in ("mass", "record", "period")] == ["mass", "record_", "period_"]


def test_texts_are_strings_of_modelica() -> None:
    assert quoted('a "b" \\ c') == '"a \\"b\\" \\\\ c"'
