"""Own terms beside friction laws other than LuGre's: the same as what they stand for, and states of both kept apart."""

from __future__ import annotations

import numpy as np
import pytest

from linid.interface.settings import Settings
from linid.physics.laws.registry import LAWS
from linid.physics.model import ELEMENT_START, MEMORY_PLACE, OWN_VARIABLES, STATE_SIZE, STATE_START, Model
from linid.physics.own_terms import layout
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.simulation.test_laws import DRIVE, OWN, VALUES, T

PUSH = 0.8 * np.sin(40.0 * T)
RESISTANCE = "-c * sign(v)"


def run(law: str, effects: tuple[str, ...], values: dict[str, float], drive: np.ndarray) -> np.ndarray:
    """Positions (n,) in m of an axis that starts at rest."""
    recording = Recording("a", T, np.zeros_like(T), drive_input=drive, kind="motor", split="fit", number=1)
    model = Model("force", effects, law=law)
    simulator = Simulator(model, pack_inputs([recording]), 4)
    vector = model.vector(VALUES | OWN.get(law, {}) | values)[None, :]
    return simulator.run(vector, whole_recordings(simulator.inputs), np.zeros((1, 1, 3)))[0][0]


@pytest.mark.parametrize("law", list(LAWS))
def test_a_force_in_time_is_the_same_as_more_current(law: str) -> None:
    plain = run(law, (), {}, DRIVE)
    driven = run(law, (), {}, DRIVE + PUSH)
    pushed = run(law, ("push: size * sin(40 * t)",), {"push_size": 0.8}, DRIVE)
    moved = np.max(np.abs(driven - plain))
    assert moved > 1e-4 and np.max(np.abs(pushed - driven)) < 1e-3 * moved


@pytest.mark.parametrize("law", ["lugre", "maxwell_slip"])
def test_own_friction_raises_sliding_and_breakaway_force(law: str) -> None:
    raised = {"coulomb_force": VALUES["coulomb_force"] + 0.5, "static_force": VALUES["static_force"] + 0.5}
    expected = run(law, (), raised, DRIVE)
    rubbed = run(law, (f"rub: {RESISTANCE}",), {"rub_c": 0.5}, DRIVE)
    changed = np.max(np.abs(expected - run(law, (), {}, DRIVE)))
    assert changed > 1e-4 and np.max(np.abs(rubbed - expected)) < 1e-3 * changed


def test_memory_and_elements_have_places_of_their_own() -> None:
    model = Model("force", ("worn: -c * exp(-travel / 0.001) * sign(v)",), law="maxwell_slip")
    assert model.effect_states == tuple(range(MEMORY_PLACE, STATE_SIZE))
    elements = tuple(ELEMENT_START - STATE_START + k for k in range(LAWS["maxwell_slip"].elements))
    assert model.states == model.effect_states + elements
    assert elements[0] >= 2 * STATE_SIZE and STATE_START + elements[-1] < OWN_VARIABLES
    assert not Model("force", law="maxwell_slip").effect_states and len(layout.MEMORY) == len(model.effect_states)


def test_the_settings_know_every_law() -> None:
    schema = Settings.model_json_schema()["properties"]["law"]
    choices = {name for part in schema["anyOf"] for name in part.get("enum", ())}
    assert choices == {"auto", *LAWS}
