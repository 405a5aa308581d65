"""A proposed term as an effect of the model: the same formula in the force balance, in simulations and in files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from linid.arrays import Array
from linid.diagnosis.descent import SETTLING
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.masses import at_the_masses
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.problem import Problem, problem_of
from linid.diagnosis.proposed.propose import Proposal
from linid.diagnosis.proposed.regression import Regression, Sums
from linid.diagnosis.proposed.short_formula import AS_GOOD, FoundFormula
from linid.errors import ConfigError
from linid.identification.space.proportions import proportions_of
from linid.physics.effects.effect import Values
from linid.physics.effects.registry import canonical, find_effect
from linid.physics.model import Model

NAME = "learned"
_MANY = 6  # amplitudes, from which derivatives take less time than differences
_SMALL = 1e-2  # of what is left, in a difference that shows what an amplitude does
_TURNS = 2  # of curve and model, each with the other as it was last: a third one lowers the criterion by 6e-4 at most


@dataclass(frozen=True)
class Joined:
    """A model with a proposed term. effect: the own term; formula: that it is, where it is one of the dictionary."""

    fitted: Fitted
    effect: str
    formula: FoundFormula | None


def formula_instead(
    judge: Judge,
    start: Fitted,
    problem: Problem,
    proposal: Proposal,
    formula: FoundFormula,
    least: float = 1.0 - AS_GOOD[0],
) -> Proposal | None:
    """A proposal with a short formula in its curve's stead, where the simulation's own term closes about as much.

    start: the model beside which the proposal was found; least: share of what the curve closes.
    """
    able = _simulated(judge, start, problem, _family_of(proposal, formula))
    if able is None:
        return None
    regression = able.regression
    closed = min(regression.closed(), 1.0)
    if closed < least * proposal.closed:
        return None
    return replace(proposal, family=regression.family, regression=regression, closed=closed)


def _family_of(proposal: Proposal, formula: FoundFormula) -> Family:
    """A formula as a family, its columns to follow."""
    flat = formula.fit.roughness
    return Family(proposal.arguments, "formula", np.empty((0, flat.shape[0])), flat, formula=formula.said.effect)


@dataclass(frozen=True)
class _Simulated:
    """A family as the simulation has it. text: of the own term; model: with it; regression: on its columns there."""

    text: str
    model: Model
    regression: Regression


def _simulated(judge: Judge, plain: Fitted, problem: Problem, family: Family) -> _Simulated | None:
    """A family with the columns of the simulation's own term; None where no model can have it.

    plain: the model without the term, at whose values the columns are taken.
    """
    able = _extended(plain.model, family)
    if able is None:
        return None
    whole = replace(family, columns=_columns(judge, plain, problem, family.formula))
    if not np.all(np.isfinite(whole.columns)):
        return None
    return _Simulated(*able, Regression(Sums(problem, family.local), whole))


def _columns(judge: Judge, plain: Fitted, problem: Problem, formula: str) -> Array:
    """Accelerations (n, k) in m/s^2 per unit of each amplitude of an own term in the simulation."""
    (text,) = canonical((f"{NAME}: {formula}",))
    model = plain.model.with_effects((*plain.model.effects, text))
    values = {**plain.values, **plain.preset}
    force = max(float(np.std(problem.residual * problem.mass)), 1e-9)
    names, columns = [parameter.name for parameter in find_effect(text).parameters], []
    if len(names) >= _MANY and judge.balance.has_slopes(model):
        return _slopes_by(judge, model, values, names, force)
    for name in names:
        # What an amplitude of one makes of the rows tells the size of a step that is small beside the forces.
        step = _SMALL * force
        for _ in range(2):
            vector = model.vector({**values, name: step})
            column = (plain.residual - judge.balance.residuals(model, vector[None, :])[0]) / step
            step *= _SMALL * force / max(float(np.std(column * step * problem.mass)), 1e-12 * force)
        columns.append(column)
    return np.array(columns).T


def _slopes_by(judge: Judge, model: Model, values: Values, names: list[str], force: float) -> Array:
    """`_columns` of amplitudes that all are 0 at these values, by derivatives; not a number, where the own term is none
    somewhere. force: that an amplitude may be, N."""
    balance = judge.balance
    there = balance.part(model).residuals(model.vector(values | dict.fromkeys(names, force))[None], np.zeros((1, 0)))
    if not np.all(np.isfinite(there)):
        return np.full((there.shape[1], len(names)), np.nan)
    tangents = np.zeros((len(names), model.size))
    tangents[np.arange(len(names)), [model.slot(name) for name in names]] = force
    return np.asarray(-balance.slopes(model, model.vector(values), tangents).T / force)


def effect_of(family: Family) -> str:
    """The family as an own term, empty where no formula can be written or the model could not hold it."""
    if not family.formula:
        return ""
    try:
        (text,) = canonical((f"{NAME}: {family.formula}",))
    except ConfigError:
        return ""
    return text


def _extended(model: Model, family: Family) -> tuple[str, Model] | None:
    """A family as an own term and a model with it; None where the model cannot have it."""
    text = effect_of(family)
    try:
        return (text, model.with_effects((*model.effects, text))) if text else None
    except ConfigError:
        return None


def with_term(
    judge: Judge, start: Fitted, problem: Problem, proposal: Proposal, formula: FoundFormula | None
) -> Joined | None:
    """The model with a proposed term, base and effects identified anew beside it; None where it cannot have one.

    The curve is found by its penalised regression beside all that the model can do, and keeps its shape, not its size,
    while the model is fitted; then both once more, a formula with its numbers. problem: that the proposal was found on;
    formula: that the proposal is, if any.
    """
    able = _extended(start.model, proposal.family)
    if able is None:
        return None
    (text, model), step, regression = able, start, proposal.regression
    coefficients = regression.solution()[0]
    for turn in range(_TURNS):
        if turn:
            plain = judge.fits.at(start.model, step.values, start.preset, step.recordings)
            whole = problem_of(judge, plain, problem.seed)
            formula = None if formula is None else formula.anew(whole, partial(_columns, judge, plain, whole))
            family = proposal.family if formula is None else _family_of(proposal, formula)
            anew = _simulated(judge, plain, whole, family)
            if anew is None:
                break
            text, model, regression = anew.text, anew.model, anew.regression
            coefficients = regression.solution(proposal.regression.best[0])[0]
        shape = proportions_of(model, named(text, coefficients), {})
        values = {**step.values, **shape.values, **shape.leaders}
        step = judge.fits.fit(model, values, start.preset, step.recordings, SETTLING, shape=shape)
        step = at_the_masses(judge.fits, step)
    final = np.array([step.values[name] for name in named(text, coefficients)])
    return Joined(step, text, None if formula is None else formula.put(final, regression.closed()))


def named(text: str, coefficients: Array) -> dict[str, float]:
    """The coefficients (k,) of a family, in N, by the names of the own term's parameters."""
    names = [parameter.name for parameter in find_effect(text).parameters]
    return dict(zip(names, coefficients.tolist(), strict=True))
