"""What has changed since a given model, in words: which parameters, from what to what."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from linid.physics.wording import fitting_words, scaled_unit
from linid.report.diagnosis.content import number
from linid.report.numbers import with_interval
from linid.report.symbols import unit_label

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, ParameterChange


def change_words(diagnosis: Diagnosis) -> str:
    """The parameters that are others than in the given model; empty where none is given."""
    if not diagnosis.given:
        return ""
    if diagnosis.changes:
        told = "; ".join(_one(change, diagnosis) for change in diagnosis.changes)
        return f"Changed since the given model: {told}."
    if diagnosis.verdict.status == "none":
        return "Nothing has changed since the given model that these recordings could show."
    return (
        "No parameter of the given model has changed as far as these recordings tell: what differs is of another kind."
    )


def _one(change: ParameterChange, diagnosis: Diagnosis) -> str:
    name = fitting_words(change.parameter.replace("_", " "), diagnosis.axis, diagnosis.model)
    unit = unit_label(scaled_unit(change.unit, diagnosis.axis, diagnosis.force_scale))
    after = with_interval(change.after, change.low, change.high)
    share = "" if not math.isfinite(change.share) else f" ({100.0 * change.share:+.3g} %)"
    return f"{name} {number(change.before)} to {after} {unit}{share}"
