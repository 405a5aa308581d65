"""A force or a friction that wanders: nothing that is measured predicts it, but a moment does so of the next."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.family import Family
from linid.diagnosis.proposed.problem import Problem

PIECE = 0.1  # s, of which each is told by its neighbours
# What sways smoothly with anything else does so in time too: time alone is the cause only where it predicts so many
# times as much as all else.
LEAST_LEAD = 2.0
_MOVING = 0.5  # share of the friction's whole size from which its sign is certain


def wandering(problem: Problem) -> Iterator[Family]:
    """Families of one column each: what the pieces of time beside each row's own say of it."""
    force = problem.residual * problem.mass
    yield _family(problem, ("time",), "wandering force", force, np.ones(force.size))
    size = np.abs(problem.friction)
    yield _family(
        problem, ("time", "direction"), "wandering friction", force, np.where(size > _MOVING, problem.friction, 0.0)
    )


def _family(problem: Problem, names: tuple[str, ...], form: str, force: Array, factor: Array) -> Family:
    rows = problem.rows
    piece = np.floor(rows.t / PIECE).astype(np.int64)
    number = piece + rows.recording * (int(piece.max()) + 3)
    count = int(number.max()) + 2
    weight = factor**2
    sums, sizes = np.bincount(number, factor * force, count), np.bincount(number, weight, count)
    place = (rows.t / PIECE - piece)[:, None]  # in the own piece, 0 to 1
    near = np.stack([number - 1, number + 1], axis=1)
    closeness = np.hstack([1.0 - place, place]) + 0.5
    known = sizes[near] * closeness
    told = np.sum(sums[near] * closeness, axis=1) / np.maximum(np.sum(known, axis=1), 1e-12)
    column = (told * factor / problem.mass)[:, None]
    return Family(names, form, column, 1e-6 * np.eye(1), wanders=True)
