"""The registry: effects of other packages, malformed ones, names that clash; the documentation's table of effects."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from linid.errors import ConfigError, UsageError
from linid.physics.effects import constant_force, quadratic_drag
from linid.physics.effects.effect import Effect, check_effect, term
from linid.physics.effects.registry import BUILT_IN, EFFECTS, active_mask, collect, find_effect
from linid.physics.parameter import Parameter
from tests.effects_table import PAGE, between_markers, effects_table

PACKAGE = Path(__file__).parent / "example_effect_package"


@term
def drag(t, y, v, i_1, i_2, i_3, record, elapsed, c):
    return -c * v * abs(v)


@term
def two_states(h, t, y, v, a, i_1, i_2, i_3, record, elapsed, s_1, s_2, c):
    return s_1, s_2


@term
def three_states(t, y, v, i_1, i_2, i_3, record, elapsed, s_1, s_2, s_3, c):
    return s_3


DRAG = replace(
    quadratic_drag.EFFECT,
    parameters=quadratic_drag.EFFECT.parameters[:1],
    preset=(),
    force=drag,
    grid=constant_force.EFFECT.grid,
)


def plain(t, y, v, i_1, i_2, i_3, record, elapsed, c):
    return c


def renamed(name: str, **changes: object) -> Effect:
    parameter = Parameter(f"{name}_size", "c", "N", -1.0, 1.0, 0.0)
    return replace(DRAG, name=name, parameters=(parameter,), amplitudes=(parameter.name,), **changes)


def test_masks_are_distinct_bits() -> None:
    masks = [active_mask((effect.name,)) for effect in EFFECTS]
    assert sorted(masks) == [1 << k for k in range(len(EFFECTS))]
    assert active_mask(tuple(effect.name for effect in EFFECTS)) == sum(masks)
    assert active_mask(("cogging", "cogging")) == active_mask(("cogging",))


def test_an_unknown_effect_is_answered_with_the_nearest() -> None:
    with pytest.raises(UsageError, match="'cogging'"):
        find_effect("coging")


@pytest.mark.parametrize(
    ("effect", "fact"),
    [
        (renamed("a", force=plain), "not compiled"),
        (renamed("a", force=None), "no term"),
        (renamed("a", slot="MOTOR"), "slot"),
        (renamed("no name"), "identifier"),
        (renamed("a", preset=("b",)), "no parameter"),
        (replace(renamed("a"), amplitudes=()), "empty"),
        (replace(DRAG, parameters=(replace(DRAG.parameters[0], default=1.0),)), "default 0"),
        (replace(DRAG, parameters=(replace(DRAG.parameters[0], lower=1.0),)), "outside its bounds"),
        (replace(DRAG, parameters=DRAG.parameters * 2), "same name"),
        (renamed("a", initial=DRAG.force), "no `advance`"),
        (replace(DRAG, parameters=(*DRAG.parameters, Parameter("b", "b", "1", 0.0, 1.0, 0.0))), "takes 9 arguments"),
        (replace(DRAG, advance=two_states, sensor=three_states), "takes 3 hidden states, `advance` takes 2"),
    ],
)
def test_a_malformed_effect_is_refused_with_place_and_fact(effect: Effect, fact: str) -> None:
    with pytest.raises(ConfigError, match=fact) as caught:
        check_effect(effect, "entry point 'x' of y")
    assert caught.value.place.startswith("entry point 'x' of y") and caught.value.remedy


def test_names_that_clash_are_refused() -> None:
    with pytest.raises(ConfigError, match="'quadratic_drag' is taken by linid"):
        collect([DRAG, DRAG], [])
    mass = replace(DRAG, name="heavy", parameters=(replace(DRAG.parameters[0], name="mass"),), amplitudes=("mass",))
    with pytest.raises(ConfigError, match="'mass' is taken by the base model"):
        collect([mass], [])
    with pytest.raises(ConfigError, match="'drag_coefficient' is taken"):
        collect([DRAG, replace(DRAG, name="other")], [])


def test_an_entry_point_that_cannot_be_loaded_or_is_no_effect_is_refused() -> None:
    for value, fact in (("no_such_module:EFFECT", "cannot be loaded"), ("math:pi", "found float")):
        with pytest.raises(ConfigError, match=fact):
            collect(BUILT_IN, [EntryPoint("broken", value, "linid.effects")])


def test_effects_of_packages_follow_those_of_linid() -> None:
    point = EntryPoint("again", "linid.physics.effects.constant_force:EFFECT", "linid.effects")
    assert collect([DRAG], [point]) == (DRAG, constant_force.EFFECT)


END_TO_END = """
import json, sys
import numpy as np
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.reference import simulate_reference
from linid.simulation.run import Simulator, whole_recordings
from linid.workflow.commands.effects import list_effects

names = ("magnet_beside_track", "rubber_coupling")
values = dict(coulomb_force=1.72, static_force=3.198, stribeck_velocity=2.993e-3, stribeck_exponent=2.0,
    bristle_stiffness=1.169e4, bristle_damping=92.14, viscous_friction=2.517, mass=0.588,
    magnet_attraction=3.0, magnet_place=0.1, magnet_width=0.05,
    coupling_load=0.2, coupling_frequency=15.0, coupling_relaxing=0.8, coupling_relaxation=0.01)
t = np.arange(0.0, 0.25, 1e-3)
recording = Recording("coast", t, np.zeros_like(t), kind="free_wheel")
start = (0.0, 1.0, 1e-4)
out = {}
for effects in ((), names[:1], names[1:], names):
    model = Model("friction", effects)
    simulator = Simulator(model, pack_inputs([recording]), 8)
    y = simulator.run(model.vector(values)[None, :], whole_recordings(simulator.inputs), np.array([[start]]))[0][0]
    exact = simulate_reference("friction", values, recording, start, effects=effects, rtol=1e-10)[0]
    out["+".join(effects)] = [float(y[-1]), float(np.max(np.abs(y - exact)))]
listed = [row["name"] for row in list_effects(None).summary["effects"]]
print(json.dumps({"runs": out, "last": listed[-2:], "states": len(Model("friction", names).states)}))
"""


def test_a_package_brings_its_effects_each_in_one_file(tmp_path: Path) -> None:
    """Found by its entry point (no pip: a folder with dist-info on the path), listed, compiled, simulated."""
    root = Path(__file__).parents[2]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(PACKAGE), str(root), os.environ.get("PYTHONPATH", "")]),
        "LINID_CACHE_DIR": str(tmp_path),
    }
    done = subprocess.run(
        [sys.executable, "-c", END_TO_END], env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr[-2000:]
    answer = json.loads(done.stdout)
    assert answer["last"] == ["magnet_beside_track", "rubber_coupling"] and answer["states"] == 3
    without = answer["runs"].pop("")[0]
    for effects, (position, error) in answer["runs"].items():
        assert abs(position - without) > 1e-5, effects
        assert error < (1e-8 if "rubber" not in effects else 1e-7), effects


def test_the_documentation_lists_the_effects_as_they_are() -> None:
    """Otherwise run `python -m tests.effects_table`."""
    assert between_markers(PAGE.read_text(encoding="utf-8")) == effects_table(BUILT_IN)
