"""How functions become part of a kernel: what compiles them, and how they get their parameters."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

# Functions that only kernels call: nothing is compiled for Python, and arrays, which the kernel keeps alive, are not
# counted at every call. What makes or hands on arrays is `allocating`. Whether a function is copied into its callers is
# always said: numba would take it from the function that happened to need it first.
_INNER: dict[str, Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_UNCOUNTED: dict[str, Any] = {**_INNER, "_nrt": False}
allocating = njit(**_INNER, forceinline=False)
compiled = njit(**_UNCOUNTED, forceinline=False)
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
