"""What every target keeps of the gap that one model closes, forms that are equal simulated once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from linid.errors import ConfigError, UsageError
from linid.export.loss import Loss, Measured, loss_of, measure_gaps_of
from linid.export.target import Exported, Target
from linid.identification.model_file import model_to_text
from linid.recording.recording import Recording


@dataclass(frozen=True)
class Surveyed:
    """One target. whole: whether its form is the model itself; lacks: what the form cannot hold, a sentence each;
    loss: None where the target cannot be made of the model; refused: why it cannot, empty where it can."""

    target: str
    whole: bool = False
    lacks: tuple[str, ...] = ()
    loss: Loss | None = None
    refused: str = ""


def survey_targets(
    targets: Sequence[Target], exported: Exported, measured: Measured, recordings: Sequence[Recording], jobs: int = 1
) -> tuple[Surveyed, ...]:
    """What each target keeps of the gap that a model closes on recordings.

    measured: that gap, from `measure_model` or as it is known already; recordings: held-out ones, in its order.
    Returns one row for each target, in order. Raises UsageError or DataError where a recording lacks what the model
    needs.
    """
    known = {model_to_text(exported.result): measured.full}
    return tuple(_surveyed(target, exported, measured, known, recordings, jobs) for target in targets)


def _surveyed(
    target: Target,
    exported: Exported,
    measured: Measured,
    known: dict[str, Any],
    recordings: Sequence[Recording],
    jobs: int,
) -> Surveyed:
    if target.whole:  # nothing is asked of its files: a unit would be compiled
        return Surveyed(target.name, True, target.lacks(exported), loss_of(measured, measured.full))
    try:
        target.files(exported)
        form, lacks = target.simplified(exported), target.lacks(exported)
    except (UsageError, ConfigError) as error:
        return Surveyed(target.name, refused=" ".join(str(error).split()))
    key = model_to_text(form)
    if key not in known:
        known[key] = measure_gaps_of(form, recordings, jobs)
    gaps = known[key]
    return Surveyed(target.name, gaps is measured.full, lacks, loss_of(measured, gaps))
