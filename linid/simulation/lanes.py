"""Numbers side by side that a kernel computes with as with one: a vector register's worth of columns or simulations.

All goes lane by lane in plain IEEE arithmetic (nothing is fused or reordered): the bits of a lane hang on its own
numbers alone, whatever stands beside it and however wide the processor's registers are.
"""

from __future__ import annotations

import math
import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic

LANES = 8  # two registers of AVX2, one of AVX-512

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_MASK = ir.VectorType(ir.IntType(1), LANES)
_WORDS = ir.VectorType(ir.IntType(64), LANES)


class LanesType(types.Type):  # type: ignore[misc]
    """The numba type of `LANES` doubles side by side."""

    def __init__(self) -> None:
        super().__init__(f"Lanes({LANES})")


class MaskType(types.Type):  # type: ignore[misc]
    """The numba type of `LANES` truths side by side."""

    def __init__(self) -> None:
        super().__init__(f"Mask({LANES})")


lanes_type = LanesType()
mask_type = MaskType()


@register_default(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: LanesType) -> None:
        super().__init__(manager, kind, _VECTOR)


@register_default(MaskType)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: MaskType) -> None:
        super().__init__(manager, kind, _MASK)


def _spread(builder: Any, value: Any) -> Any:
    """A double in all lanes."""
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), mask)


def _is_one(kinds: Any) -> bool:
    """Whether these are the types of lanes with lanes, or with a double that all of them share."""
    return lanes_type in kinds and all(kind in (lanes_type, types.float64) for kind in kinds)


def _all_lanes(builder: Any, kinds: Any, values: Any) -> list[Any]:
    return [value if kind is lanes_type else _spread(builder, value) for kind, value in zip(kinds, values, strict=True)]


def _register(function: Any, result: Any, write: Any) -> None:
    """Have a binary operator of lanes written by `write` (builder, a, b)."""

    class Operation(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, args: Any, kws: Any) -> Any:
            """The types of both operands, or None."""
            return signature(result, *args) if len(args) == 2 and _is_one(args) else None

    infer_global(function)(Operation)

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return write(builder, *_all_lanes(builder, sig.args, args))

    for kinds in ((lanes_type, lanes_type), (lanes_type, types.float64), (types.float64, lanes_type)):
        lower_builtin(function, *kinds)(code)


def _register_own(function: Any, kind: Any, count: int, write: Any) -> None:
    """Have an operator or function of `count` operands of one kind, which it keeps, written by `write`."""
    given = (kind,) * count

    class Operation(AbstractTemplate):  # type: ignore[misc]
        key = function

        def generic(self, args: Any, kws: Any) -> Any:
            """The types of the operands, or None."""
            return signature(kind, *args) if tuple(args) == given else None

    infer_global(function)(Operation)
    lower_builtin(function, *given)(lambda context, builder, sig, args: write(builder, *args))


def _by_llvm(name: str) -> Any:
    def write(builder: Any, *args: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * len(args))
        return builder.call(builder.module.declare_intrinsic(f"{name}.v{LANES}f64", (), kind), args)

    return write


_ARITHMETIC = {operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul", operator.truediv: "fdiv"}
_COMPARISONS = {operator.lt: "<", operator.le: "<=", operator.gt: ">", operator.ge: ">=", operator.eq: "=="}
for _function, _name in _ARITHMETIC.items():
    _register(_function, lanes_type, lambda builder, a, b, name=_name: getattr(builder, name)(a, b))
for _function, _name in _COMPARISONS.items():  # false where one is no number
    _register(_function, mask_type, lambda builder, a, b, name=_name: builder.fcmp_ordered(name, a, b))
_register(operator.ne, mask_type, lambda builder, a, b: builder.fcmp_unordered("!=", a, b))
_register_own(operator.neg, lanes_type, 1, lambda builder, a: builder.fneg(a))
_register_own(abs, lanes_type, 1, _by_llvm("llvm.fabs"))
_register_own(math.sqrt, lanes_type, 1, _by_llvm("llvm.sqrt"))
_register(math.copysign, lanes_type, _by_llvm("llvm.copysign"))
_register_own(operator.and_, mask_type, 2, lambda builder, a, b: builder.and_(a, b))
_register_own(operator.or_, mask_type, 2, lambda builder, a, b: builder.or_(a, b))
_register_own(operator.invert, mask_type, 1, lambda builder, a: builder.not_(a))


def _pointer(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), _VECTOR.as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def _lanes_at(typing_context: Any, array: Any, at: Any) -> Any:
    """The lanes that begin at item number `at` of a contiguous array, counted through all its rows."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_pointer(context, builder, sig.args[0], args[0], args[1]), align=8)

    return lanes_type(array, types.intp), code


@intrinsic  # type: ignore[untyped-decorator]
def _put_lanes(typing_context: Any, array: Any, at: Any, value: Any) -> Any:
    """Put lanes into a contiguous array from item number `at` on."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        builder.store(args[2], _pointer(context, builder, sig.args[0], args[0], args[1]), align=8)
        return context.get_dummy_value()

    return types.none(array, types.intp, lanes_type), code


@intrinsic  # type: ignore[untyped-decorator]
def _gathered(typing_context: Any, array: Any, at: Any) -> Any:
    """For each lane the item of a contiguous array whose number it holds."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        data = context.make_array(sig.args[0])(context, builder, args[0]).data
        places = builder.fptosi(args[1], _WORDS)
        out = ir.Constant(_VECTOR, ir.Undefined)
        for lane in range(LANES):
            number = ir.Constant(ir.IntType(32), lane)
            item = builder.load(builder.gep(data, [builder.extract_element(places, number)]))
            out = builder.insert_element(out, item, number)
        return out

    return lanes_type(array, lanes_type), code


@intrinsic  # type: ignore[untyped-decorator]
def _select(typing_context: Any, mask: Any, a: Any, b: Any) -> Any:
    """`a` where the mask holds, `b` elsewhere; either may be a double that all lanes share."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(args[0], *_all_lanes(builder, sig.args[1:], args[1:]))

    return lanes_type(mask, a, b), code


@intrinsic  # type: ignore[untyped-decorator]
def _bits_of(typing_context: Any, mask: Any) -> Any:
    """The mask as an integer, whose bit k is lane k's; 0 where it holds nowhere."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(LANES)), ir.IntType(64))

    return types.int64(mask), code


@intrinsic  # type: ignore[untyped-decorator]
def _count_of(typing_context: Any, mask: Any) -> Any:
    """In how many lanes the mask holds."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.ctpop(builder.zext(builder.bitcast(args[0], ir.IntType(LANES)), ir.IntType(64)))

    return types.int64(mask), code


def _words(builder: Any, value: int) -> Any:
    return ir.Constant(_WORDS, [value] * LANES)


@intrinsic  # type: ignore[untyped-decorator]
def _scaled(typing_context: Any, x: Any, shifted: Any) -> Any:
    """x 2^n, with n + 1.5 2^52 given (-1022 to 1023), whose last bits are those of n."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.shl(builder.bitcast(args[1], _WORDS), _words(builder, 52))
        power = builder.bitcast(builder.add(bits, _words(builder, 1023 << 52)), _VECTOR)
        return builder.fmul(args[0], power)

    return lanes_type(x, shifted), code


@intrinsic  # type: ignore[untyped-decorator]
def _has_bit(typing_context: Any, shifted: Any, bit: Any) -> Any:
    """Whether n, with n + 1.5 2^52 given, has that bit (1, 2, ...)."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        spread = builder.bitcast(_spread(builder, builder.bitcast(args[1], ir.DoubleType())), _WORDS)
        kept = builder.and_(builder.bitcast(args[0], _WORDS), spread)
        return builder.icmp_unsigned("!=", kept, _words(builder, 0))

    return mask_type(shifted, types.int64), code


@intrinsic  # type: ignore[untyped-decorator]
def _parts_of(typing_context: Any, x: Any) -> Any:
    """Exponent of 2 and fraction (1 to 2) of normal positive numbers."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.bitcast(args[0], _WORDS)
        fraction = builder.or_(builder.and_(bits, _words(builder, (1 << 52) - 1)), _words(builder, 1023 << 52))
        number = builder.or_(builder.lshr(bits, _words(builder, 52)), _words(builder, 1075 << 52))  # + 2^52
        exponent = builder.fsub(builder.bitcast(number, _VECTOR), ir.Constant(_VECTOR, [2.0**52 + 1023.0] * LANES))
        return context.make_tuple(builder, sig.return_type, [exponent, builder.bitcast(fraction, _VECTOR)])

    return types.UniTuple(lanes_type, 2)(x), code


lanes_at: Any = _lanes_at  # called without the typing context
put_lanes: Any = _put_lanes
gathered: Any = _gathered
select: Any = _select
bits_of: Any = _bits_of
count_of: Any = _count_of
scaled: Any = _scaled
has_bit: Any = _has_bit
parts_of: Any = _parts_of


def padded(columns: int) -> int:
    """The least multiple of `LANES` that holds so many columns."""
    return -(-columns // LANES) * LANES
