"""A result that two minima share: where the data do not tell them apart, its intervals hold both."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from linid.identification.derived_quantities import SINE_COST, derived_quantities, shapes_not_told, sine_note
from linid.identification.result import Estimate, FitResult
from linid.identification.space.search_space import SearchParameter, SearchSpace
from linid.identification.uncertainty.estimates import is_useless_ratio
from linid.identification.uncertainty.identifiability import RANGE_LIMIT, advice
from linid.physics.field.sine_scope import NEGLIGIBLE
from linid.statistics import NORMAL_97_5

_COIL = "coil_length"


def shared(
    best: FitResult, rival: FitResult, space: SearchSpace, ends: Sequence[Mapping[str, float]] = ()
) -> FitResult:
    """The best result with intervals that also hold those of a rival which the data do not tell from it.

    space: in which both were found; ends: of valleys in which the rival lies, SI values by name.
    """
    spans = {searched.name: searched for searched in space.parameters}
    estimates, others = [], []
    for mine, its in zip(best.estimates, rival.estimates, strict=True):
        joined = _joined(mine, _reaching(its, [end[its.name] for end in ends]))
        if mine.name in spans and joined.status == "fitted" and _says_nothing(joined, spans[mine.name]):
            note = f"these recordings do not tell it: {advice(mine.name, best.axis, best.model)}"
            joined = replace(joined, status="not_identifiable", note="; ".join(filter(None, (joined.note, note))))
        estimates.append(joined)
        others.append(replace(its, status=joined.status))
    told = replace(best, estimates=tuple(estimates))
    of_rival = {e.name: e for e in derived_quantities(replace(rival, estimates=tuple(others)), ())}
    for end in ends:
        there = replace(rival, estimates=tuple(replace(e, value=end[e.name]) for e in others))
        of_rival = {e.name: _reaching(of_rival[e.name], [e.value]) for e in derived_quantities(there, ())}
    of_best = {e.name: e for e in derived_quantities(told, ())}
    costs = {e.name: e for e in rival.derived}
    derived = tuple(
        _sine_cost(e, costs[e.name], told) if e.name == SINE_COST else _derived(e, of_best[e.name], of_rival[e.name])
        for e in best.derived
    )
    return replace(told, derived=derived)


def with_twin(result: FitResult, space: SearchSpace) -> FitResult:
    """The result of a theta motor with intervals that also hold its twin: a coil of length pi/2 - z_L pushes alike.

    Where the bounds leave room for it: the odd harmonics of the thrust hang on sin(2 n z_L).
    """
    searched = next((s for s in space.parameters if s.name == "winding_length"), None)
    if searched is None or result.model != "theta":
        return result
    length = result.value(searched.name)
    if not searched.lower <= 0.5 * math.pi - length <= searched.upper:
        return result
    mirrored = tuple(_mirrored(e) if e.name == searched.name else e for e in result.estimates)
    told = shared(result, replace(result, estimates=mirrored), space)
    # A coil and its twin are pi / z_0 long together, those of a minimum that the result holds already among them.
    both = math.pi / result.value("electrical_wavenumber")
    derived = (_reaching(e, [both - e.high, both - e.low]) if e.name == _COIL else e for e in told.derived)
    return replace(told, derived=tuple(derived))


def with_plain(result: FitResult, space: SearchSpace) -> FitResult:
    """The result of a theta motor with intervals that also hold all wider magnets, down to the search's bound.

    Their thrust is the first harmonic alone, K_f' q being what is told.
    """
    searched = next(s for s in space.parameters if s.name == "nome")
    nome = result.value("nome")
    stretch = {"nome": searched.lower / nome, "force_constant": nome / searched.lower}
    widest = tuple(_stretched(e, stretch[e.name]) if e.name in stretch else e for e in result.estimates)
    return shared(result, replace(result, estimates=widest), space)


def _stretched(estimate: Estimate, by: float) -> Estimate:
    return replace(estimate, value=by * estimate.value, low=by * estimate.low, high=by * estimate.high)


def _mirrored(length: Estimate) -> Estimate:
    quarter = 0.5 * math.pi
    return replace(length, value=quarter - length.value, low=quarter - length.high, high=quarter - length.low)


def _says_nothing(estimate: Estimate, searched: SearchParameter) -> bool:
    """Whether the interval is as wide as one that `is_useless`."""
    if searched.log and estimate.low > 0.0:
        return is_useless_ratio(0.5 * math.log(estimate.high / estimate.low) / NORMAL_97_5)
    return 0.5 * (estimate.high - estimate.low) / NORMAL_97_5 > RANGE_LIMIT * (searched.upper - searched.lower)


def _derived(known: Estimate, mine: Estimate, its: Estimate) -> Estimate:
    """A derived quantity with an interval that also holds that of the other minimum.

    known: as the best result has it, which may hold a third minimum already; mine: derived anew, with what is told now.
    """
    note = known.note if mine.note in known.note else "; ".join(filter(None, (known.note, mine.note)))
    return _joined(replace(known, status=mine.status, note=note), its)


def _sine_cost(mine: Estimate, its: Estimate, told: FitResult) -> Estimate:
    """What a sine would miss, with a word on whether both minima say the same of it."""
    if mine.value == its.value and mine.note:  # a twin pushes alike; the note may hold another minimum already
        return mine
    both = f"{mine.value:.2g} or {its.value:.2g}, shared by two minima"
    if (mine.value >= NEGLIGIBLE) == (its.value >= NEGLIGIBLE):
        return replace(mine, note=f"{both}: {sine_note(told, mine.value, bool(shapes_not_told(told)))}")
    note = f"{both}: these recordings do not tell whether {told.model} pays"
    return replace(mine, status="not_identifiable", note=note)


def _joined(mine: Estimate, its: Estimate) -> Estimate:
    """An estimate whose interval also holds that of the other minimum."""
    if not all(map(math.isfinite, (mine.low, mine.high, its.low, its.high))):
        return mine
    low, high = min(mine.low, its.low), max(mine.high, its.high)
    grown = (high - low) / max(mine.high - mine.low, 1e-300)
    status = "not_identifiable" if "not_identifiable" in (mine.status, its.status) else mine.status
    note = mine.note or (its.note if its.status == status else "")
    if mine.high < its.low or its.high < mine.low:
        both = f"not told apart: {mine.value:.4g} or {its.value:.4g}, shared by two minima"
        note = "; ".join(filter(None, (note, both)))
    return replace(mine, low=low, high=high, std=mine.std * max(grown, 1.0), status=status, note=note)


def _reaching(estimate: Estimate, values: Sequence[float]) -> Estimate:
    """An estimate whose interval, if it has one, also holds these values."""
    if not (values and math.isfinite(estimate.low) and math.isfinite(estimate.high)):
        return estimate
    return replace(estimate, low=min(estimate.low, *values), high=max(estimate.high, *values))
