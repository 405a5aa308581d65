"""The terms of motors and effects, bound to their places in the flat vector and chained into one function per term.

A kernel takes them as its first argument (bundle.py). One
guarded set serves every choice of effects (`if on & bit`), a bare one all motors without effects; a specialised one
holds only what is active.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

from linid.physics.effects.effect import INPUTS, STATELESS, Effect
from linid.physics.effects.registry import EFFECTS, active_mask
from linid.physics.laws.registry import LUGRE
from linid.physics.model import EFFECT_SLOTS, ELAPSED, RECORD, STATE_PLACES, STATE_SIZE, STATE_START, Model
from linid.physics.own_terms.layout import FORCE_BIT, LEVEL_BIT, LOAD_BIT, MEMORY_BIT, TIME_BIT
from linid.simulation import own_terms
from linid.simulation.binding import inlined, part, values_at
from linid.simulation.bundle import Bundle
from linid.simulation.laws import law_terms
from linid.simulation.motor_terms import motor_terms

_RESISTING = ("level", "load", "advance")  # terms of hidden states and friction


def bits_of(term: str, effects: tuple[Effect, ...]) -> int:
    """The bits of those effects that have a term."""
    return sum(1 << EFFECTS.index(effect) for effect in effects if term in effect.terms)


def _stateful(term: str, effects: tuple[Effect, ...]) -> int:
    """The bits of those effects whose term takes hidden states."""
    return bits_of(term, tuple(effect for effect in effects if term in effect.terms and effect.states_of(term)))


def _places(effect: Effect, term: str) -> Bundle:
    """Where in `p` a term's last arguments are: its hidden states and parameters."""
    count = 0 if term in STATELESS else effect.states_of(term)
    first = STATE_START + STATE_PLACES.get(effect.name, 0) + (STATE_SIZE if term == "advance" else 0)
    states = [first + k if effect.states else None for k in range(count)]  # a term may take some that nothing advances
    return Bundle(places=(*states, *(EFFECT_SLOTS[parameter.name] for parameter in effect.parameters)))


# What one effect more makes of a term's value. `rest` are the effects before it, `term` its own function, `bit` tells
# whether it is on, `where` its states and parameters are in the flat vector.


def _constant(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
    @inlined
    def total(value, on, p):
        value = rest(value, on, p)
        if on & bit:
            value += term(*values_at(p, where))
        return value

    return total


def _heavier(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
    @inlined
    def total(value, on, p):
        value = rest(value, on, p)
        if on & bit:
            value += term(p[RECORD], *values_at(p, where))
        return value

    return total


def _added(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
    @inlined
    def total(value, on, t, y, v, currents, p):
        value = rest(value, on, t, y, v, currents, p)
        if on & bit:
            value += term(t, y, v, *currents, p[RECORD], p[ELAPSED] + t, *values_at(p, where))
        return value

    return total


def _scaled(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
    @inlined
    def total(value, on, t, y, v, currents, p):
        value = rest(value, on, t, y, v, currents, p)
        if on & bit:
            value *= term(t, y, v, *currents, p[RECORD], p[ELAPSED] + t, *values_at(p, where))
        return value

    return total


def _loaded(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
    @inlined
    def total(value, on, push, t, y, v, currents, p):
        value = rest(value, on, push, t, y, v, currents, p)
        if on & bit:
            value += term(push, t, y, v, *currents, p[RECORD], p[ELAPSED] + t, *values_at(p, where))
        return value

    return total


def _moved(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
    @inlined
    def total(value, on, t, y, v, currents, p):
        value = rest(value, on, t, y, v, currents, p)
        if on & bit:
            value = term(t, value, v, *currents, p[RECORD], p[ELAPSED] + t, *values_at(p, where))
        return value

    return total


def _driven(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
    @inlined
    def total(on, t, y, v, currents, p):
        currents = rest(on, t, y, v, currents, p)
        if on & bit:
            currents = term(t, y, v, *currents, p[RECORD], p[ELAPSED] + t, *values_at(p, where))
        return currents

    return total


def _started(rest: Any, term: Any, bit: int, where: Bundle, place: int, count: int) -> Any:
    @inlined
    def total(on, t, y, v, currents, p):
        rest(on, t, y, v, currents, p)
        if on & bit:
            states = term(t, y, v, *currents, p[RECORD], p[ELAPSED] + t, *values_at(p, where))
            for k in range(count):
                p[place + k] = states[k]

    return total


def _advanced(rest: Any, term: Any, bit: int, where: Bundle, place: int, count: int) -> Any:
    @inlined
    def total(on, h, t, y, v, a, currents, p):
        rest(on, h, t, y, v, a, currents, p)
        if on & bit:
            states = term(h, t, y, v, a, *currents, p[RECORD], p[ELAPSED] + t, *values_at(p, where))
            for k in range(count):
                p[place + k] = states[k]

    return total


@inlined
def _no_scalar(value, on, p):
    return value


@inlined
def _no_value(value, on, t, y, v, currents, p):
    return value


@inlined
def _no_load(value, on, push, t, y, v, currents, p):
    return value


@inlined
def _no_drive(on, t, y, v, currents, p):
    return currents


@inlined
def _no_start(on, t, y, v, currents, p):
    pass


@inlined
def _no_advance(on, h, t, y, v, a, currents, p):
    pass


# The same for all samples of a motion at once, each effect in a loop of its own: such become vector instructions.
# `samples` as of along_effects.py; `out` holds what they make of the term's values, in place.


def _over(rest: Any, term: Any, bit: int, where: Bundle, *, joined: Any, place: Any) -> Any:
    """joined(value, new): what the term makes of a value; place(samples, out, k): where it acts, m."""

    @inlined
    def total(out, on, samples, p):
        rest(out, on, samples, p)
        if on & bit:
            others, record, elapsed = values_at(p, where), p[RECORD], p[ELAPSED]
            for k in range(out.size):
                t, y = samples.t_start + k * samples.dt, place(samples, out, k)
                currents = samples.i_1[k], samples.i_2[k], samples.i_3[k]
                new = term(t, y, samples.v[k], *currents, record, elapsed + t, *others)
                out[k] = joined(out[k], new)

    return total


@inlined
def _measured_place(samples, out, k):
    return samples.y[k]


@inlined
def _place_so_far(samples, out, k):
    return out[k]


@inlined
def _sum(value, new):
    return value + new


@inlined
def _product(value, new):
    return value * new


@inlined
def _replaced(value, new):
    return new


def _driven_over(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
    @inlined
    def total(out, on, samples, p):
        rest(out, on, samples, p)
        if on & bit:
            others, record, elapsed = values_at(p, where), p[RECORD], p[ELAPSED]
            for k in range(samples.y.size):
                t = samples.t_start + k * samples.dt
                currents = out[0, k], out[1, k], out[2, k]
                given = term(t, samples.y[k], samples.v[k], *currents, record, elapsed + t, *others)
                out[0, k], out[1, k], out[2, k] = given

    return total


def _loaded_over(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
    """push: the motor's force in N at all samples."""

    @inlined
    def total(out, push, on, samples, p):
        rest(out, push, on, samples, p)
        if on & bit:
            others, record, elapsed = values_at(p, where), p[RECORD], p[ELAPSED]
            for k in range(out.size):
                t = samples.t_start + k * samples.dt
                currents = samples.i_1[k], samples.i_2[k], samples.i_3[k]
                out[k] += term(push[k], t, samples.y[k], samples.v[k], *currents, record, elapsed + t, *others)

    return total


@inlined
def _nothing_over(out, on, samples, p):
    pass


@inlined
def _no_load_over(out, push, on, samples, p):
    pass


_OVER: dict[str, tuple[Any, Callable[..., Any]]] = {
    "drive": (_nothing_over, _driven_over),
    "field": (_nothing_over, partial(_over, joined=_replaced, place=_place_so_far)),
    "thrust": (_nothing_over, partial(_over, joined=_product, place=_measured_place)),
    "force": (_nothing_over, partial(_over, joined=_sum, place=_measured_place)),
    "friction": (_nothing_over, partial(_over, joined=_product, place=_measured_place)),
    "level": (_nothing_over, partial(_over, joined=_product, place=_measured_place)),
    "load": (_no_load_over, _loaded_over),
    "sensor": (_nothing_over, partial(_over, joined=_sum, place=_measured_place)),
}


def _chain_over(term: str, effects: tuple[Effect, ...]) -> Any:
    """One function for a term of all effects without states at all samples, in their order."""
    total, link = _OVER[term]
    for effect in effects:
        if term in effect.terms and not effect.states_of(term):
            function = inlined(effect.terms[term].py_func)
            total = link(total, function, 1 << EFFECTS.index(effect), _places(effect, term))
    return total


_CHAINS: dict[str, tuple[Any, Callable[..., Any]]] = {
    "delay": (_no_scalar, _constant),
    "mass": (_no_scalar, _heavier),
    "static": (_no_scalar, _constant),
    "drive": (_no_drive, _driven),
    "field": (_no_value, _moved),
    "thrust": (_no_value, _scaled),
    "force": (_no_value, _added),
    "friction": (_no_value, _scaled),
    "level": (_no_value, _scaled),
    "load": (_no_load, _loaded),
    "pushed": (_no_load, _loaded),
    "sensor": (_no_value, _added),
    "initial": (_no_start, _started),
    "advance": (_no_advance, _advanced),
}


def _chain(term: str, effects: tuple[Effect, ...]) -> Any:
    """One function for a term of all effects, in their order."""
    total, link = _CHAINS[term]
    for effect in effects:
        if term in effect.terms:
            known = [total, part(effect.terms[term]), 1 << EFFECTS.index(effect), _places(effect, term)]
            if term in ("initial", "advance"):
                known += [STATE_START + STATE_PLACES[effect.name], effect.states]
            total = link(*known)
    return total


# What own terms make of a term's value, and the bit that switches them on.
_OWN: dict[str, tuple[Callable[[Any], Any], int]] = {
    "pushed": (partial(own_terms.with_own, part=own_terms.FORCE, bit=FORCE_BIT), FORCE_BIT),
    "load": (partial(own_terms.with_own, part=own_terms.LEVEL, bit=LEVEL_BIT), LEVEL_BIT),
    "initial": (own_terms.with_memory_start, MEMORY_BIT),
    "advance": (own_terms.with_memory, MEMORY_BIT),
}


@cache  # kernels of one process share what they have in common
def terms_of(model: Model | None = None, bare: bool = False, law: str = LUGRE) -> Bundle:
    """The terms of all motors and effects, guarded (None), of one model alone, or of all motors without effects.

    law: of friction, whose steps these are.

    One compiled function per term, of all effects: delay, mass and static(value, on, p); drive(on, t, y, v,
    currents, p) -> currents; initial(on, t, y, v, currents, p) and advance(on, h, t, y, v, a, currents, p) change p;
    load and pushed (N on the mass by the motor's force) (value, on, push, t, y, v, currents, p); all others (value, on,
    t, y, v, currents, p) -> value. motor: its terms (motor_terms.py); law: those of the friction law (laws.py); acts:
    per term the bits of all effects, and of own terms, that have it, besides `any`, `push` (what changes the forces on
    the mass), `pressed` (what makes friction of the motor's force), `push_by_inputs` (forces beside the motor's that
    hang on what it gets), `by_inputs` (hidden states and friction that do) and `timed` (what hangs on time); chosen,
    always: bits that the caller of the kernel chooses, and that it has when it is compiled.
    """
    effects = EFFECTS if model is None else tuple(e for e in EFFECTS if e.name in model.effects)
    if bare:
        effects = ()
    known = 0 if bare else None if model is None else model.mask
    bits = {term: bits_of(term, effects) for term in _CHAINS}
    chains = {term: _chain(term, effects) for term in _CHAINS}
    own = 0
    for term, (link, bit) in _OWN.items():
        if known is None or known & bit:
            own |= bit
            bits[term] |= bit
            chains[term] = link(chains[term])
    pressed = bits_of("load", effects) | (own & LEVEL_BIT and LOAD_BIT)
    guards = {
        **bits,
        "pressed": pressed,
        "any": sum(1 << EFFECTS.index(effect) for effect in effects) | own,
        "push": bits["drive"] | bits["field"] | bits["thrust"] | bits["force"] | bits["pushed"],
        "push_by_inputs": active_mask(tuple(e.name for e in effects if e.pushes_by_inputs)),
        "timed": active_mask(tuple(e.name for e in effects if e.reads(e.terms, "t", "elapsed"))) | (own and TIME_BIT),
        "by_inputs": pressed | active_mask(tuple(e.name for e in effects if e.reads(_RESISTING, *INPUTS))),
        **{f"stateful_{term}": _stateful(term, effects) for term in _OVER},
    }
    return Bundle(
        motor=motor_terms(None if model is None else model.motor),
        law=law_terms(law),
        acts=Bundle(**guards),
        chosen=-1 if known is None else 0,
        always=known or 0,
        over=Bundle(**{term: _chain_over(term, effects) for term in _OVER}),
        **chains,
    )
