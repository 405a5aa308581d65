"""A diagnosis in the words and units of its axis and motor model."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from linid.physics.wording import fitting_words, scaled_unit

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, Entry, PairShare
    from linid.identification.result import Estimate


def in_axis_words(diagnosis: Diagnosis) -> Diagnosis:
    """The same diagnosis with all texts and parameter units as they fit its axis; twice changes nothing more."""

    def say(text: str) -> str:
        return fitting_words(text, diagnosis.axis, diagnosis.model)

    def all_of(texts: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(map(say, texts))

    def estimate(one: Estimate) -> Estimate:
        return replace(one, unit=scaled_unit(one.unit, diagnosis.axis, diagnosis.force_scale), note=say(one.note))

    def entry(one: Entry) -> Entry:
        return replace(
            one, parameters=tuple(map(estimate, one.parameters)), combinations=all_of(one.combinations),
            note=say(one.note),
        )  # fmt: skip

    def pair(one: PairShare) -> PairShare:
        return replace(one, x_label=say(one.x_label), y_label=say(one.y_label))

    budget, verdict = diagnosis.budget, diagnosis.verdict
    return replace(
        diagnosis,
        verdict=replace(verdict, sentence=say(verdict.sentence), next_experiment=say(verdict.next_experiment)),
        budget=replace(budget, entries=tuple(map(entry, budget.entries)), depends_on=all_of(budget.depends_on)),
        where=tuple(replace(share, label=say(share.label)) for share in diagnosis.where),
        pairs=tuple(map(pair, diagnosis.pairs)),
        assumptions=all_of(diagnosis.assumptions),
        combinations=all_of(diagnosis.combinations),
        warnings=all_of(diagnosis.warnings),
    )
