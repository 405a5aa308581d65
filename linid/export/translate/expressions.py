"""Expressions of a function that is being translated."""

from __future__ import annotations

import ast
import math
from typing import Any, NoReturn

from linid.errors import ConfigError
from linid.export.translate import fold
from linid.export.translate.forms import Maker, joined
from linid.export.translate.source import Source, outer_names, source_of
from linid.export.translate.tree import Expression, If, Kind, Let, Number, Operation, Statement, Store, Variable
from linid.export.translate.values import Group, Known, Running, Value, View, expression_of, known, leaves, rebuilt

_OPERATORS = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.FloorDiv: "//",
    ast.Mod: "%",
    ast.Pow: "**",
    ast.LShift: "<<",
    ast.RShift: ">>",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
_REMEDY = "Use arithmetic, comparisons, conditions, loops over ranges, `math` and functions of the same kind."


class Expressions:
    """What evaluates expressions, and writes down the statements that they need before."""

    def __init__(self, maker: Maker, function: Any) -> None:
        self.maker = maker
        self.source: Source = source_of(function)
        self.globals: dict[str, Any] = {**function.__globals__, **outer_names(function)}
        self.env: dict[str, Value] = {}
        self.out: list[Statement] = []
        self.kinds: dict[str, Kind] = {}
        self.fixed: set[str] = set()  # variables that take one value only
        self.hint = ""  # what the value that is being worked out will be called
        self.reads: set[str] = set()
        self.writes: set[str] = set()
        self._taken: set[str] = {"memory"}

    def refuse(self, node: ast.AST, fact: str) -> NoReturn:
        """Raises ConfigError that says where the function does what cannot be translated."""
        line = self.source.first + getattr(node, "lineno", 1) - 1
        raise ConfigError(f"{self.source.file}:{line}", f"{fact}, which cannot be translated", _REMEDY)

    # Names and numbers.

    def fresh(self, wanted: str) -> str:
        """A name that nothing in this function has yet."""
        name, count = wanted, 1
        while name in self._taken or (count == 1 and name in self.source.assigned and name != self.hint):
            count += 1
            name = f"{wanted}_{count}"
        self._taken.add(name)
        return name

    def temporary(self, expression: Expression, name: str) -> Variable:
        """A variable of its own for a value."""
        one = Variable(self.fresh(name), expression.kind)
        self.kinds[one.name] = one.kind
        self.fixed.add(one.name)
        self.out.append(Let(one.name, expression))
        return one

    def evaluate(self, node: ast.expr) -> Value:
        """What an expression gives."""
        handler = getattr(self, f"_of_{type(node).__name__}", None)
        if handler is None:
            self.refuse(node, f"uses {type(node).__name__}")
        try:
            return handler(node)  # type: ignore[no-any-return]
        except (TypeError, KeyError, AttributeError, IndexError) as error:
            self.refuse(node, f"holds `{ast.unparse(node)}` ({error})")

    def apart(self, node: ast.expr) -> tuple[Value, list[Statement]]:
        """What an expression gives, and the statements that it needs before, which are not written yet."""
        kept, self.out = self.out, []
        value = self.evaluate(node)
        statements, self.out = self.out, kept
        return value, statements

    def truth(self, node: ast.expr) -> bool | Expression:
        """A condition: known, or an expression."""
        value = self.evaluate(node)
        if isinstance(value, Known):
            return bool(value.value)
        one = expression_of(value)
        return one if one.kind == "bool" else Operation("!=", (one, Number(0, "int")), "bool")

    def _of_Constant(self, node: ast.Constant) -> Value:  # noqa: N802 - as the tree's node
        return Known(node.value)

    def _of_Name(self, node: ast.Name) -> Value:  # noqa: N802
        if node.id in self.env:
            return self.env[node.id]
        if node.id in self.globals:
            return known(self.globals[node.id])
        builtins = self.globals.get("__builtins__", {})
        table = builtins if isinstance(builtins, dict) else vars(builtins)
        if node.id in table:
            return Known(table[node.id])
        self.refuse(node, f"reads `{node.id}` before it has a value")

    def _of_Attribute(self, node: ast.Attribute) -> Value:  # noqa: N802
        value = self.evaluate(node.value)
        if isinstance(value, Group):
            fields = getattr(value.type, "_fields", ())
            if node.attr == "size" and node.attr not in fields:
                return Known(len(value.items))
            return value.items[fields.index(node.attr)]
        if isinstance(value, View):
            shape = Group(tuple(one if isinstance(one, Running) else Known(one) for one in value.shape))
            return shape if node.attr == "shape" else Known(math.prod(value.shape))  # type: ignore[arg-type]
        if isinstance(value, Known):
            return known(getattr(value.value, node.attr))
        self.refuse(node, f"asks a number for `{node.attr}`")

    def _of_Tuple(self, node: ast.Tuple) -> Value:  # noqa: N802
        return Group(tuple(self._several(node.elts)))

    def _several(self, nodes: list[ast.expr]) -> list[Value]:
        """Values of a list, whose starred ones give several."""
        out: list[Value] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                value = self.evaluate(node.value)
                if not isinstance(value, Group):
                    self.refuse(node, "unpacks what is no tuple")
                out += value.items
            else:
                out.append(self.evaluate(node))
        return out

    def _of_Subscript(self, node: ast.Subscript) -> Value:  # noqa: N802
        value = self.evaluate(node.value)
        if isinstance(value, Group) and isinstance(node.slice, ast.Slice):
            edges = [None if one is None else self._whole(one) for one in (node.slice.lower, node.slice.upper)]
            return Group(value.items[slice(*edges)])
        index = self.evaluate(node.slice)
        if isinstance(value, Group) and isinstance(index, Known):
            return value.items[int(index.value)]
        if isinstance(value, Group):
            return self._one_of(value, expression_of(index))
        if isinstance(value, View):
            place = self.place_in(value, index)
            if isinstance(place, View):
                return place
            self.reads.add(value.array)
            return self.maker.memory.read(value.array, place)
        self.refuse(node, "takes a part of what is no tuple of known places")

    def _one_of(self, group: Group, index: Expression) -> Value:
        """The number of a tuple at a place that is not known."""
        items = [expression_of(one) for one in group.items]
        return Running(Operation("choose", (index, *items), joined([one.kind for one in items])))

    def _whole(self, node: ast.expr) -> int:
        value = self.evaluate(node)
        if not isinstance(value, Known):
            self.refuse(node, "cuts at a place that is not known")
        return int(value.value)

    def place_in(self, view: View, index: Value) -> Value:
        """Where an element of an array stands, or the view of a part of it; raises TypeError for an unknown part."""
        indices = index.items if isinstance(index, Group) else (index,)
        place: Value = Known(view.start)
        for axis, one in enumerate(indices):
            size = math.prod(n for n in view.shape[axis + 1 :] if isinstance(n, int))
            place = fold.binary("+", place, fold.binary("*", one, Known(size)))
        rest = view.shape[len(indices) :]
        if not rest:
            return place
        if not isinstance(place, Known):
            raise TypeError("a part of an array at a place that is not known")
        return View(view.array, place.value, rest)

    # Operations.

    def _of_BinOp(self, node: ast.BinOp) -> Value:  # noqa: N802
        return fold.binary(_OPERATORS[type(node.op)], self.evaluate(node.left), self.evaluate(node.right))

    def _of_UnaryOp(self, node: ast.UnaryOp) -> Value:  # noqa: N802
        if isinstance(node.op, ast.Not):
            return fold.inverted(self._as_value(self.truth(node.operand)))
        value = self.evaluate(node.operand)
        return value if isinstance(node.op, ast.UAdd) else fold.negated(value)

    @staticmethod
    def _as_value(truth: bool | Expression) -> Value:
        return Known(truth) if isinstance(truth, bool) else Running(truth)

    def _of_Compare(self, node: ast.Compare) -> Value:  # noqa: N802
        left, found = self.evaluate(node.left), None
        for operator, right_node in zip(node.ops, node.comparators, strict=True):
            if isinstance(operator, ast.Is | ast.IsNot):
                right = self.evaluate(right_node)
                if not (isinstance(left, Known) or isinstance(right, Known)):
                    self.refuse(node, "compares by `is`")
                alike = isinstance(left, Known) and isinstance(right, Known) and left.value is right.value
                one: Value = Known(alike == isinstance(operator, ast.Is))
            else:
                right = self.evaluate(right_node)
                one = fold.binary(_OPERATORS[type(operator)], left, right)
            found = one if found is None else self._joined("and", found, one)
            left = right
        assert found is not None
        return found

    def _joined(self, word: str, left: Value, right: Value) -> Value:
        """Two truths by `and` or `or`."""
        for one, other in ((left, right), (right, left)):
            if isinstance(one, Known):
                return other if bool(one.value) == (word == "and") else one
        return Running(Operation(word, (expression_of(left), expression_of(right)), "bool"))

    def _of_BoolOp(self, node: ast.BoolOp) -> Value:  # noqa: N802
        word = "and" if isinstance(node.op, ast.And) else "or"
        found = self._as_value(self.truth(node.values[0]))
        for other in node.values[1:]:
            if isinstance(found, Known):
                if bool(found.value) != (word == "and"):
                    return found
                found = self._as_value(self.truth(other))
                continue
            kept, self.out = self.out, []
            right = self._as_value(self.truth(other))
            needed, self.out = self.out, kept
            found = self._guarded(word, found, right, needed) if needed else self._joined(word, found, right)
        return found

    def _guarded(self, word: str, left: Value, right: Value, needed: list[Statement]) -> Value:
        """Two truths of which the second needs statements, which are left out where the first says all."""
        name = self.fresh("holds")
        self.kinds[name] = "bool"
        self.out.append(Let(name, expression_of(left)))
        condition: Expression = Variable(name, "bool")
        condition = condition if word == "and" else Operation("not", (condition,), "bool")
        self.out.append(If(condition, (*needed, Let(name, expression_of(right)))))
        return Running(Variable(name, "bool"))

    def _of_IfExp(self, node: ast.IfExp) -> Value:  # noqa: N802
        condition = self.truth(node.test)
        if isinstance(condition, bool):
            return self.evaluate(node.body if condition else node.orelse)
        (yes, before_yes), (no, before_no) = self.apart(node.body), self.apart(node.orelse)
        if not (before_yes or before_no or isinstance(yes, Group) or isinstance(no, Group)):
            a, b = expression_of(yes), expression_of(no)
            return Running(Operation("select", (condition, a, b), "float" if "float" in (a.kind, b.kind) else a.kind))
        parts: list[Value] = []
        for (path, one), (_, other) in zip(leaves(yes, "chosen"), leaves(no, "chosen"), strict=True):
            a, b = expression_of(one), expression_of(other)
            name = self.fresh(path)
            self.kinds[name] = "float" if "float" in (a.kind, b.kind) else a.kind
            before_yes.append(Let(name, a))
            before_no.append(Let(name, b))
            parts.append(Running(Variable(name, self.kinds[name])))
        self.out.append(If(condition, tuple(before_yes), tuple(before_no)))
        return rebuilt(yes, iter(parts))

    def store(self, view: View, index: Value, value: Value) -> None:
        """An element of an array takes a value."""
        place = self.place_in(view, index)
        element = self.maker.memory.place(view.array, place)
        if element is not None:
            self.writes.add(view.array)
            self.reads |= {view.array}
            self.out.append(Store(element, expression_of(value)))
