"""The friction laws as the kernels take them: along a measured motion, and step by step of a simulation.

Each bundle has elements (how many springs move on their own), plain (1 where the bristle moves as `bristle_along` has
it, else 0), along, at_rest, share_out, bristle, predicted, step. The elements' deflections stand in the parameters
behind the hidden states; w is then what a single bristle would bend.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from linid.physics.laws.law import Law
from linid.physics.laws.registry import find_law
from linid.physics.model import ELEMENT_START
from linid.simulation.along import REST_AVERAGE, bristle_along, bristle_at_rest, piece_of, pieces_of
from linid.simulation.binding import inlined
from linid.simulation.bundle import Bundle
from linid.simulation.law_steps import bristle_terms, element_terms, own_of
from linid.simulation.steps import followed_bristle, predicted

_SPLITS = 8  # of the way between two samples, at most, over which a bristle's mean is taken by Simpson's rule
_SPLIT = 0.4  # of the steady deflection: travel that one of them is good for
_STEADY = 1e-6  # of it, within which the bristle stays where it is


@inlined
def _no_share(axis, bristles, w):
    pass


@inlined
def _no_bristle(axis, bristles):
    return 0.0


@cache
def law_terms(name: str) -> Bundle:
    """The compiled terms of the friction law of that name."""
    law = find_law(name)
    if law.elements:
        along, at_rest = _elements_along(law)
        return Bundle(elements=law.elements, plain=0, along=along, at_rest=at_rest, **element_terms(law))
    single: dict[str, Any] = {"elements": 0, "at_rest": bristle_at_rest, "share_out": _no_share, "bristle": _no_bristle}
    if law.moved is None and law.passed is None:
        return Bundle(plain=1, along=bristle_along, predicted=predicted, step=followed_bristle, **single)
    return Bundle(plain=0, along=_single_along(law), **bristle_terms(law), **single)


def _single_along(law: Law) -> Any:
    """`bristle_along` of a law with one bristle, piece by piece."""
    passed = law.passed if law.passed is not None else _by_simpson(law)

    @inlined
    def along(axis, bristles, resistance, told, w, way, want_means):
        own, breakaway = own_of(axis), bristles.coulomb / bristles.sigma_0
        pieces = pieces_of(way)
        done = mean = late = 0.0  # of the way
        for piece in range(pieces):
            done, part, rest = piece_of(bristles, resistance, told, piece, pieces, way, done)
            w, whole, second = passed(w, part, rest, breakaway, own)
            mean += whole / pieces
            late += (piece * whole + second) / pieces**2
        return w, mean, late

    return along


def _by_simpson(law: Law) -> Any:
    """`Law.passed` of a law that knows where a travel ends, by Simpson's rule for the means."""
    moved = law.moved

    @inlined
    def passed(w, travel, rest, breakaway, own):
        splits, steady = 1, abs(w - math.copysign(rest, travel)) <= _STEADY * rest
        if not steady:
            splits = min(1 + int(abs(travel) / (_SPLIT * rest)), _SPLITS)
        step, mean, late = travel / splits, 0.0, 0.0
        for split in range(splits):
            if steady:
                end = moved(w, step, rest, breakaway, own)
                middle = 0.5 * (w + end)
            else:
                middle = moved(w, 0.5 * step, rest, breakaway, own)
                end = moved(middle, 0.5 * step, rest, breakaway, own)
            whole = (w + 4.0 * middle + end) / 6.0
            mean += whole / splits
            late += (split * whole + (2.0 * middle + end) / 6.0) / splits**2
            w = end
        return w, mean, late

    return passed


def _elements_along(law: Law) -> tuple[Any, Any]:
    """`bristle_along` and `bristle_at_rest` of springs side by side, exact between samples."""
    shape, count = law.shape, law.elements

    @inlined
    def along(axis, bristles, resistance, told, w, way, want_means):
        p, own = axis.p, own_of(axis)
        pieces = pieces_of(way)
        done = mean = late = 0.0  # of the way
        for piece in range(pieces):
            done, part, rest = piece_of(bristles, resistance, told, piece, pieces, way, done)
            w = whole = second = 0.0
            for k in range(count):
                share, stiff = shape(k, own)
                most = share * rest / stiff
                x = min(max(p[ELEMENT_START + k], -most), most)
                end = min(max(x + part, -most), most)
                until = 1.0 if part == 0.0 else min(1.0, abs((end - x) / part))  # of the piece, that it sticks for
                if want_means:
                    whole += stiff * (end + 0.5 * until * (x - end))
                    second += stiff * (0.5 * end + until * until * (x - end) / 6.0)
                p[ELEMENT_START + k] = end
                w += stiff * end
            mean += whole / pieces
            late += (piece * whole + second) / pieces**2
        return w, mean, late

    @inlined
    def at_rest(axis, bristles, resistance, w, force, dt):
        # What the encoder does not show: the travel that takes the elements to the balance of forces.
        p, own, sigma_0 = axis.p, own_of(axis), bristles.sigma_0
        most = resistance.level * (bristles.static + resistance.load)
        held = min(max(force / resistance.factor, -most), most) / sigma_0
        missing = min(1.0, dt / REST_AVERAGE) * (held - w)
        free = 0.0
        for k in range(count):
            share, stiff = shape(k, own)
            if abs(stiff * sigma_0 * p[ELEMENT_START + k]) < share * most or missing * p[ELEMENT_START + k] < 0.0:
                free += stiff
        w = 0.0
        for k in range(count):
            share, stiff = shape(k, own)
            limit = share * most / (stiff * sigma_0)
            x = p[ELEMENT_START + k] + (missing / free if free > 0.0 else 0.0)
            p[ELEMENT_START + k] = min(max(x, -limit), limit)
            w += stiff * p[ELEMENT_START + k]
        return w

    return along, at_rest
