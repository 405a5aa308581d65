"""Functions of the simulation, run on what is known of a model; what remains is a program without it."""

from __future__ import annotations

import re
from typing import Any

from linid.export.translate.body import Body
from linid.export.translate.forms import Made, Memory, NoMemory, generalised
from linid.export.translate.source import plain_function
from linid.export.translate.tree import Function, called
from linid.export.translate.values import Value, form_of


class Program:
    """Functions that have been made, by name; alive: what keys refer to, so that no address is given twice."""

    def __init__(self, memory: Memory | None = None) -> None:
        self.memory: Memory = memory or NoMemory()
        self.functions: dict[str, Function] = {}
        self._made: dict[Any, Made] = {}
        self._alive: list[Any] = []
        self._names: dict[str, int] = {}

    def make(self, function: Any, arguments: list[Value], name: str = "", whole: bool = False) -> Made:
        """A function for arguments of this form; whole: it returns all numbers, those too that are known.

        Raises ConfigError for what cannot be translated.
        """
        plain = plain_function(function)
        arguments = [generalised(one) for one in arguments]
        key = (id(plain), *map(form_of, arguments))
        if key not in self._made:
            self._alive.append((plain, arguments))
            body = Body(self, plain, arguments)
            self._made[key] = body.made(self._name(name or plain.__name__), whole)
            one = self._made[key].function
            self.functions[one.name] = one
        return self._made[key]

    def entry(self, function: Any, arguments: list[Value], name: str) -> Made:
        """A function that is called from outside, under its name, and returns what it does of every model."""
        return self.make(function, arguments, name, whole=True)

    def needed(self, entries: list[str]) -> list[Function]:
        """The entries and what they call, each after what it calls."""
        order: list[Function] = []
        seen: set[str] = set()

        def visit(name: str) -> None:
            if name in seen:
                return
            seen.add(name)
            for other in called(self.functions[name]):
                visit(other)
            order.append(self.functions[name])

        for name in entries:
            visit(name)
        return order

    def _name(self, wanted: str) -> str:
        name = re.sub(r"\W", "_", wanted).strip("_")
        count = self._names[name] = self._names.get(name, 0) + 1
        return name if count == 1 else f"{name}_{count}"
