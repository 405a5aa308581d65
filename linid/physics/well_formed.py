"""What effects and motors, those of other packages among them, are checked for alike."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar

from linid.errors import ConfigError
from linid.physics.parameter import Parameter


class _Brought(Protocol):
    """What has a name, parameters, and compiled terms by name."""

    @property
    def name(self) -> str: ...

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    @property
    def terms(self) -> dict[str, Any]: ...


Kind = TypeVar("Kind", bound=_Brought)


def well_formed(one: Any, kind: type[Kind], place: str, fault: Callable[[Kind], str]) -> Kind:
    """What a package names itself, if it is well formed.

    one: what is found; kind: the class expected; place: to blame in messages; fault: what else is wrong with it, or
    nothing. Raises ConfigError that names what is wrong.
    """
    word = kind.__name__
    remedy = f"Correct the {word.lower()}'s file (see {kind.__module__.replace('.', '/')}.py), or uninstall its package"
    if not isinstance(one, kind):
        article = "an" if word[0] in "AEIO" else "a"
        raise ConfigError(place, f"found {type(one).__name__}, {article} {word} is expected", remedy)
    found = _fault_of_parts(one) or fault(one)
    if found:
        raise ConfigError(f"{place}, {word.lower()} {one.name!r}", found, remedy)
    return one


def _fault_of_parts(one: _Brought) -> str:
    """What is wrong with the name, the parameters or the terms, or nothing."""
    names = [parameter.name for parameter in one.parameters]
    if not one.name.isidentifier():
        return "its name is not an identifier"
    if len(set(names)) < len(names):
        return "two of its parameters have the same name"
    for parameter in one.parameters:
        if not parameter.lower <= parameter.default <= parameter.upper:
            return f"the default of {parameter.name!r} is outside its bounds"
        if parameter.log and parameter.lower <= 0.0:
            return f"{parameter.name!r} has a logarithmic scale and a lower bound that is not above 0"
    for name, function in one.terms.items():
        if not hasattr(function, "py_func"):
            return f"its term `{name}` is not compiled (decorate it with @term)"
    return ""


def fault_of_arguments(name: str, function: Any, expected: Sequence[str]) -> str:
    """What is wrong with how many arguments a compiled term takes, or nothing."""
    found = len(inspect.signature(function.py_func).parameters)
    if found != len(expected):
        return f"its term `{name}` takes {found} arguments, expected {len(expected)}: " + ", ".join(expected)
    return ""
