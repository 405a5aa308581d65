"""A proposed term as an effect of the model: the same formula in the force balance, in simulations and in files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.descent import SETTLING
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.problem import Problem, weighted_base
from linid.diagnosis.proposed.propose import Proposal
from linid.diagnosis.proposed.regression import Regression, Sums
from linid.errors import ConfigError
from linid.physics.effects.registry import canonical, find_effect
from linid.physics.model import Model

NAME = "learned"
_SMALL = 1e-2  # of what is left, in a difference that shows what an amplitude does
_FLAT = 1e-6  # roughness of amplitudes, which have none
_TURNS = 2  # of curve and model, each with the other as it was last


def as_formula(judge: Judge, start: Fitted, problem: Problem, proposal: Proposal, formula: str) -> Regression | None:
    """The regression of a short formula in a proposal's stead, its columns those of the simulation's own term; None
    where no model can have it.

    start: the model beside which the proposal was found; formula: with amplitudes c_1, c_2 ...
    """
    family = Family(proposal.arguments, "formula", np.empty((0, 0)), np.empty((0, 0)), formula=formula)
    able = _extended(start.model, family)
    if able is None:
        return None
    text, model = able
    names = [parameter.name for parameter in find_effect(text).parameters]
    values = {**start.values, **start.preset}
    force = max(float(np.std(problem.residual * problem.mass)), 1e-9)
    plain = judge.balance.residuals(model, model.vector(values)[None, :])[0]
    columns = []
    for name in names:
        # What an amplitude of one makes of the rows tells the size of a step that is small beside the forces.
        step = _SMALL * force
        for _ in range(2):
            shown = plain - judge.balance.residuals(model, model.vector({**values, name: step})[None, :])[0]
            column, size = shown / step, float(np.std(shown * problem.mass))
            step *= _SMALL * force / max(size, 1e-12 * force)
        columns.append(column)
    flat = _FLAT * np.eye(len(names))
    whole = replace(family, columns=np.array(columns).T, roughness=flat)
    if not np.all(np.isfinite(whole.columns)):
        return None
    return Regression(Sums(problem, 0.0), whole)


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


def with_term(judge: Judge, best: Fitted, problem: Problem, proposal: Proposal) -> Fitted | None:
    """The best model with a proposed term, base and effects identified anew beside it; None where it cannot have one.

    The curve is found by its penalised regression beside all that the model can do, and held while the model is
    fitted; then both once more. problem: that the proposal was found on.
    """
    able = _extended(best.model, proposal.family)
    if able is None:
        return None
    text, model = able
    coefficients = proposal.regression.solution()[0]
    step = best
    for turn in range(_TURNS):
        if turn:
            coefficients = _anew(judge, step, problem, proposal.regression, coefficients)
        preset = {**best.preset, **named(text, coefficients)}
        values = {**step.values, **preset}
        step = judge.fits.fit(model, values, preset, step.recordings, SETTLING)
    return step


def named(text: str, coefficients: Array) -> dict[str, float]:
    """The coefficients (k,) of a family, in N, by the names of the own term's parameters."""
    names = [parameter.name for parameter in find_effect(text).parameters]
    return dict(zip(names, coefficients.tolist(), strict=True))


def _anew(judge: Judge, step: Fitted, problem: Problem, regression: Regression, coefficients: Array) -> Array:
    """The coefficients (k,) in N after the model has moved: of what it leaves, with the term as it was put back.

    What rows count, and how far the model may move, stays as it was when the term was found.
    """
    family = regression.family
    residual = step.residual + family.columns @ coefficients
    base = weighted_base(judge.fits.slopes(step), problem.weights)
    whole = replace(problem, residual=residual, base=base)
    return np.asarray(Regression(Sums(whole, family.local), family).solution(regression.best[0])[0])
