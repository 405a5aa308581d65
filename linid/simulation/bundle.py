"""Compiled functions and constant integers under names, which other compiled functions take as one argument.

The compiler knows them by the argument's type and resolves `bundle.name` when it compiles; nothing is passed at run
time. (A tuple of functions would do the same, but passes their addresses, and code with addresses is not cached.)
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import imputils, typing
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.types import Opaque
from numba.extending import typeof_impl


class Bundle:
    """Compiled functions, integers or further bundles by name; plain Python uses them likewise."""

    def __init__(self, **members: Any) -> None:
        self.__dict__.update(members)
        self.numba_type = BundleType(self)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"the bundle has no {name!r}")

    def __iter__(self) -> Any:
        return (item for item in self.__dict__.items() if item[0] != "numba_type")


class BundleType(Opaque):  # type: ignore[misc]
    """The numba type of one bundle: each has its own."""

    def __init__(self, bundle: Bundle) -> None:
        self.bundle = bundle
        super().__init__(f"Bundle({id(bundle):#x})")


register_default(BundleType)(models.OpaqueModel)


@typeof_impl.register(Bundle)  # type: ignore[untyped-decorator, no-untyped-call]
def _type_of(value: Bundle, context: Any) -> BundleType:
    del context
    return value.numba_type


@typing.templates.infer_getattr
class _Members(typing.templates.AttributeTemplate):  # type: ignore[misc]
    key = BundleType

    def generic_resolve(self, bundle: BundleType, name: str) -> Any:  # type: ignore[override]
        """The type of a member, or None if there is none."""
        member = getattr(bundle.bundle, name, None)
        return None if member is None else self.context.resolve_value_type_prefer_literal(member)


@imputils.lower_getattr_generic(BundleType)  # type: ignore[untyped-decorator, no-untyped-call]
def _member(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    """The constant; nothing for a function or a bundle, which the compiler knows by its type."""
    del builder, value
    member = getattr(kind.bundle, name)
    if isinstance(member, int):
        return ir.Constant(ir.IntType(64), member)
    return context.get_dummy_value()


@imputils.lower_constant(BundleType)  # type: ignore[untyped-decorator, no-untyped-call]
def _constant(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    del builder, kind, value
    return context.get_dummy_value()
