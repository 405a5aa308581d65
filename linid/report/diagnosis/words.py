"""A diagnosis as it is told: in the words and units of its axis and motor model, with the floors of its entries."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from linid.physics.wording import fitting_words, scaled_unit
from linid.report.symbols import typeset

if TYPE_CHECKING:
    from collections.abc import Callable

    from linid.diagnosis.report_data import Change, Diagnosis, Entry, PairShare, ProposedTerm, TermCurve
    from linid.identification.result import Estimate


def in_print(diagnosis: Diagnosis) -> Diagnosis:
    """The same diagnosis as people read it: `in_axis_words`, its texts with the signs of print."""
    return in_axis_words(diagnosis, typeset)


def in_axis_words(diagnosis: Diagnosis, sign: Callable[[str], str] = str) -> Diagnosis:
    """The same diagnosis with all texts and parameter units as they fit its axis; twice changes nothing more.

    Parts of an effect that do not act (of 50 disturbances all but a few) are left out. A measure of an entry without
    a floor gets that of the whole diagnosis: both are over the held-out recordings. sign: how texts are written.
    """

    def say(text: str) -> str:
        return sign(fitting_words(text, diagnosis.axis, diagnosis.model))

    def all_of(texts: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(map(say, texts))

    def estimate(one: Estimate) -> Estimate:
        return replace(one, unit=scaled_unit(one.unit, diagnosis.axis, diagnosis.force_scale), note=say(one.note))

    def entry(one: Entry) -> Entry:
        return replace(
            one,
            parameters=tuple(map(estimate, parameters_in_use(one))),
            combinations=all_of(one.combinations),
            note=say(one.note),
            measures=_with_floors(one.measures, diagnosis),
        )

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
        proposal=None if diagnosis.proposal is None else _term(diagnosis.proposal, diagnosis, say),
    )


def _with_floors(measures: dict[str, Change], diagnosis: Diagnosis) -> dict[str, Change]:
    """Measures over the held-out recordings; those without a floor get that of the whole diagnosis."""
    return {
        name: replace(change, floor=diagnosis.measures[name].floor)
        if math.isnan(change.floor) and name in diagnosis.measures
        else change
        for name, change in measures.items()
    }


def _term(term: ProposedTerm, diagnosis: Diagnosis, say: Callable[[str], str]) -> ProposedTerm:
    """A proposed term in the words and units of its axis; its effect stays as the program reads it."""

    def unit(one: str) -> str:
        return scaled_unit(one, diagnosis.axis, diagnosis.force_scale)

    def curve(one: TermCurve) -> TermCurve:
        axes = tuple(replace(axis, label=say(axis.label), unit=unit(axis.unit)) for axis in one.axes)
        return replace(one, axes=axes, unit=unit(one.unit))

    return replace(
        term,
        not_on=tuple(map(say, term.not_on)),
        curve=None if term.curve is None else curve(term.curve),
        short=None if term.short is None else replace(term.short, text=say(term.short.text)),
        resembles=tuple(replace(one, difference=say(one.difference)) for one in term.resembles),
        measures=_with_floors(term.measures, diagnosis),
        sentence=say(term.sentence),
        next_experiment=say(term.next_experiment),
    )


def parameters_in_use(entry: Entry) -> tuple[Estimate, ...]:
    """The parameters of an entry without those of parts that do not act: all their amplitudes are 0."""
    from linid.physics.effects.registry import EFFECTS

    effect = next((one for one in EFFECTS if one.name == entry.effect and one.parts > 1), None)
    if effect is None:
        return entry.parameters
    values = {one.name: one.value for one in entry.parameters}
    idle = tuple(
        f"_{part}"
        for part in range(1, effect.parts + 1)
        if all(values.get(name, 0.0) == 0.0 for name in effect.amplitudes_of_part(part))
    )
    return tuple(one for one in entry.parameters if not one.name.endswith(idle))
