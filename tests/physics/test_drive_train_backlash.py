"""Play in the drive train: its contacts against closed forms, an integration with events, and the energy at hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from linid.physics.effects import drive_train_backlash, flexible_load
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings

GAP, FREQUENCY = 2e-3, 40.0
OMEGA = 2.0 * math.pi * FREQUENCY
# An axis that hardly rubs, so that momentum and energy are those of two bodies.
GLIDING = {
    "coulomb_force": 1e-9,
    "static_force": 1e-9,
    "stribeck_velocity": 1e-3,
    "stribeck_exponent": 2.0,
    "bristle_stiffness": 1e-6,
    "bristle_damping": 0.0,
    "viscous_friction": 0.0,
    "mass": 1.0,
    "force_constant": 1.0,
}


def advance(
    h: float, s_1: float, s_2: float, a: float = 0.0, damping: float = 0.0, gap: float = GAP
) -> tuple[float, float]:
    return drive_train_backlash.advance(
        h, 0.0, 0.0, 0.0, a, 0.0, 0.0, 0.0, 1.0, 0.0, s_1, s_2, 1.0, gap, FREQUENCY, damping
    )


def contact(s_1: float, s_2: float, gap: float, omega: float, damping: float) -> float:
    """Force per mass on the motor, written once more."""
    depth = abs(s_1) - 0.5 * gap
    if depth <= 0.0:
        return 0.0
    side = math.copysign(1.0, s_1)
    return side * max(omega**2 * depth + 2.0 * damping * omega * side * s_2, 0.0)


def energy(s_1: float, s_2: float, gap: float = GAP) -> float:
    return 0.5 * s_2**2 + 0.5 * OMEGA**2 * max(abs(s_1) - 0.5 * gap, 0.0) ** 2


def with_play(values: dict[str, float]) -> dict[str, float]:
    return {f"backlash_load_{name}": value for name, value in values.items()}


def run(
    effect: str, values: dict[str, float], drive: np.ndarray, start: list[float], substeps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Position (n,) m and speed (n,) m/s of the gliding axis at 1 kHz."""
    t = 1e-3 * np.arange(drive.size)
    model = Model("force", (effect,))
    simulator = Simulator(model, pack_inputs([Recording("r", t, 0.0 * t, drive_input=drive, number=1)]), substeps)
    vector = model.vector(GLIDING | values)[None, :]
    y, v, _ = simulator.run(vector, whole_recordings(simulator.inputs), np.array([[start]]), velocity=True)
    return y[0], v[0]


def test_an_elastic_load_bounces_for_ever() -> None:
    """Two flights through the gap and two half swings of the contact springs later all is as it was."""
    speed = 0.3
    period = 2.0 * GAP / speed + 2.0 * math.pi / OMEGA
    for share in (0.0, 0.1, 0.5, 0.9):
        s_1, s_2 = advance(share * period, 0.0, speed)
        assert advance(25.0 * period, s_1, s_2) == pytest.approx((s_1, s_2), abs=1e-10)
        assert energy(s_1, s_2) == pytest.approx(0.5 * speed**2, rel=1e-12)
    assert advance(0.5 * GAP / speed + 0.5 * math.pi / OMEGA, 0.0, speed)[0] == pytest.approx(
        0.5 * GAP + speed / OMEGA, rel=1e-12
    )


def test_a_damped_contact_gives_back_what_theory_says() -> None:
    """It lets go when its push is gone, not at depth 0: the speed left is exp(-zeta/root * angle) of the first one
    (linear spring and damper without pull: Schwager and Poeschel 2007, Granular Matter 9, 465)."""
    for damping in (0.05, 0.3, 0.6):
        root = math.sqrt(1.0 - damping**2)
        # Push in the swing sin(root omega t) vanishes where its cosine part outweighs it.
        angle = math.atan2(2.0 * damping * root, 2.0 * damping**2 - 1.0)
        angle = angle if angle > 0.0 else angle + math.pi
        left = math.exp(-damping / root * angle)
        s_2 = advance(0.5 * math.pi / OMEGA * 1.999 + 1e-3, 0.5 * GAP, 0.2, damping=damping)[1]
        assert s_2 == pytest.approx(-0.2 * left, rel=1e-9)


@pytest.mark.parametrize("damping", [0.0, 0.02, 0.3, 0.9])
def test_contacts_create_no_energy(damping: float) -> None:
    generator = np.random.default_rng(1)
    for _ in range(50):
        s_1, s_2 = generator.uniform(-1.5, 1.5) * GAP, generator.uniform(-0.5, 0.5)
        before = energy(s_1, s_2)
        for _ in range(60):
            s_1, s_2 = advance(generator.uniform(0.0, 0.01), s_1, s_2, damping=damping)
            after = energy(s_1, s_2)
            assert after <= before * (1.0 + 1e-12)
            before = after


def test_a_carried_load_comes_to_rest_on_its_side() -> None:
    """Under a lasting acceleration it leans on the side behind it, as deep as the spring must push."""
    for a in (3.0, -7.0):
        s_1, s_2 = advance(60.0, 0.3 * GAP, 0.1, a=a, damping=0.1)
        assert s_1 == pytest.approx(-math.copysign(0.5 * GAP, a) - a / OMEGA**2, rel=1e-9)
        assert s_2 == pytest.approx(0.0, abs=1e-9)


def test_without_gap_it_is_a_flexible_load() -> None:
    """As the gap vanishes; the damper that cannot pull leaves a difference that vanishes with the damping."""
    for damping, gap, allowed in ((1e-9, 0.0, 1e-6), (1e-9, 1e-7, 2e-2), (1e-3, 0.0, 5e-3)):
        here = there = (3e-4, -0.02)
        for k in range(200):
            a = 3.0 * math.sin(0.3 * k)
            here = advance(1e-3, *here, a=a, damping=damping, gap=gap)
            there = flexible_load.advance(
                1e-3, 0.0, 0.0, 0.0, a, 0.0, 0.0, 0.0, 1.0, 0.0, *there, 1.0, FREQUENCY, damping
            )
            scale = math.hypot(OMEGA * 3e-4, 0.02)
            assert math.hypot(OMEGA * (here[0] - there[0]), here[1] - there[1]) < allowed * scale
    drive = 3.0 * np.sin(40.0 * 1e-3 * np.arange(600)) + 2.0
    start = [0.0, 0.0, 0.0, 0.0, 0.0]
    play = with_play({"mass": 0.4, "gap": 1e-7, "frequency": FREQUENCY, "damping": 1e-3})
    bound = {"load_mass": 0.4, "load_frequency": FREQUENCY, "load_damping": 1e-3}
    y, swinging = run("drive_train_backlash", play, drive, start, 4)[0], run("flexible_load", bound, drive, start, 4)[0]
    rigid = run("flexible_load", bound | {"load_mass": 0.0}, drive, start, 4)[0]
    assert np.max(np.abs(y - swinging)) < 0.05 * np.max(np.abs(swinging - rigid))


def test_two_bodies_against_an_integration_with_events() -> None:
    """Strokes through the gap to and fro, integrated by scipy from one contact to the next. Nothing brakes the axis:
    what a force that sets in within a step pushes too much stays for ever."""
    total, load, gap, damping = 1.0, 0.4, 5e-4, 0.15
    t = 1e-3 * np.arange(700)

    def drive(time: float) -> float:
        return 6.0 * math.sin(2.0 * math.pi * 4.0 * time) + 2.0 * math.sin(2.0 * math.pi * 11.0 * time)

    def rates(time: float, x: np.ndarray) -> list[float]:
        pull = contact(x[2], x[3], gap, OMEGA, damping)
        a = (drive(time) + load * pull) / (total - load)
        return [x[1], a, x[3], -a - pull]

    def touching(time: float, x: np.ndarray) -> float:
        return abs(x[2]) - 0.5 * gap

    def letting_go(time: float, x: np.ndarray) -> float:
        return OMEGA * (abs(x[2]) - 0.5 * gap) + 2.0 * damping * math.copysign(x[3], x[2] * x[3])

    touching.terminal = letting_go.terminal = True  # type: ignore[attr-defined]
    at, x, exact, contacts = 0.0, np.zeros(4), np.zeros(t.size), 0
    while at < t[-1]:
        part = solve_ivp(
            rates, (at, t[-1]), x, events=(touching, letting_go), rtol=1e-10, atol=1e-13, dense_output=True
        )
        inside = (t >= at) & (t <= part.t[-1])
        if np.any(inside):
            exact[inside] = part.sol(t[inside])[0]
        at, x, contacts = part.t[-1], part.y[:, -1], contacts + 1
        if at < t[-1]:  # past the event, or it would be found again
            past = solve_ivp(rates, (at, at + 1e-7), x, rtol=1e-10, atol=1e-13)
            at, x = past.t[-1], past.y[:, -1]
    assert contacts > 20
    values = with_play({"mass": load, "gap": gap, "frequency": FREQUENCY, "damping": damping})
    inputs = np.array([drive(time) for time in t])
    start = [0.0, 0.0, 0.0, 0.0, 0.0]
    rigid = run("drive_train_backlash", values | {"backlash_load_mass": 0.0}, inputs, start, 2)[0]
    effect = float(np.sqrt(np.mean((exact - rigid) ** 2)))
    for substeps, allowed in ((2, 0.3), (16, 0.08), (128, 0.01)):
        y = run("drive_train_backlash", values, inputs, start, substeps)[0]
        assert float(np.sqrt(np.mean((y - exact) ** 2))) < allowed * effect, substeps


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("frequency", [20.0, 60.0, 1000.0 / 6.0])
@pytest.mark.parametrize("damping", [1e-3, 0.1, 0.6])
def test_the_simulation_creates_no_energy_up_to_a_sixth_of_the_sampling_rate(
    share: float, frequency: float, damping: float
) -> None:
    """A coasting axis whose load rattles: with the momentum known, the speed of one tells that of the other."""
    still = np.zeros(2000)
    values = with_play({"mass": share, "gap": 1e-4, "frequency": frequency, "damping": damping})
    _, v = run("drive_train_backlash", values, still, [0.0, 0.5, 0.0, 3e-5, 0.05], 2)
    momentum = 0.5 + share * 0.05
    load = v + (momentum - v) / share
    moving = 0.5 * (1.0 - share) * v**2 + 0.5 * share * load**2 - 0.5 * momentum**2  # about the centre of mass
    assert np.all(moving <= moving[0] * (1.0 + 0.02))
    assert np.max(moving[-200:]) < 0.7 * moving[0]
