"""The terms of motors and effects, bound to their places in the flat vector and chained into one function per term.

A kernel takes them as its first argument (bundle.py). One
guarded set serves every choice of effects (`if on & bit`), a bare one all motors without effects; a specialised one
holds only what is active.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from linid.physics import motors
from linid.physics.effects.effect import STATELESS, Effect
from linid.physics.effects.registry import EFFECTS
from linid.physics.model import EFFECT_SLOTS, ELAPSED, RECORD, STATE_PLACES, STATE_SIZE, STATE_START, Model
from linid.simulation.bundle import Bundle

# Functions that only kernels call: nothing is compiled for Python, and arrays, which the kernel keeps alive, are not
# counted at every call. What makes an array of its own is `allocating`.
_INNER: dict[str, Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_UNCOUNTED: dict[str, Any] = {**_INNER, "_nrt": False}
allocating = njit(**_INNER)
compiled = njit(**_UNCOUNTED)
inlined = njit(**_UNCOUNTED, forceinline=True)


@intrinsic  # type: ignore[untyped-decorator]
def _values_at(typing_context: Any, p: Any, where: Any) -> Any:
    """A tuple of those values of an array whose places a bundle names (`where.places`; None: 0.0).

    A loop over a tuple, or a view of the array, would cost more than the terms themselves.
    """
    places = where.bundle.places
    result = types.UniTuple(p.dtype, len(places))

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        word, number = ir.IntType(64), ir.DoubleType()
        items = [
            ir.Constant(number, 0.0) if k is None else builder.load(builder.gep(array.data, [ir.Constant(word, k)]))
            for k in places
        ]
        return context.make_tuple(builder, result, items)

    return result(p, where), code


values_at: Any = _values_at  # called with `p` and `where` alone


def bits_of(term: str, effects: tuple[Effect, ...]) -> int:
    """The bits of those effects that have a term."""
    return sum(1 << EFFECTS.index(effect) for effect in effects if term in effect.terms)


def _places(effect: Effect, term: str) -> Bundle:
    """Where in `p` a term's last arguments are: its hidden states and parameters."""
    count = 0 if term in STATELESS else effect.states_of(term)
    first = STATE_START + STATE_PLACES.get(effect.name, 0) + (STATE_SIZE if term == "advance" else 0)
    states = [first + k if effect.states else None for k in range(count)]  # a term may take some that nothing advances
    return Bundle(places=(*states, *(EFFECT_SLOTS[parameter.name] for parameter in effect.parameters)))


# What one effect more makes of a term's value. `rest` are the effects before it, `term` its own function, `bit` tells
# whether it is on, `where` its states and parameters are in the flat vector.


def _delayed(rest: Any, term: Any, bit: int, where: Bundle) -> Any:
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


@inlined
def _no_motor(motor, y, currents, p, table, harmonics, wavenumber, phase):
    return 0.0


_CHAINS: dict[str, tuple[Any, Callable[..., Any]]] = {
    "delay": (_no_scalar, _delayed),
    "mass": (_no_scalar, _heavier),
    "drive": (_no_drive, _driven),
    "field": (_no_value, _moved),
    "thrust": (_no_value, _scaled),
    "force": (_no_value, _added),
    "friction": (_no_value, _scaled),
    "level": (_no_value, _scaled),
    "load": (_no_load, _loaded),
    "sensor": (_no_value, _added),
    "initial": (_no_start, _started),
    "advance": (_no_advance, _advanced),
}


def _chain(term: str, effects: tuple[Effect, ...]) -> Any:
    """One function for a term of all effects, in their order."""
    total, link = _CHAINS[term]
    for effect in effects:
        if term in effect.terms:
            known = [total, effect.terms[term], 1 << EFFECTS.index(effect), _places(effect, term)]
            if term in ("initial", "advance"):
                known += [STATE_START + STATE_PLACES[effect.name], effect.states]
            total = link(*known)
    return total


@inlined
def _force_of_input(y, currents, p, table, harmonics, wavenumber, phase):
    return p[8] * currents[0]


@inlined
def _force_of_sine(y, currents, p, table, harmonics, wavenumber, phase):
    return motors.phase_force(y, currents[0], currents[1], currents[2], wavenumber, phase, table, harmonics)


@inlined
def _force_of_theta(y, currents, p, table, harmonics, wavenumber, phase):
    if harmonics > 0:
        return motors.phase_force(y, currents[0], currents[1], currents[2], wavenumber, phase, table, harmonics)
    return motors.gaussian_force(y, currents[0], currents[1], currents[2], p[8:14])


_MOTORS = {motors.FORCE: _force_of_input, motors.SINE: _force_of_sine, motors.THETA: _force_of_theta}


def _or_motor(rest: Any, code: int, force: Any) -> Any:
    @inlined
    def either(motor, y, currents, p, table, harmonics, wavenumber, phase):
        if motor == code:
            return force(y, currents, p, table, harmonics, wavenumber, phase)
        return rest(motor, y, currents, p, table, harmonics, wavenumber, phase)

    return either


def terms_of(model: Model | None = None, bare: bool = False) -> Bundle:
    """The terms of all motors and effects, guarded (None), of one model alone, or of all motors without effects.

    One compiled function per term, of all effects: delay(value, on, p) and mass(value, on, p); drive(on, t, y, v,
    currents, p) -> currents; initial(on, t, y, v, currents, p) and advance(on, h, t, y, v, a, currents, p) change p;
    load(value, on, push, t, y, v, currents, p); all others (value, on, t, y, v, currents, p) -> value. motor: its
    force; acts: per term the bits of all effects that have it, besides `any`, `push` (what changes the forces on the
    mass) and `between` (what acts between the samples of a measured motion); chosen, always: bits that the caller of
    the kernel chooses, and that are known when it is compiled.
    """
    effects = EFFECTS if model is None else tuple(e for e in EFFECTS if e.name in model.effects)
    if bare:
        effects = ()
    motor = _no_motor
    for code, force in _MOTORS.items():
        if model is None or model.motor == code:
            motor = _or_motor(motor, code, force)
    bits = {term: bits_of(term, effects) for term in _CHAINS}
    guards = {
        **bits,
        "any": sum(1 << EFFECTS.index(effect) for effect in effects),
        "push": bits["drive"] | bits["field"] | bits["thrust"] | bits["force"],
        "between": bits["level"] | bits["load"] | bits["advance"],
    }
    known = 0 if bare else None if model is None else model.mask
    return Bundle(
        motor=motor,
        acts=Bundle(**guards),
        chosen=-1 if known is None else 0,
        always=known or 0,
        **{term: _chain(term, effects) for term in _CHAINS},
    )
