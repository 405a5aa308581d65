"""What real axes lack, judged on recordings that were not fitted (EMPS: Janot, Gautier, Brunot 2019; mn4004)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.diagnosis.diagnose import diagnose
from linid.workflow.inputs import read_inputs
from linid.workflow.settings import Settings
from tests.identification.test_real_axes import DRIVE_GAIN, emps, force_error
from tests.shared_data import shared


def test_emps_lacks_a_friction_that_knows_the_direction() -> None:
    fitted, held = emps("DATA_EMPS"), emps("DATA_EMPS_PULSES")
    recordings = (fitted, replace(held, split="held_out"))
    found = diagnose("emps", recordings, "force", known={"force_constant": DRIVE_GAIN}, jobs=2)
    verdict, ranking = found.diagnosis.verdict, [c.effects for c in found.diagnosis.candidates]
    assert (verdict.status, verdict.effects) == ("identified", ("asymmetric_friction",))
    assert ranking.index(("asymmetric_friction",)) < ranking.index(("constant_force",))
    assert 0.075 < force_error(found.before, held) < 0.090
    assert force_error(found.after, held) <= 0.054


def test_mn4004_cogs_at_multiples_of_six_per_revolution() -> None:
    inputs = read_inputs([shared("real", "mn4004", "campaign.yaml")], Settings())
    found = diagnose("mn4004", inputs.recordings, "force", known=inputs.known, jobs=2)
    verdict, best = found.diagnosis.verdict, found.diagnosis.candidates[0]
    assert (verdict.status, verdict.effects) == ("identified", ("cogging",))
    assert best.closure > 0.8
    # Waves of the poles, the slots and their least common multiple; nothing else was offered a reason to be there.
    values = {e.name: e.value for e in best.parameters}
    sizes = {
        values[f"cogging_order_{k}"]: float(np.hypot(values[f"cogging_sine_{k}"], values[f"cogging_cosine_{k}"]))
        for k in range(1, 9)
    }
    strongest = sorted(sizes, key=lambda order: -sizes[order])[:5]
    assert all(order % 6.0 == 0.0 for order in strongest), strongest
    force = best.held_out["force"]
    assert force.after < 0.5 * force.before
    estimates = {e.name: e.value for e in found.after.estimates}
    assert abs(estimates["mass"] / estimates["force_constant"] / 1.93e-4 - 1.0) < 0.02
