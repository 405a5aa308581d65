"""A proposed term as an effect of the model: the same formula in the force balance, in simulations and in files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.descent import SETTLING
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.problem import Problem, problem_of
from linid.diagnosis.proposed.propose import Proposal
from linid.diagnosis.proposed.regression import Regression, Sums
from linid.errors import ConfigError
from linid.physics.effects.registry import canonical, find_effect

NAME = "learned"
_TURNS = 2  # of curve and model, each with the other as it was last


def effect_of(family: Family) -> str:
    """The family as an own term, empty where no formula can be written or the model could not hold it."""
    if not family.formula:
        return ""
    try:
        (text,) = canonical((f"{NAME}: {family.formula}",))
    except ConfigError:
        return ""
    return text


def with_term(judge: Judge, best: Fitted, problem: Problem, proposal: Proposal) -> Fitted | None:
    """The best model with a proposed term, base and effects identified anew beside it; None where it cannot have one.

    The curve is found by its penalised regression beside all that the model can do, and held while the model is
    fitted; then both once more. problem: that the proposal was found on.
    """
    text = effect_of(proposal.family)
    if not text:
        return None
    try:
        model = best.model.with_effects((*best.model.effects, text))
    except ConfigError:
        return None
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
    family, moved = regression.family, problem_of(judge, step, problem.seed)
    residual = moved.residual + family.columns @ coefficients
    base = moved.base / moved.weights[:, None] * problem.weights[:, None]
    whole = replace(problem, residual=residual, base=base)
    return np.asarray(Regression(Sums(whole, family.local), family).solution(regression.best[0])[0])
