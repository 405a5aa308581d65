"""Calls in a function that is being translated: what is known is worked out, what is short is put in its place."""

from __future__ import annotations

import ast
from typing import Any

from linid.export.translate import fold
from linid.export.translate.expressions import Expressions
from linid.export.translate.source import plain_function
from linid.export.translate.tree import (
    Call,
    Element,
    Expression,
    Function,
    Invoke,
    Number,
    Return,
    Statement,
    Variable,
    substituted,
    walk,
)
from linid.export.translate.values import (
    Group,
    Known,
    Running,
    Value,
    View,
    expression_of,
    is_number,
    kind_of,
    leaves,
    plain,
    rebuilt,
)

_INLINED = 40  # operations of a function that is one expression, at most, to be written where it is called


def whole_power(base, exponent):  # type: ignore[no-untyped-def]  # translated, as all that it stands for
    """A whole power, by the squares of the base, as the compiler of the simulation takes it."""
    size = abs(exponent)
    result = 1.0
    while size != 0:
        if size % 2 == 1:
            result *= base
        size //= 2
        base *= base
    return 1.0 / result if exponent < 0 else result


class Calls(Expressions):
    """What evaluates calls."""

    def _of_BinOp(self, node: ast.BinOp) -> Value:  # noqa: N802 - as the tree's node
        if not isinstance(node.op, ast.Pow):
            return super()._of_BinOp(node)
        base, exponent = self.evaluate(node.left), self.evaluate(node.right)
        if isinstance(base, Known) and isinstance(exponent, Known):
            return fold.binary("**", base, exponent)
        if expression_of(exponent).kind != "int":
            return fold.binary("**", base, exponent)
        return self._called(whole_power, [fold.library(float, [base]), exponent], "power")

    def _of_Call(self, node: ast.Call) -> Value:  # noqa: N802
        target = self.evaluate(node.func)
        hint, self.hint = self.hint, ""
        if node.keywords or not isinstance(target, Known):
            self.refuse(node, "calls with names of arguments, or what is not known")
        arguments = self._several(node.args)
        function = target.value
        if getattr(function, "__name__", "") == "_values_at":
            return self._values_at(arguments)
        if isinstance(function, type) and hasattr(function, "_fields"):
            return Group(tuple(arguments), function)
        if function is len and isinstance(arguments[0], Group):
            return Known(len(arguments[0].items))
        if function in fold.FUNCTIONS:
            return fold.library(function, arguments)
        if not callable(function) or isinstance(function, type) or not hasattr(plain_function(function), "__code__"):
            self.refuse(node, f"calls `{ast.unparse(node.func)}`")
        return self._called(function, arguments, hint)

    def _values_at(self, arguments: list[Value]) -> Value:
        """Numbers of an array at places that a bundle names; None: 0."""
        view, where = arguments
        assert isinstance(view, View) and isinstance(where, Known)
        self.reads.add(view.array)
        places = where.value.places
        return Group(
            tuple(Known(0.0) if k is None else self.maker.memory.read(view.array, Known(int(k))) for k in places)
        )

    def _called(self, function: Any, arguments: list[Value], hint: str) -> Value:
        """A call of another function of the same kind."""
        made = self.maker.make(function, arguments)
        running = [expression_of(leaf) for one in arguments for _, leaf in leaves(one) if _is_given(leaf)]
        given = [one for one, used in zip(running, made.used, strict=True) if used]
        body = made.function
        self.reads |= body.reads
        self.writes |= body.writes
        if not body.body or (not body.results and not body.writes):
            return made.result
        alone = body.body[0] if len(body.body) == 1 else None
        if isinstance(alone, Return) and sum(map(_size, alone.values)) <= _INLINED:
            return self._filled(made.result, self._inlined(body, alone.values, given))
        if len(body.body) == 2 and _hands_on(body.body):
            invoked, _ = body.body
            assert isinstance(invoked, Invoke)
            values = {one.name: value for one, value in zip(body.arguments, given, strict=True)}
            given = [substituted(one, values) for one in invoked.arguments]
            body = self.maker.functions[invoked.function]
        if body.pure:
            return self._filled(made.result, [Call(body.name, tuple(given), body.results[0])])
        names = tuple(self.fresh(name) for name in self._names_of(made.result, hint or body.name))
        for name, kind in zip(names, body.results, strict=True):
            self.kinds[name] = kind
            self.fixed.add(name)
        self.out.append(Invoke(names, body.name, tuple(given)))
        return self._filled(made.result, [Variable(n, k) for n, k in zip(names, body.results, strict=True)])

    @staticmethod
    def _names_of(result: Value, hint: str) -> list[str]:
        return [path for path, leaf in leaves(result, hint) if isinstance(leaf, Running)]

    @staticmethod
    def _filled(form: Value, values: list[Expression]) -> Value:
        """A result's form with what a call of the function gives in place of its running numbers."""
        rest = iter(values)
        parts = (Running(next(rest)) if isinstance(leaf, Running) else leaf for _, leaf in leaves(form))
        return rebuilt(form, parts)

    def _inlined(self, body: Function, found: tuple[Expression, ...], given: list[Expression]) -> list[Expression]:
        """What a function gives with its arguments put in; what is long and needed twice gets a name."""
        counts: dict[str, int] = {}
        for part in (part for one in found for part in walk(one)):
            if isinstance(part, Variable):
                counts[part.name] = counts.get(part.name, 0) + 1
        values: dict[str, Expression] = {}
        for argument, value in zip(body.arguments, given, strict=True):
            simple = isinstance(value, Number | Variable | Element) or counts.get(argument.name, 0) < 2
            values[argument.name] = value if simple else self.temporary(value, argument.name)
        return [substituted(one, values) for one in found]


def _is_given(leaf: Value) -> bool:
    """Whether a part of an argument is handed over at run time."""
    return isinstance(leaf, Running) or (
        isinstance(leaf, Known) and is_number(leaf.value) and kind_of(plain(leaf.value)) == "float"
    )


def _hands_on(body: tuple[Statement, ...]) -> bool:
    """Whether a function hands on what another gives, and does nothing else."""
    invoked, returned = body
    if not (isinstance(invoked, Invoke) and isinstance(returned, Return)):
        return False
    return [getattr(one, "name", None) for one in returned.values] == list(invoked.names)


def _size(expression: Expression) -> int:
    return sum(1 for _ in walk(expression))
