"""Compiled functions as plain Python: with all that they call, and with other functions under names of the modules."""

from __future__ import annotations

from collections.abc import Mapping
from types import CellType, FunctionType, ModuleType
from typing import Any

from linid.simulation.binding import values_at
from linid.simulation.bundle import Bundle


class Plain:
    """Turns compiled functions into plain ones; given: what they find under global names, such as `math` and `np`."""

    def __init__(self, given: Mapping[str, Any] | None = None) -> None:
        self._given = dict(given or {})
        self._known: dict[int, Any] = {}

    def of(self, value: Any) -> Any:
        """A compiled function, or a bundle of them, uncompiled; anything else as it is."""
        if value is values_at:
            return lambda p, where: tuple(0.0 if k is None else p[k] for k in where.places)
        if isinstance(value, Bundle):
            return Bundle(**{name: self.of(member) for name, member in value})
        if isinstance(value, ModuleType) and value.__name__.startswith("linid."):
            return _Room(self, value)
        function = getattr(value, "py_func", value)
        inside = isinstance(function, FunctionType) and function.__module__.startswith("linid.")
        if not inside:
            return value
        if id(function) not in self._known:
            names: dict[str, Any] = {}
            cells = tuple(CellType() for _ in function.__closure__ or ())
            plain = FunctionType(function.__code__, names, function.__name__, function.__defaults__, cells)
            self._known[id(function)] = plain  # before what it calls, which may call it
            for name, member in function.__globals__.items():
                if name in self._given or name in function.__code__.co_names or name == "__builtins__":
                    names[name] = self._given[name] if name in self._given else self.of(member)
            for cell, old in zip(cells, function.__closure__ or (), strict=True):
                cell.cell_contents = self.of(old.cell_contents)
        return self._known[id(function)]


class _Room:
    """A module whose compiled functions are plain ones, where they are reached through its name."""

    def __init__(self, plain: Plain, module: ModuleType) -> None:
        self._plain, self._module = plain, module

    def __getattr__(self, name: str) -> Any:
        return self._plain.of(getattr(self._module, name))
