"""Statements of a function that is being translated, and the function that comes of them."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from linid.export.translate import fold
from linid.export.translate.calls import Calls
from linid.export.translate.forms import Made, Maker, joined, same, united, with_variables
from linid.export.translate.source import assigned_names, leaves_loop
from linid.export.translate.tree import (
    Break,
    Continue,
    Expression,
    For,
    Function,
    If,
    Kind,
    Let,
    Number,
    Operation,
    Return,
    Statement,
    Variable,
    While,
    assigned_in,
    expressions,
    statements,
    variables_in,
    without_idle,
)
from linid.export.translate.values import Group, Known, Running, Value, View, expression_of, is_number, leaves, rebuilt

_UNROLLED = 32  # turns of a loop that are written one after the other, at most
_MOST_TURNS = 20_000  # of a loop whose condition is known


@dataclass(frozen=True)
class _Pending(Return):
    """A return whose form is not decided yet."""

    number: int = 0


class _NotKnown(Exception):  # noqa: N818 - no error: a loop's condition turned out not to be known
    """A condition that was known in the first turn is not in a later one."""


class Body(Calls):
    """One function, run on a form of its arguments."""

    def __init__(self, maker: Maker, function: Any, arguments: list[Value]) -> None:
        super().__init__(maker, function)
        self.depth = 0  # of what hangs on conditions that are not known
        self._results: list[Value] = []
        self._variables: dict[str, str] = {}
        self._repeated: set[str] = set()  # names that turns of a written out loop assign
        self._arguments: list[Variable] = []
        names = [a.arg for a in self.source.tree.args.args]
        if len(names) != len(arguments):
            self.refuse(self.source.tree, f"takes {len(names)} arguments where {len(arguments)} are given")
        for name, value in zip(names, arguments, strict=True):
            self.env[name], made = with_variables(value, name, self._argument_name)
            self._arguments += made
            self.fixed |= {one.name for one in made}

    def _argument_name(self, path: str) -> str:
        self._taken.add(path)
        return path

    def made(self, name: str, whole: bool = False) -> Made:
        """The function under a name; whole: it returns all numbers, whether they are known or not."""
        self._block(self.source.tree.body)
        result, running = united(self._results, whole) if self._results else (Group(()), [])
        kinds: list[Kind] = []
        for number in running:
            column = [[leaf for _, leaf in leaves(one)][number] for one in self._results]
            kinds.append(joined([expression_of(leaf).kind for leaf in column]))
        body = without_idle(self._finished(tuple(self.out), running))
        if isinstance(body[-1] if body else None, Return) and not running:
            body = body[:-1]
        used = {v for one in statements(body) for top in expressions(one) for v in variables_in(top)}
        rest = iter(kinds)
        form = (
            Running(Number(0.0, next(rest))) if k in running else leaf for k, (_, leaf) in enumerate(leaves(result))
        )
        arguments = tuple(one for one in self._arguments if one.name in used)
        mine = {a.name for a in arguments}
        named = assigned_in(body)
        function = Function(
            name,
            arguments,
            tuple(kinds),
            body,
            {n: k for n, k in self.kinds.items() if n not in mine and n in named},
            frozenset(self.reads),
            frozenset(self.writes),
            self.source.words,
        )
        return Made(function, tuple(one.name in used for one in self._arguments), rebuilt(result, form))

    def _finished(self, body: tuple[Statement, ...], running: list[int]) -> tuple[Statement, ...]:
        """Statements with what every return hands over."""
        out: list[Statement] = []
        for one in body:
            if isinstance(one, _Pending):
                row = [leaf for _, leaf in leaves(self._results[one.number])]
                out.append(Return(tuple(expression_of(row[k]) for k in running)))
            elif isinstance(one, If):
                out.append(If(one.condition, self._finished(one.then, running), self._finished(one.otherwise, running)))
            elif isinstance(one, While):
                out.append(While(one.condition, self._finished(one.body, running)))
            elif isinstance(one, For):
                out.append(For(one.name, one.start, one.stop, self._finished(one.body, running)))
            else:
                out.append(one)
        return tuple(out)

    # Variables.

    def _variable(self, path: str) -> str:
        """The variable of a Python name, or of a part of what it holds."""
        if path not in self._variables:
            self.hint = path
            self._variables[path] = self.fresh(path)
            self.hint = ""
        return self._variables[path]

    def _lasting(self, expression: Expression) -> bool:
        """Whether an expression is a number, or a variable that takes no other value."""
        return isinstance(expression, Number) or (isinstance(expression, Variable) and expression.name in self.fixed)

    def assign(self, name: str, value: Value) -> None:
        """A Python name takes a value."""
        once = self._once(name)
        if self.depth == 0 or once:
            lets = [
                (path, leaf.expression)
                for path, leaf in leaves(value, name)
                if isinstance(leaf, Running) and not self._lasting(leaf.expression)
            ]
        else:
            lets = [
                (path, expression_of(leaf))
                for path, leaf in leaves(value, name)
                if isinstance(leaf, Running) or (isinstance(leaf, Known) and is_number(leaf.value))
            ]
        taken = dict(zip((path for path, _ in lets), self._let(lets, once), strict=True))
        self.env[name] = rebuilt(value, iter([taken.get(path, leaf) for path, leaf in leaves(value, name)]))

    def _once(self, name: str) -> bool:
        """Whether a name takes one value only."""
        return self.source.assigned[name] < 2 and name not in self._repeated

    def _let(self, lets: list[tuple[str, Expression]], once: bool) -> list[Value]:
        """Variables take values, all at the same time."""
        names = [self._variable(path) for path, _ in lets]
        values = [value for _, value in lets]
        if any(variables_in(value) & set(names[:k]) for k, value in enumerate(values)):
            kept = zip(names, values, strict=True)
            values = [v if self._lasting(v) else self.temporary(v, f"new_{name}") for name, v in kept]
        out: list[Value] = []
        for name, value in zip(names, values, strict=True):
            kind = joined([self.kinds.get(name, value.kind), value.kind])
            self.kinds[name] = kind
            if once:
                self.fixed.add(name)
            if value != Variable(name, value.kind):
                self.out.append(Let(name, value))
            out.append(Running(Variable(name, kind)))
        return out

    def _settle(self, names: Iterable[str]) -> None:
        """What statements under a condition may change gets variables before."""
        for name in sorted(set(names)):
            if name in self.env and not self._once(name):
                self.depth += 1
                self.assign(name, self.env[name])
                self.depth -= 1

    # Statements.

    def _block(self, body: list[ast.stmt]) -> bool:
        """Run statements; returns whether what follows is never reached."""
        for one in body:
            handler = getattr(self, f"_do_{type(one).__name__}", None)
            if handler is None:
                self.refuse(one, f"uses {type(one).__name__}")
            try:
                if handler(one):
                    return True
            except (TypeError, KeyError, ValueError) as error:
                self.refuse(one, f"does `{ast.unparse(one).splitlines()[0]}` ({error})")
        return False

    def _do_Expr(self, node: ast.Expr) -> bool:  # noqa: N802 - as the tree's node
        if not isinstance(node.value, ast.Constant):
            self.evaluate(node.value)
        return False

    def _do_Pass(self, node: ast.Pass) -> bool:  # noqa: N802
        return False

    def _do_Delete(self, node: ast.Delete) -> bool:  # noqa: N802
        return False

    def _do_Return(self, node: ast.Return) -> bool:  # noqa: N802
        self._results.append(Group(()) if node.value is None else self.evaluate(node.value))
        self.out.append(_Pending((), len(self._results) - 1))
        return True

    def _do_Break(self, node: ast.Break) -> bool:  # noqa: N802
        self.out.append(Break())
        return True

    def _do_Continue(self, node: ast.Continue) -> bool:  # noqa: N802
        self.out.append(Continue())
        return True

    def _do_Assign(self, node: ast.Assign) -> bool:  # noqa: N802
        if len(node.targets) == 1 and isinstance(node.targets[0], ast.Name):
            self.hint = node.targets[0].id
        value = self.evaluate(node.value)
        self.hint = ""
        for target in node.targets:
            self._bind(target, value)
        return False

    def _do_AnnAssign(self, node: ast.AnnAssign) -> bool:  # noqa: N802
        if node.value is not None:
            self._bind(node.target, self.evaluate(node.value))
        return False

    def _do_AugAssign(self, node: ast.AugAssign) -> bool:  # noqa: N802
        old = ast.copy_location(ast.BinOp(_read(node.target), node.op, node.value), node)
        self._bind(node.target, self.evaluate(ast.fix_missing_locations(old)))
        return False

    def _bind(self, target: ast.expr, value: Value) -> None:
        if isinstance(target, ast.Name):
            self.assign(target.id, value)
        elif isinstance(target, ast.Tuple) and isinstance(value, Group) and len(target.elts) == len(value.items):
            if all(isinstance(one, ast.Name) for one in target.elts):
                value = Group(tuple(self._steady(target.elts, k, value.items) for k in range(len(value.items))))
            for one, item in zip(target.elts, value.items, strict=True):
                self._bind(one, item)
        elif isinstance(target, ast.Subscript):
            view = self.evaluate(target.value)
            if not isinstance(view, View):
                self.refuse(target, "changes what is no array")
            self.store(view, self.evaluate(target.slice), value)
        else:
            self.refuse(target, "assigns to what is no name")

    def _steady(self, targets: list[ast.expr], k: int, items: tuple[Value, ...]) -> Value:
        """One of several values that are assigned at once: apart, where an earlier target changes what it hangs on."""
        earlier = {self._variables.get(one.id, one.id) for one in targets[:k] if isinstance(one, ast.Name)}
        value = items[k]
        if isinstance(value, Running) and variables_in(value.expression) & (earlier - self.fixed):
            return Running(self.temporary(value.expression, "kept"))
        return value

    def _do_If(self, node: ast.If) -> bool:  # noqa: N802
        condition = self.truth(node.test)
        if isinstance(condition, bool):
            return self._block(node.body if condition else node.orelse)
        self._settle(assigned_names([*node.body, *node.orelse]))
        before, kept = dict(self.env), self.out
        ways: list[tuple[bool, dict[str, Value], list[Statement]]] = []
        for body in (node.body, node.orelse):
            self.env, self.out = dict(before), []
            self.depth += 1
            ended = self._block(body)
            self.depth -= 1
            ways.append((ended, self.env, self.out))
        self.out = kept
        self.out.append(_tidy(condition, tuple(ways[0][2]), tuple(ways[1][2])))
        self.env = _merged(ways)
        return ways[0][0] and ways[1][0]

    def _do_While(self, node: ast.While) -> bool:  # noqa: N802
        if node.orelse:
            self.refuse(node, "has a loop with an `else`")
        endless = isinstance(node.test, ast.Constant)
        if not endless:
            snapshot = dict(self.env), list(self.out)
            try:
                if self._known_turns(node):
                    return False
            except _NotKnown:
                pass
            self.env, self.out = snapshot
        self._settle(assigned_names(node.body))
        kept, self.out = self.out, []
        condition = self.truth(node.test)
        before, self.out = self.out, []
        if isinstance(condition, bool):
            condition = Number(condition, "bool")
        self.depth += 1
        self._block(node.body)
        self.depth -= 1
        body, self.out = tuple(self.out), kept
        if before:
            leave = If(Operation("not", (condition,), "bool"), (Break(),))
            self.out.append(While(Number(True, "bool"), (*before, leave, *body)))
        else:
            self.out.append(While(condition, body))
        return endless and not leaves_loop(node.body)

    def _known_turns(self, node: ast.While) -> bool:
        """Run the turns of a loop whose condition is known each time; returns whether it was in the first."""
        for turn in range(_MOST_TURNS):
            kept, self.out = self.out, []
            condition = self.truth(node.test)
            needed, self.out = self.out, kept
            if not isinstance(condition, bool) or needed:
                if turn == 0:
                    return False
                raise _NotKnown
            if not condition:
                return True
            self._block(node.body)
        self.refuse(node, f"takes more than {_MOST_TURNS} turns")

    def _do_For(self, node: ast.For) -> bool:  # noqa: N802
        if not isinstance(node.target, ast.Name | ast.Tuple) or node.orelse:
            self.refuse(node, "loops over what is no name, or has an `else`")
        call = node.iter
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"):
            items = self.evaluate(call)
            if not isinstance(items, Group):
                self.refuse(node, "loops over what is no tuple")
            return self._unrolled(node, items.items)
        edges = [self.evaluate(one) for one in call.args]
        if all(isinstance(edge, Known) for edge in edges):
            turns = range(*(int(edge.value) for edge in edges if isinstance(edge, Known)))
            if len(turns) <= _UNROLLED and not leaves_loop(node.body):
                return self._unrolled(node, tuple(Known(k) for k in turns))
        if len(edges) > 2 or not isinstance(node.target, ast.Name):
            self.refuse(node, "loops in steps of other than one")
        start, stop = (Known(0), *edges) if len(edges) == 1 else edges
        self._settle(assigned_names(node.body))
        name = self.fresh("turn" if node.target.id == "_" else node.target.id)
        self.kinds[name] = "int"
        self.env[node.target.id] = Running(Variable(name, "int"))
        kept, self.out = self.out, []
        self.depth += 1
        self._block(node.body)
        self.depth -= 1
        body, self.out = tuple(self.out), kept
        self.out.append(For(name, expression_of(start), expression_of(stop), body))
        return False

    def _unrolled(self, node: ast.For, items: tuple[Value, ...]) -> bool:
        """The turns of a loop one after the other."""
        self._repeated |= set(assigned_names(node.body))
        for item in items:
            if isinstance(node.target, ast.Name) and isinstance(item, Known):
                self.env[node.target.id] = item  # known in every turn, whatever the loop stands under
            else:
                self._bind(node.target, item)
            if self._block(node.body):
                return True
        return False


def _read(target: ast.expr) -> ast.expr:
    """What is changed, as a value."""
    copy = ast.parse(ast.unparse(target), mode="eval").body
    return ast.copy_location(copy, target)


def _tidy(condition: Expression, then: tuple[Statement, ...], otherwise: tuple[Statement, ...]) -> Statement:
    """A condition with its ways, the first of which is not empty."""
    if not then and otherwise:
        return If(expression_of(fold.inverted(Running(condition))), otherwise)
    return If(condition, then, otherwise)


def _merged(ways: list[tuple[bool, dict[str, Value], list[Statement]]]) -> dict[str, Value]:
    """What names mean after two ways."""
    (ended, first, _), (other_ended, second, _) = ways
    if ended or other_ended:
        return second if ended else first
    out = {**first, **second}
    for name in first.keys() & second.keys():
        pairs = list(zip(leaves(first[name]), leaves(second[name]), strict=False))
        if first[name] is not second[name] and not all(same(a, b) for (_, a), (_, b) in pairs):
            del out[name]  # of two forms: nothing that is translated may read it from here on
    return out
