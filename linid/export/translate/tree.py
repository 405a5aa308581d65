"""The small language between Python and the others: numbers, variables, operations, and few statements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

Kind = Literal["float", "int", "bool"]


@dataclass(frozen=True)
class Number:
    """A number that is known."""

    value: float | int | bool
    kind: Kind


@dataclass(frozen=True)
class Variable:
    """A local variable or an argument."""

    name: str
    kind: Kind


@dataclass(frozen=True)
class Element:
    """One number of an array of the model's memory; label: its name where the place is known, else empty."""

    array: str
    index: Expression
    label: str = ""
    kind: Kind = "float"


@dataclass(frozen=True)
class Operation:
    """An operation or a function of the mathematical library, by name (`fold.py` lists them), on arguments."""

    name: str
    arguments: tuple[Expression, ...]
    kind: Kind


@dataclass(frozen=True)
class Call:
    """A call of a function that gives one number and changes no memory."""

    function: str
    arguments: tuple[Expression, ...]
    kind: Kind


Expression = Number | Variable | Element | Operation | Call


@dataclass(frozen=True)
class Let:
    """A variable takes a value."""

    name: str
    value: Expression


@dataclass(frozen=True)
class Invoke:
    """A call of a function that gives several numbers, or changes memory."""

    names: tuple[str, ...]
    function: str
    arguments: tuple[Expression, ...]


@dataclass(frozen=True)
class Store:
    """An element of memory takes a value."""

    place: Element
    value: Expression


@dataclass(frozen=True)
class If:
    """One of two ways."""

    condition: Expression
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...] = ()


@dataclass(frozen=True)
class While:
    """Again and again while a condition holds."""

    condition: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class For:
    """For whole numbers from start to below stop."""

    name: str
    start: Expression
    stop: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class Break:
    """Leave the loop."""


@dataclass(frozen=True)
class Continue:
    """Go on with the loop's next turn."""


@dataclass(frozen=True)
class Return:
    """Leave the function with these numbers."""

    values: tuple[Expression, ...]


Statement = Let | Invoke | Store | If | While | For | Break | Continue | Return


@dataclass(frozen=True)
class Function:
    """A function without what is known. arguments: its variables; results: kinds of what it gives; variables: kinds of
    its local ones by name; reads, writes: arrays of memory, by itself or by what it calls; words: what it is."""

    name: str
    arguments: tuple[Variable, ...]
    results: tuple[Kind, ...]
    body: tuple[Statement, ...]
    variables: Mapping[str, Kind]
    reads: frozenset[str]
    writes: frozenset[str]
    words: str = ""

    @property
    def expression(self) -> Expression | None:
        """What it gives, where it is nothing but one expression."""
        if len(self.body) == 1 and isinstance(self.body[0], Return) and len(self.results) == 1:
            return self.body[0].values[0]
        return None

    @property
    def pure(self) -> bool:
        """Whether a call of it is an expression."""
        return len(self.results) == 1 and not self.writes


def parts(node: Expression) -> tuple[Expression, ...]:
    """The expressions right below one."""
    if isinstance(node, Operation | Call):
        return node.arguments
    return (node.index,) if isinstance(node, Element) else ()


def walk(node: Expression) -> Iterator[Expression]:
    """An expression and all below it."""
    yield node
    for part in parts(node):
        yield from walk(part)


def variables_in(node: Expression) -> set[str]:
    """Names of the variables of an expression."""
    return {part.name for part in walk(node) if isinstance(part, Variable)}


def substituted(node: Expression, values: Mapping[str, Expression]) -> Expression:
    """An expression with others in place of its variables."""
    if isinstance(node, Variable):
        return values.get(node.name, node)
    if isinstance(node, Operation | Call):
        return replace(node, arguments=tuple(substituted(part, values) for part in node.arguments))
    if isinstance(node, Element):
        return replace(node, index=substituted(node.index, values))
    return node


def statements(body: tuple[Statement, ...]) -> Iterator[Statement]:
    """All statements, those inside others too."""
    for one in body:
        yield one
        if isinstance(one, If):
            yield from statements(one.then)
            yield from statements(one.otherwise)
        elif isinstance(one, While | For):
            yield from statements(one.body)


def expressions(statement: Statement) -> tuple[Expression, ...]:
    """The expressions of one statement itself."""
    match statement:
        case Let(_, value):
            return (value,)
        case Invoke(_, _, arguments):
            return arguments
        case Store(place, value):
            return place, value
        case If(condition) | While(condition):
            return (condition,)
        case For(_, start, stop):
            return start, stop
        case Return(values):
            return values
    return ()


def called(function: Function) -> list[str]:
    """Names of the functions that one calls, in order."""
    found: list[str] = []
    for one in statements(function.body):
        found += [part.function for top in expressions(one) for part in walk(top) if isinstance(part, Call)]
        if isinstance(one, Invoke):
            found.append(one.function)
    return found


def without_idle(body: tuple[Statement, ...]) -> tuple[Statement, ...]:
    """Statements without values that nothing reads."""
    read = {name for one in statements(body) for top in expressions(one) for name in variables_in(top)}
    out = tuple(_without(body, read))
    return out if out == body else without_idle(out)


def _without(body: tuple[Statement, ...], read: set[str]) -> Iterator[Statement]:
    for one in body:
        if isinstance(one, Let) and one.name not in read:
            continue
        if isinstance(one, If):
            one = replace(one, then=tuple(_without(one.then, read)), otherwise=tuple(_without(one.otherwise, read)))
            if not one.then and not one.otherwise:
                continue
        elif isinstance(one, While | For):
            one = replace(one, body=tuple(_without(one.body, read)))
        yield one


def assigned_in(body: tuple[Statement, ...]) -> set[str]:
    """Names of the variables that statements assign."""
    found: set[str] = set()
    for one in statements(body):
        if isinstance(one, Let | For):
            found.add(one.name)
        elif isinstance(one, Invoke):
            found |= set(one.names)
    return found


def without_continue(body: tuple[Statement, ...]) -> tuple[Statement, ...]:
    """Statements of the same meaning without `Continue`, for languages that have none."""
    return tuple(
        replace(one, body=_turn(one.body))
        if isinstance(one, While | For)
        else replace(one, then=without_continue(one.then), otherwise=without_continue(one.otherwise))
        if isinstance(one, If)
        else one
        for one in body
    )


def _turn(body: tuple[Statement, ...]) -> tuple[Statement, ...]:
    """A loop's turn: what follows a condition with `Continue` in it moves into the ways that go on."""
    for k, one in enumerate(body):
        if isinstance(one, Continue):
            return without_continue(body[:k])
        if isinstance(one, If) and _goes_on_early((one,)):
            rest = body[k + 1 :]
            then, otherwise = (
                _turn(way if way and isinstance(way[-1], Continue | Break | Return) else (*way, *rest))
                for way in (one.then, one.otherwise)
            )
            return (*without_continue(body[:k]), If(one.condition, then, otherwise))
    return without_continue(body)


def _goes_on_early(body: tuple[Statement, ...]) -> bool:
    """Whether a `Continue` of the loop around stands in statements."""
    inside = [one for one in body if isinstance(one, If)]
    direct = any(isinstance(one, Continue) for one in body)
    return direct or any(_goes_on_early(one.then) or _goes_on_early(one.otherwise) for one in inside)
