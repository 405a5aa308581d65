"""How functions become part of a kernel: what compiles them, and how they get their parameters."""

from __future__ import annotations

from functools import cache
from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering
from numba.extending import intrinsic


class _PartLibrary(JITCodeLibrary):  # type: ignore[misc]
    """Code that is linked into that of its callers and never called by itself: no machine code is made of it.

    numba would optimise and assemble every function with all that it calls, though only the entries of a kernel are
    ever run: a sixth of the time.
    """

    def _optimize_final_module(self) -> None:
        options = {"loop_vectorize": False, "slp_vectorize": False, "opt": self._codegen._opt_level, "cost": "cheap"}
        passes, builder = self._codegen._module_pass_manager(**options)
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        del name
        return 0  # as for all that Python cannot call

    @property
    def codegen(self) -> Any:
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Only what Python calls has an environment."""


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):  # type: ignore[misc]
    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return bool(super().run_pass(state))


class _PartCompiler(CompilerBase):  # type: ignore[misc]
    """numba's own compiler, but for what it does with the code in the end."""

    def define_pipelines(self) -> list[Any]:
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state, "part")
        passes.passes = [(_PartLowering if each is NativeLowering else each, text) for each, text in passes.passes]
        passes.finalize()
        return [passes]


# Functions that only kernels call: nothing is compiled for Python, and arrays, which the kernel keeps alive, are not
# counted at every call. What makes or hands on arrays is `allocating`. Whether a function is copied into its callers is
# always said: numba would take it from the function that happened to need it first.
_INNER: dict[str, Any] = {
    "error_model": "numpy",
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": _PartCompiler,
}
_UNCOUNTED: dict[str, Any] = {**_INNER, "_nrt": False}
allocating = njit(**_INNER, forceinline=False)
compiled = njit(**_UNCOUNTED, forceinline=False)
inlined = njit(**_UNCOUNTED, forceinline=True)


@cache
def part(function: Any) -> Any:
    """A compiled function that Python may call too, as a part of kernels alone: that compiles faster."""
    return allocating(function.py_func)


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
