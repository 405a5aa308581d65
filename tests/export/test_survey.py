"""What all targets keep of one model's closed gap: as each alone, and with equal forms simulated once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from linid.errors import UsageError
from linid.export import survey
from linid.export.loss import measure_loss, measure_model
from linid.export.registry import find_target
from linid.export.survey import survey_targets
from linid.export.target import Exported
from tests.export.axis import result_of
from tests.simulation.axis_with_effects import campaign_with

EFFECTS = ("cogging", "gravity")


def _refusing(exported: Exported) -> dict[str, bytes]:
    raise UsageError("--to", "cannot be made of this model", "Choose another.")


def said(row: survey.Surveyed) -> dict[str, object]:
    """What its loss says."""
    assert row.loss is not None
    return row.loss.row()


def test_each_row_is_that_of_the_target_alone_and_equal_forms_run_once(monkeypatch: pytest.MonkeyPatch) -> None:
    recordings = campaign_with(EFFECTS)[-2:]
    exported = Exported(result_of(EFFECTS, substeps=8), "axis")
    whole, simple = find_target("python"), find_target("urdf")
    targets = (whole, simple, replace(simple, name="twin"), replace(simple, name="none", files=_refusing))
    runs = []
    gaps = survey.measure_gaps_of
    monkeypatch.setattr(survey, "measure_gaps_of", lambda *given: runs.append(1) or gaps(*given))
    measured = measure_model(exported.result, None, recordings)
    rows = survey_targets(targets, exported, measured, recordings)
    assert len(runs) == 1  # urdf and its twin; the whole model was measured already
    alone = measure_loss(measured, simple.simplified(exported), recordings)
    assert rows[0].whole and said(rows[0]) == measure_loss(measured, None, recordings).row()
    assert not rows[1].whole and said(rows[1]) == said(rows[2]) == alone.row()
    assert rows[1].lacks == simple.lacks(exported) and rows[1].lacks
    assert rows[3].loss is None and "cannot be made of this model" in rows[3].refused
