"""Steps of a simulation under friction laws beside LuGre's: a bristle of any law, and springs that stick or slip."""

from __future__ import annotations

import math
from typing import Any

from linid.physics.friction import linear_step, stribeck
from linid.physics.laws.law import Law
from linid.physics.model import ELEMENT_START, LAW_START
from linid.simulation.binding import inlined
from linid.simulation.course import FINEST
from linid.simulation.steps import REVERSAL_WEIGHT, Middle, friction_at

_LEAST = 1e-12  # of the steady deflection, where a bristle counts as straight, or a spring as bent to its limit


@inlined
def own_of(axis):
    """The parameters that a law has besides LuGre's."""
    p = axis.p
    return p[LAW_START], p[LAW_START + 1], p[LAW_START + 2], p[LAW_START + 3]


def bristle_terms(law: Law) -> dict[str, Any]:
    """`predicted` and `step` of a law with one bristle, w' = v rate(w, sign v, g(v))."""
    rate = law.rate

    @inlined
    def linearised(axis, bristles, v, w, level, fall):
        """The bristle's rate in m/s, how it falls with w in 1/s, how it rises with v, and its relaxation in 1/s."""
        rest, breakaway = level / bristles.sigma_0, bristles.coulomb / bristles.sigma_0
        own = own_of(axis)
        value, by_w, by_rest = rate(w, math.copysign(1.0, v), rest, breakaway, own)
        relaxing = -v * by_w if abs(w) < _LEAST * rest else v * (1.0 - value) / w
        return v * value, -v * by_w, value + by_rest * fall / level, max(relaxing, 0.0)

    @inlined
    def predicted(terms, axis, bristles, motion, t, halvings, tick, tolerance):
        y, v, w, force, currents, spring = motion
        stiffness, damping = spring
        level, fall = friction_at(terms, axis, bristles, t, y, v, currents)
        w_rate, _, _, relaxing = linearised(axis, bristles, v, w, level, fall)
        while True:  # until the step is short enough
            h = (1 << (FINEST - halvings)) * tick
            half = 0.5 * h
            # Half a step by implicit Euler: first order and L-stable, which is enough for a predictor.
            relax = 1.0 / (1.0 + half * relaxing)
            pull = half * (stiffness - damping * relaxing) * relax
            v_mid = (bristles.mass * v + half * force - pull * w) / (
                bristles.mass + half * (damping + bristles.sigma_2 + pull)
            )
            w_mid = (w + half * v_mid) * relax
            level, fall = friction_at(terms, axis, bristles, t + half, y + half * v_mid, v_mid, currents)
            at_mid, falling, slope, _ = linearised(axis, bristles, v_mid, w_mid, level, fall)
            # How far the linearised rate is off where the step begins, in parts of the friction force.
            off = abs(w_rate - (at_mid + falling * (w_mid - w) + slope * (v - v_mid)))
            if v * (2.0 * v_mid - v) < 0.0:
                off *= REVERSAL_WEIGHT
            swing = off * h * bristles.sigma_0 / level
            allowed = tolerance * (1.0 + falling * h)
            if halvings >= FINEST or not swing > allowed:
                return Middle(v_mid, w_mid, level, fall, halvings, swing, allowed)
            halvings += 1

    @inlined
    def step(axis, bristles, v, w, at_middle, outer, body, h):
        v_mid, w_mid, level, fall = at_middle
        force, force_rate = outer
        mass, stiffness, damping, _ = body
        # Effects may scale the whole bristle, level and stiffness alike.
        scale = bristles.sigma_0 / stiffness
        at_mid, falling, slope, _ = linearised(axis, bristles, v_mid, w_mid, level * scale, fall * scale)
        falling = max(falling, 0.0)
        lowest = max(-1.0, -0.5 * mass * falling / (h * (stiffness + damping * falling)))
        slope = min(max(slope, lowest), 2.0)
        w_rate = at_mid + falling * (w_mid - w) + slope * (v - v_mid)
        return linear_step(v, w, (w_rate, falling, slope), force, force_rate, body, h)

    return {"predicted": predicted, "step": step}


@inlined
def slips(x, most, way):
    """Whether an element at x m slips when it goes that way; most: deflection in m that it can hold."""
    return x * way > 0.0 and abs(x) >= most * (1.0 - _LEAST)


def element_terms(law: Law) -> dict[str, Any]:
    """What the kernels need of springs side by side, besides what is said along a motion."""
    shape, count = law.shape, law.elements

    @inlined
    def bristle(axis, bristles):
        """What a single bristle would bend to pull as all elements do, in m."""
        own, w = own_of(axis), 0.0
        for k in range(count):
            w += shape(k, own)[1] * axis.p[ELEMENT_START + k]
        return w

    @inlined
    def share_out(axis, bristles, w):
        """Bend the elements for a deflection w in m: each to the same share of its limit, as steady sliding does."""
        own = own_of(axis)
        for k in range(count):
            share, stiff = shape(k, own)
            axis.p[ELEMENT_START + k] = share * w / stiff

    predicted, step = _elements_predicted(law), _elements_step(law)
    return {"predicted": predicted, "step": step, "share_out": share_out, "bristle": bristle}


def _elements_predicted(law: Law) -> Any:
    """The middle of a followed step of springs side by side, and how long it may be."""
    shape, count = law.shape, law.elements

    @inlined
    def predicted(terms, axis, bristles, motion, t, halvings, tick, tolerance):
        y, v, w, force, currents, spring = motion
        stiffness, damping = spring
        p, own, sigma_0, mass = axis.p, own_of(axis), bristles.sigma_0, bristles.mass
        rest = friction_at(terms, axis, bristles, t, y, v, currents)[0] / sigma_0
        way = v if v != 0.0 else force - stiffness * w
        stuck = 0.0  # share of the stiffness
        for k in range(count):
            share, stiff = shape(k, own)
            if not slips(p[ELEMENT_START + k], share * rest / stiff, way):
                stuck += stiff
        whole = (1 << (FINEST - halvings)) * tick
        while True:  # until no element changes between sticking and slipping by much
            h = (1 << (FINEST - halvings)) * tick
            half = 0.5 * h
            pull = half * stuck * stiffness
            v_mid = (mass * v + half * (force - stiffness * w)) / (
                mass + half * (stuck * damping + bristles.sigma_2 + pull)
            )
            level, fall = friction_at(terms, axis, bristles, t + half, y + half * v_mid, v_mid, currents)
            rest_mid = level / sigma_0
            # Travel before the motion turns within the step, which slipping elements do not feel.
            turned = v * (2.0 * v_mid - v) < 0.0
            before = half * v * v / (2.0 * abs(v_mid - v)) if turned else 0.0
            w_mid, off = 0.0, 0.0
            for k in range(count):
                share, stiff = shape(k, own)
                x, most = p[ELEMENT_START + k], share * rest_mid / stiff
                middle = min(max(x + half * v_mid, -most), most)
                end = min(max(middle + half * v_mid, -most), most)
                w_mid += stiff * middle
                # Travel over which the element does not do what it does in the middle.
                if slips(middle, most, v_mid):
                    gap = max(share * rest / stiff - math.copysign(1.0, v_mid) * x, 0.0)
                else:
                    gap = abs(x + h * v_mid - end)
                    if turned and slips(x, share * rest / stiff, v):
                        gap += 2.0 * before
                late = min(gap, h * abs(v_mid))
                off += stiff * (gap + late * damping / (stiffness * whole))
            swing = off * sigma_0 / level
            if halvings >= FINEST or not swing > tolerance:
                return Middle(v_mid, w_mid, level, fall, halvings, swing, tolerance)
            halvings += 1

    return predicted


def _elements_step(law: Law) -> Any:
    """A followed step of springs side by side, each sticking or slipping as in its middle."""
    shape, count = law.shape, law.elements

    @inlined
    def step(axis, bristles, v, w, at_middle, outer, body, h):
        v_mid, _, level, fall = at_middle
        force, force_rate = outer
        mass, stiffness, damping, viscous = body
        p, own = axis.p, own_of(axis)
        way = math.copysign(1.0, v_mid)
        stuck = slipping = 0.0
        for k in range(count):
            share, stiff = shape(k, own)
            x, most = p[ELEMENT_START + k], share * level / (stiff * stiffness)
            middle = min(max(x + 0.5 * h * v_mid, -most), most)
            if slips(middle, most, v_mid):
                slipping += share
            else:
                stuck += stiff
                force -= stiff * stiffness * x
        # The level that slips falls with speed as it does in the middle of the step.
        falling = fall / abs(v_mid) if v_mid != 0.0 else 0.0
        falling = max(falling, -0.5 * mass / h - viscous)
        force -= slipping * (level * way - falling * v_mid)
        v_new, displacement, _ = linear_step(
            v,
            0.0,
            (v, 0.0, 1.0),
            force,
            force_rate,
            (mass, stuck * stiffness, stuck * damping, viscous + slipping * falling),
            h,
        )
        coulomb, static, velocity, exponent = bristles[:4]
        limit = level / stribeck(v_mid, coulomb, static, velocity, exponent)
        limit *= stribeck(v_new, coulomb, static, velocity, exponent)
        w_new = 0.0
        for k in range(count):
            share, stiff = shape(k, own)
            most = share * limit / (stiff * stiffness)
            p[ELEMENT_START + k] = min(max(p[ELEMENT_START + k] + displacement, -most), most)
            w_new += stiff * p[ELEMENT_START + k]
        return v_new, w_new, displacement

    return step
