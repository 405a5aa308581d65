"""What every target keeps of the gap that one model closes, forms that are equal simulated once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from linid.diagnosis.gap import RecordingGap
from linid.errors import ConfigError, UsageError
from linid.export.loss import Errors, Loss, Measured, loss_of, measure_gaps_of
from linid.export.target import Exported, Target
from linid.identification.model_file import model_to_text
from linid.identification.result import FitResult
from linid.parallel_tasks import in_parallel
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
    forms = [_form_of(target, exported) for target in targets]
    known: dict[str, Sequence[RecordingGap | Errors]] = {model_to_text(exported.result): measured.full}
    asked = {form.key: form.result for form in forms if form.result is not None and form.key not in known}

    def gaps_of(item: tuple[str, FitResult], threads: int) -> tuple[RecordingGap, ...]:
        return measure_gaps_of(item[1], recordings, threads)

    known |= {key: gaps for (key, _), gaps in in_parallel(gaps_of, tuple(asked.items()), jobs)}
    return tuple(_surveyed(form, measured, known.get(form.key, measured.full)) for form in forms)


@dataclass(frozen=True)
class _Form:
    """What a target makes of a model. result: the model as it holds it; None: the model itself."""

    target: str
    result: FitResult | None = None
    lacks: tuple[str, ...] = ()
    refused: str = ""

    @cached_property
    def key(self) -> str:
        """Of the result among others; empty without one."""
        return "" if self.result is None else model_to_text(self.result)


def _form_of(target: Target, exported: Exported) -> _Form:
    if target.whole:  # nothing is asked of its files: a unit would be compiled
        return _Form(target.name, None, target.lacks(exported))
    try:
        target.files(exported)
        return _Form(target.name, target.simplified(exported), target.lacks(exported))
    except (UsageError, ConfigError) as error:
        return _Form(target.name, refused=" ".join(str(error).split()))


def _surveyed(form: _Form, measured: Measured, gaps: Sequence[RecordingGap | Errors]) -> Surveyed:
    if form.refused:
        return Surveyed(form.target, refused=form.refused)
    return Surveyed(form.target, gaps is measured.full, form.lacks, loss_of(measured, gaps))
