"""Own terms in the compiled simulation: against a slow reference, closed forms, their order; off means off."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.ahead import Ahead
from linid.physics.model import MEMORY_PLACE, VECTOR_SIZE, Model
from linid.physics.own_terms import layout
from linid.physics.own_terms.memory import memory_along
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.physics.own_terms.plain_interpreter import Interpreter
from tests.simulation.axis_with_effects import AXIS, simulate, start_of_run, synchronous_run
from tests.simulation.test_against_reference import FRICTION

VALUES = FRICTION | {"force_constant": 45.0}
T = np.arange(0.0, 1.2, 1e-3)
CURRENT = 0.25 * np.sin(2 * np.pi * 1.5 * T) + 0.05
DRIVE = Recording("drive", T, np.zeros_like(T), drive_input=CURRENT, number=1, elapsed=3.0)
START = (0.1, 0.0, 0.0)
NAN = math.nan


def run(text: str, values: dict[str, float], substeps: int = 8, **settings) -> np.ndarray:
    """Positions (n,) in m of the driven axis with one own term."""
    model = Model("force", (text,) if text else ())
    simulator = Simulator(model, pack_inputs([settings.pop("recording", DRIVE)]), substeps, **settings)
    vector = model.vector(VALUES | values)[None, :]
    return simulator.run(vector, whole_recordings(simulator.inputs), np.array([[START]]))[0][0]


def reference(force: Interpreter | None, level: Interpreter | None, memory: bool = False) -> np.ndarray:
    """Positions (n,) in m by scipy: LuGre friction (eqs. 40-42) with the formulas' own forces and levels in N.

    memory: whether the formulas ask for travel and time since the reversals, which are then found as events.
    """
    g, current = VALUES, CubicSpline(T, CURRENT)
    turn = [START[0], 0.0]

    def rates(time, state):
        y, v, w = state
        push = 45.0 * float(current(time))
        seen = {"t": time, "T": 3.0 + time, "y": y, "v": v, "F": push, "rest": 0.0}
        seen |= {"travel": abs(y - turn[0]), "since_reversal": time - turn[1]}
        resistance = g["coulomb_force"] + (g["static_force"] - g["coulomb_force"]) * math.exp(
            -((v / g["stribeck_velocity"]) ** 2)
        )
        slides = 1.0 - math.exp(-((v / g["stribeck_velocity"]) ** 2))
        held = min(max(push, -resistance), resistance)
        steady = slides * math.copysign(resistance, v) + (1.0 - slides) * held + g["viscous_friction"] * v
        seen["stribeck"] = resistance / g["coulomb_force"]
        seen["acceleration"] = (push - steady) / g["mass"]
        resistance += level(seen) if level else 0.0
        w_rate = v - g["bristle_stiffness"] * abs(v) * w / resistance
        total = push - g["bristle_stiffness"] * w - g["bristle_damping"] * w_rate - g["viscous_friction"] * v
        return [v, (total + (force(seen) if force else 0.0)) / g["mass"], w_rate]

    def reversal(time, state):
        return state[1]

    reversal.terminal = memory
    out, t, state, fresh = np.empty(T.size), 0.0, np.array(START), True
    while True:
        at = T[(t < T) | (fresh & (T == 0.0))] if fresh else T[t < T]
        options = {"method": "LSODA", "rtol": 1e-10, "atol": [1e-12, 1e-11, 1e-14], "max_step": 2e-3}
        events = reversal if memory and not fresh else None
        end = T[-1] if not (memory and fresh) else T[5]  # past the start, where the speed is zero too
        done = solve_ivp(rates, (t, end), state, t_eval=at[at <= end], events=events, **options)
        out[np.searchsorted(T, done.t)] = done.y[0]
        if done.status == 0 and end == T[-1]:
            return out
        if done.status == 1:
            t, state = float(done.t_events[0][0]), done.y_events[0][0]
            turn[:] = [float(state[0]), t]
            step = solve_ivp(rates, (t, t + 1e-4), state, **options)  # past the event
            t, state = float(step.t[-1]), step.y[:, -1]
        else:
            t, state = end, done.y[:, -1]
        fresh = False


CASES = {
    "drag": ("-c * v * abs(v) ** 1.3", None, {"c": 9.0}, []),
    "place": ("3 * spline(y, -0.1, 0.4, 6)", None, {}, [0.5, -1.0, 1.0, 0.7, -1.2, 0.4]),
    "ripple": ("periodic(y, 0.06, 5) * F", None, {}, [0.1, -0.1, 0.05, 0.1, -0.06]),
    "product": ("c * tanh(F) * cos(40 * y) + b * sin(9 * T)", None, {"c": 1.5, "b": 1.0}, []),
    "load": (None, "c * abs(F)", {"c": 0.2}, []),
    "friction_by_place": (None, "spline(y, -0.1, 0.4, 6)", {}, [0.5, -1.0, 1.0, 0.7, -1.2, 0.4]),
    "friction_by_speed": (None, "c * exp(-abs(v) / 0.3)", {"c": 0.8}, []),
    "loose_mass": ("-c * acceleration * abs(acceleration)", None, {"c": 0.005}, []),
    "friction_by_acceleration": (None, "c * abs(acceleration)", {"c": 0.05}, []),
    "pressed_by_place": (None, "c * stribeck * (1 + cos(30 * y))", {"c": 0.8}, []),
    "both": ("-b * y", "c * F ** 2", {"b": 6.0, "c": 0.02}, []),
}


def term_of(name: str) -> tuple[str, dict[str, float]]:
    """The text of a case, with its level of friction as a force against the motion, and the parameters' values."""
    force, level, values, coefficients = CASES[name]
    text = f"e: {force or ''}" + (f" - ({level}) * sign(v)" if level else "")
    own = {f"e_{k}": x for k, x in values.items()} | {f"e_{k}": x for k, x in enumerate(coefficients, 1)}
    return text, own | ({"e_scale": 1.0} if name == "place" and "e_scale" in text else {})


@pytest.mark.parametrize("name", CASES)
def test_against_a_slow_reference(name: str) -> None:
    """The term moves the axis by far more than both simulations differ, and less so with smaller steps."""
    force, level, values, coefficients = CASES[name]
    text, own = term_of(name)
    parts = [None if part is None else Interpreter(part, values, coefficients) for part in (force, level)]
    wanted = reference(*parts)
    moved = np.sqrt(np.mean((run("", {}) - wanted) ** 2))
    error = np.sqrt(np.mean((run(text, own, 16) - wanted) ** 2))
    assert moved > 1e-3 and error < 1e-7, (moved, error)
    assert np.sqrt(np.mean((run(text, own, 2) - wanted) ** 2)) < 3e-6


@pytest.mark.parametrize("name", CASES)
def test_order(name: str) -> None:
    text, own = term_of(name)
    fine = run(text, own, 128)
    # What holds steady friction bends about the Stribeck velocity: there order shows in finer steps.
    bends = "acceleration" in text or "stribeck" in text
    counts = np.array([4, 8, 16] if bends else [2, 4, 8, 16])
    errors = [np.sqrt(np.mean((run(text, own, int(n)) - fine) ** 2)) for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(np.maximum(errors, 1e-13)), 1)[0]
    print(name, slope, errors)
    assert slope >= 1.8, (slope, errors)


@pytest.mark.parametrize("formula", ["c * travel * exp(-travel / 0.02)", "c * exp(-since_reversal / 0.1)"])
def test_what_an_axis_remembers_against_events_of_the_reference(formula: str) -> None:
    level = Interpreter(formula, {"c": 1.0 if "since" in formula else 60.0})
    wanted = reference(None, level, memory=True)
    values = {"e_c": 1.0 if "since" in formula else 60.0}
    moved = np.sqrt(np.mean((run("", {}) - wanted) ** 2))
    error = np.sqrt(np.mean((run(f"e: -{formula} * sign(v)", values, 16) - wanted) ** 2))
    print(formula, moved, error)
    # A reversal is seen once the axis is PLAY behind it, to the step.
    assert moved > 1e-3 and error < 0.02 * moved, (moved, error)


def test_a_spring_keeps_the_energy() -> None:
    """Next to no friction: k (y - y_0)^2/2 + m v^2/2 stays, and the period is 2 pi sqrt(m/k)."""
    text = "spring: -k * (y - y_0); y_0 in [0, 1]"
    light = {"coulomb_force": 1e-9, "static_force": 1e-9, "viscous_friction": 0.0, "bristle_damping": 0.0}
    model = Model("friction", (text,))
    wheel = Recording("wheel", T, np.zeros_like(T), kind="free_wheel")
    simulator = Simulator(model, pack_inputs([wheel]), 4)
    vector = model.vector(VALUES | light | {"bristle_stiffness": 1e-3, "spring_k": 80.0, "spring_y_0": 0.2})
    start = np.array([[(0.3, 0.0, 0.0)]])
    y, v, _ = simulator.run(vector[None, :], whole_recordings(simulator.inputs), start, velocity=True)
    energy = 40.0 * (y[0] - 0.2) ** 2 + 0.5 * VALUES["mass"] * v[0] ** 2
    assert energy == pytest.approx(np.full(T.size, 40.0 * 0.01), rel=1e-5)
    assert y[0] == pytest.approx(0.2 + 0.1 * np.cos(math.sqrt(80.0 / VALUES["mass"]) * T), abs=1e-5)


@pytest.mark.parametrize(
    ("library", "values", "text", "own"),
    [
        ("quadratic_drag", {"drag_coefficient": 6.0, "drag_power": 2.0}, "d: -c * v * abs(v)", {"d_c": 6.0}),
        ("load_dependent_friction", {"load_friction": 0.15}, "m: -c * abs(F) * sign(v)", {"m_c": 0.15}),
        ("constant_force", {"constant_force": 1.2}, "f: c", {"f_c": 1.2}),
    ],
)
def test_effects_of_the_library_written_as_formulas(
    library: str, values: dict[str, float], text: str, own: dict[str, float]
) -> None:
    drive, start = synchronous_run(), start_of_run()
    wanted = simulate((library,), drive, start, values=values)
    assert np.max(np.abs(simulate((text,), drive, start, values=own) - wanted)) < 1e-12
    assert np.max(np.abs(simulate((), drive, start) - wanted)) > 1e-4


def test_a_specialised_kernel_gives_the_same_bits() -> None:
    text, own = term_of("both")
    assert np.array_equal(run(text, own, 2), run(text, own, 2, specialised=True))


def test_absent_terms_change_nothing() -> None:
    """With amplitudes 0 the axis moves as without; without own terms the vector is as long as ever."""
    assert np.max(np.abs(run("e: c * F * v - b * sign(v)", {}) - run("", {}))) < 1e-9
    assert Model("force").size == Model("force", ("cogging",)).size == VECTOR_SIZE
    assert Model("force", ("e: c * v",)).vector({}).size == VECTOR_SIZE + layout.SIZE


def test_no_own_term_takes_all_friction_away() -> None:
    """A level far below zero leaves a twentieth of Coulomb's force: the axis never gains energy from its friction."""
    t = np.arange(0.0, 0.3, 1e-3)
    wheel = Recording("wheel", t, np.zeros_like(t), kind="free_wheel")
    model = Model("friction", ("e: c * sign(v)",))
    simulator = Simulator(model, pack_inputs([wheel]), 4)
    start = np.array([[(0.0, 0.5, NAN)]])
    vector = model.vector(VALUES | {"e_c": 100.0, "viscous_friction": 0.0, "static_force": 1.72})
    _, v, _ = simulator.run(vector[None, :], whole_recordings(simulator.inputs), start, velocity=True)
    assert v[0] == pytest.approx(0.5 - 0.05 * 1.72 / VALUES["mass"] * t, abs=1e-6)


@pytest.mark.parametrize("formula", ["c * log(v)", "c / (y - y)", "-c * log(-abs(v)) * sign(v)", "exp(9e9 * c)"])
def test_what_is_no_number_costs_its_candidate_alone(formula: str) -> None:
    text = f"e: {formula}" + ("; c in [0, 3]" if "exp" in formula else "")
    model = Model("force", (text,))
    simulator = Simulator(model, pack_inputs([DRIVE]), 2)
    good = model.vector(VALUES | {"e_c": 0.0, "e_scale": 0.0})
    bad = model.vector(VALUES | {"e_c": 1.0, "e_scale": 1.0})
    y, _, _ = simulator.run(np.array([bad, bad]), whole_recordings(simulator.inputs), np.array([[START]] * 2))
    assert np.isnan(y[:, -1]).all()
    plain = Model("force", ("e: c * v",))
    y, _, _ = Simulator(plain, simulator.inputs, 2).run(
        np.array([plain.vector(VALUES)]), whole_recordings(simulator.inputs), np.array([[START]])
    )
    assert np.isfinite(y).all() and good.size == bad.size


@pytest.mark.parametrize("name", CASES)
def test_along_the_motion_the_balance_closes(name: str) -> None:
    """The acceleration that the model says along its own motion is that motion's second difference."""
    text, own = term_of(name)
    y = run(text, own, 16)
    recording = Recording("drive", T, y, drive_input=CURRENT, number=1, elapsed=3.0)
    with_term, without = Model("force", (text,)), Model("force")
    vector = with_term.vector(VALUES | own)[None, :]
    errors = Acceleration(with_term, (recording,), 1).residuals(vector, np.zeros((1, 0)))
    lacking = Acceleration(without, (recording,), 1).residuals(without.vector(VALUES)[None, :], np.zeros((1, 0)))
    usual = [float(np.median(np.abs(x))) for x in (errors, lacking)]
    print(name, usual)
    assert usual[0] < 0.02 * usual[1], usual


def test_the_memory_along_a_motion() -> None:
    """Moves to and fro with a rest, noise of a micrometre on all: the kernel keeps what the plain function says."""
    t = np.arange(0.0, 4.0, 1e-3)
    path = 0.05 * np.clip(1.5 * np.sin(2 * np.pi * 0.5 * t), -1.0, 1.0)
    y = path + 1e-6 * np.random.default_rng(2).standard_normal(t.size)
    model = Model("friction", ("e: c * travel * rest * slid * since_reversal",))
    assert model.states == tuple(range(MEMORY_PLACE, MEMORY_PLACE + len(layout.MEMORY)))
    recording = Recording("wheel", t, y, kind="free_wheel")
    simulator = Simulator(model, pack_inputs([recording]))
    v = np.gradient(y, t)
    found = simulator.along(
        model.vector(VALUES)[None, :], y, v, np.zeros(t.size, dtype=bool), np.full((1, 1), 1e-4)
    ).states[0]
    wanted = memory_along(t, y)
    names = {name: k for k, name in enumerate(layout.MEMORY)}
    assert np.abs(y - found[:, names["turn"]]) == pytest.approx(wanted["travel"], abs=1e-9)
    assert found[:, names["since"]] == pytest.approx(wanted["since_reversal"], abs=1e-9)
    rests = np.abs(found[:, names["rest"]] - wanted["rest"]) < 1e-9
    assert np.mean(rests) > 0.999  # one sums the time up, and may see LEAST_REST a sample earlier
    # 0.5 Hz: it turns every second, at the end of rests of about half a second.
    rest = 1.0 - 2.0 * math.asin(1.0 / 1.5) / math.pi
    assert wanted["rest"][-1] == pytest.approx(rest, abs=0.01)
    assert np.mean(np.abs(found[:, names["slid"]] - wanted["slid"]) < 1e-9) > 0.999
    # Every move is 0.1 m long and follows a rest; the last step of PLAY is not counted before it is whole.
    left = np.flatnonzero(np.diff(wanted["slid"]) < 0.0)
    assert left.size == 4 and wanted["slid"][left[1:]] == pytest.approx(0.1, abs=2.5e-5)
    moving = np.abs(np.gradient(path, t)) > 0.05
    late = moving & (t > 1.0)
    turned = 0.05 * np.where(np.gradient(path, t) > 0.0, -1.0, 1.0)
    assert wanted["travel"][late] == pytest.approx(np.abs(path - turned)[late], abs=1e-5)


def test_a_window_goes_on_with_what_was_remembered() -> None:
    """Predictions that start within a recording take the memory from the motion before."""
    text, own = "e: -c * exp(-travel / 0.03) * sign(v)", {"e_c": 2.0}
    y = run(text, own, 16)
    recording = Recording("drive", T, y, drive_input=CURRENT, number=1, elapsed=3.0)
    model = Model("force", (text,))
    vector = model.vector(VALUES | own)[None, :]
    errors = Ahead(model, (recording,), 4, 1).residuals(vector, np.zeros((1, 0)))
    forgetful = Model("force")
    lacking = Ahead(forgetful, (recording,), 4, 1).residuals(forgetful.vector(VALUES)[None, :], np.zeros((1, 0)))
    assert np.sqrt(np.nanmean(errors**2)) < 0.03 * np.sqrt(np.nanmean(lacking**2))


def test_the_motor_force_is_that_of_the_phases() -> None:
    """F of a synchronous motor is its thrust, with what effects on the drive make of it."""
    drive, start = synchronous_run(), start_of_run()
    half = {"force_constant": 0.5 * AXIS["force_constant"]}
    wanted = simulate((), drive, start, values=half)
    assert np.max(np.abs(simulate(("e: -c * F",), drive, start, values={"e_c": 0.5}) - wanted)) < 1e-9
