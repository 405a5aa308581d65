"""Which known effects a proposed term is like, and how they differ from it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import Proposal
from linid.diagnosis.proposed.words import listed, term_labels
from linid.diagnosis.report_data import Resemblance
from linid.physics.effects.registry import find_effect

LEAST_ALIKE = 0.3  # of the term's squares: an effect that reproduces less is another thing
MOST = 3
SAME = 0.95  # of the term's squares: an effect that reproduces this much is the same to these recordings
_RELATIVE = 1e-7  # of a column's size: what is left of it below this is rounding


def resemblances(problem: Problem, proposal: Proposal, tried: Mapping[str, Array]) -> tuple[Resemblance, ...]:
    """The known effects that a term is like, the likest first.

    tried: columns (n, k) in m/s^2 of each effect that makes sense for these recordings, by name.
    """
    coefficients = proposal.regression.solution()[0]
    span = _orthonormal(problem.base)
    term = proposal.family.columns @ coefficients * problem.weights
    term = term - span @ (span.T @ term)
    whole = max(float(term @ term), 1e-300)
    found = []
    for name, columns in tried.items():
        own = _orthonormal(_cleared(columns * problem.weights[:, None], span))
        alike = float(np.sum((own.T @ term) ** 2)) / whole
        if alike > LEAST_ALIKE:
            found.append(Resemblance(name, min(alike, 1.0), _difference(problem, proposal, name, alike)))
    return tuple(sorted(found, key=lambda one: -one.alike)[:MOST])


def _cleared(columns: Array, span: Array) -> Array:
    """Columns (n, k) without what a span (n, r) can do; what is then only rounding is nothing."""
    left = columns - span @ (span.T @ columns)
    before, after = np.linalg.norm(columns, axis=0), np.linalg.norm(left, axis=0)
    return np.asarray(np.where(after > _RELATIVE * before, left, 0.0))


def _orthonormal(columns: Array) -> Array:
    """Orthonormal columns (n, r) of what some columns (n, k) span."""
    norms = np.linalg.norm(columns, axis=0)
    kept = columns[:, norms > 0.0] / norms[norms > 0.0]
    if kept.shape[1] == 0:
        return np.zeros((columns.shape[0], 0))
    left, sizes, _ = np.linalg.svd(kept, full_matrices=False)
    return np.asarray(left[:, sizes > _RELATIVE * sizes[0]])


def refined_by(effects: Sequence[str], arguments: Collection[str]) -> tuple[str, ...]:
    """Effects of a model that depend on just what a term depends on: what is left may be the rest of their form.

    A term of velocity may act by direction alone.
    """
    mine = _without_direction(arguments)
    return tuple(
        name for name in effects if any(_without_direction(one) == mine for one in find_effect(name).depends_on if one)
    )


def _without_direction(arguments: Collection[str]) -> frozenset[str]:
    return frozenset("velocity" if name == "direction" else name for name in arguments)


def _difference(problem: Problem, proposal: Proposal, name: str, alike: float) -> str:
    """How an effect differs from the term, for people."""
    said = name.replace("_", " ")
    missing = f"{100.0 * (1.0 - alike):.2g} % of the term is not reproduced"
    answers = find_effect(name).depends_on
    if not answers:
        return missing
    term, effect = proposal.arguments, answers[0]
    more = term_labels(problem, tuple(a for a in term if a not in effect))
    other = term_labels(problem, tuple(a for a in effect if a not in term))
    if not more and not other:
        return "the same arguments and shape" if alike >= SAME else f"the same arguments, another shape: {missing}"
    if not effect:
        return f"{said} is the same everywhere; the term depends on {listed(more)}"
    if not other:
        return f"{said} depends on {listed(term_labels(problem, effect))} alone; the term also on {listed(more)}"
    if not more:
        return f"{said} depends on {listed(other)} too; the term does not"
    return f"{said} depends on {listed(term_labels(problem, effect))}; the term on {listed(term_labels(problem, term))}"
