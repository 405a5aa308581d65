"""Numbers side by side that a kernel computes with as with one: a vector register's worth of Jacobian columns.

Sums and products go lane by lane in plain IEEE arithmetic (nothing is fused or reordered): the bits of a lane hang on
its own numbers alone, whatever stands beside it and however wide the processor's registers are.
"""

from __future__ import annotations

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


class LanesType(types.Type):  # type: ignore[misc]
    """The numba type of `LANES` doubles side by side."""

    def __init__(self) -> None:
        super().__init__(f"Lanes({LANES})")


lanes_type = LanesType()


@register_default(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: LanesType) -> None:
        super().__init__(manager, kind, _VECTOR)


def _spread(builder: Any, value: Any) -> Any:
    """A double in all lanes."""
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), mask)


class _Arithmetic(AbstractTemplate):  # type: ignore[misc]
    """Lanes with lanes, or with a double that all of them share."""

    def generic(self, args: Any, kws: Any) -> Any:
        """The types of both operands, or None."""
        if len(args) == 2 and lanes_type in args and all(a in (lanes_type, types.float64) for a in args):
            return signature(lanes_type, *args)
        return None


def _register(function: Any, write: str) -> None:
    infer_global(function)(type(f"_Lanes_{function.__name__}", (_Arithmetic,), {"key": function}))

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        both = [
            value if kind is lanes_type else _spread(builder, value) for kind, value in zip(sig.args, args, strict=True)
        ]
        return getattr(builder, write)(*both)

    for kinds in ((lanes_type, lanes_type), (lanes_type, types.float64), (types.float64, lanes_type)):
        lower_builtin(function, *kinds)(code)


for _function, _write in ((operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul")):
    _register(_function, _write)


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


lanes_at: Any = _lanes_at  # called without the typing context
put_lanes: Any = _put_lanes


def padded(columns: int) -> int:
    """The least multiple of `LANES` that holds so many columns."""
    return -(-columns // LANES) * LANES
