"""The contract of all targets, and what a loss says."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from importlib.metadata import EntryPoint

import pytest

from linid.errors import ConfigError, UsageError
from linid.export.loss import measure_loss, measure_model
from linid.export.registry import BUILT_IN, all_targets, collect, find_target
from linid.export.target import Target
from linid.identification.result import FitResult
from tests.export.axes import HELD, LOST, axis, exported, made

MODEL = axis(HELD, LOST)
SINE = {"electrical_wavenumber": 200.0, "winding_displacement": 2.0944, "commutation_offset": 0.3}


@pytest.mark.parametrize("model", [axis(kind="friction"), axis(HELD, kind="sine", **SINE)], ids=lambda one: one.model)
@pytest.mark.parametrize("target", all_targets().values(), ids=lambda target: target.name)
def test_a_target_takes_every_kind_of_model(target: Target, model: FitResult) -> None:
    assert all(target.files(exported(model)).values())
    assert target.simplified(exported(model)).model in (model.model, "sine")


@pytest.mark.parametrize("target", all_targets().values(), ids=lambda target: target.name)
def test_a_target_keeps_its_contract(target: Target) -> None:
    files = target.files(exported(MODEL))
    assert files == target.files(exported(MODEL))  # equal models give equal files
    assert all(content and not name.startswith("/") and ".." not in name for name, content in files.items())
    assert all(line.endswith(".") for line in target.lacks(exported(MODEL)))
    assert target.whole == (target.lacks(exported(MODEL)) == ())
    form = target.simplified(exported(MODEL))
    assert {e.name for e in form.estimates} and (form.axis, form.input_unit) == (MODEL.axis, MODEL.input_unit)


def test_a_form_that_holds_nothing_keeps_nothing_and_the_model_itself_all() -> None:
    recordings = made(axis(HELD), 1.3)
    measured = measure_model(axis(HELD), None, recordings)
    assert [round(kept.share, 6) for kept in measure_loss(measured, None, recordings).kept] == [1.0, 1.0]
    assert [round(kept.share, 6) for kept in measure_loss(measured, axis(), recordings).kept] == [0.0, 0.0]
    assert "keeps 100 % of the closed gap" in measure_loss(measured, None, recordings).text


def test_the_list_of_targets_compiles_nothing() -> None:
    heavy = "import sys, linid.export.registry; print(*{'numba', 'scipy', 'mujoco'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", heavy], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_targets_of_others_are_found_by_their_entry_point() -> None:
    point = EntryPoint("mine", f"{__name__}:MINE", "linid.exports")
    assert list(collect(BUILT_IN, [point]))[-1] == "mine"
    with pytest.raises(ConfigError, match="already"):
        collect((*BUILT_IN, MINE), [point])
    with pytest.raises(ConfigError):
        collect((replace(MINE, name="Mine!"),), [])
    with pytest.raises(UsageError, match="no target"):
        find_target("paper")


MINE = Target("mine", "One of another package.", lambda exported: {"axis.txt": b"axis\n"})
