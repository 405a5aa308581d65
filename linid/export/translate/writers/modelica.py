"""The small tree as Modelica: functions take the arrays of memory that they read, and give back those they change."""

from __future__ import annotations

from linid.export.translate.tree import (
    Element,
    Expression,
    For,
    Function,
    Kind,
    Let,
    Number,
    Operation,
    Store,
    called,
    expressions,
    statements,
    walk,
    without_continue,
)
from linid.export.translate.writers.writer import Words, Writer

ARRAYS = {"p": "parameters", "own": "own_parameters", "s": "states", "table": "field", "c": "cubics"}
_TYPES: dict[Kind, str] = {"float": "Real", "int": "Integer", "bool": "Boolean"}
_SAME = ("exp", "log", "sin", "cos", "tan", "tanh", "atan", "atan2", "sqrt", "floor", "abs", "min", "max")
_KEYWORDS = (
    "algorithm and annotation block break class connect connector constant constrainedby der discrete each else "
    "elseif elsewhen encapsulated end enumeration equation expandable extends external false final flow for "
    "function if import impure in initial inner input loop model not operator or outer output package parameter "
    "partial protected public pure record redeclare replaceable return stream then true type when while within "
    "Real Integer Boolean String abs sign sqrt div mod rem ceil floor integer semiLinear sin cos tan asin acos "
    "atan atan2 sinh cosh tanh exp log log10 pre edge change sample initial terminal noEvent smooth delay "
    "cardinality homotopy spatialDistribution reinit assert terminate time size ndims scalar vector matrix zeros "
    "ones fill identity diagonal linspace min max sum product transpose cat promote cross skew symmetric "
    "outerProduct previous hold copysign expm1 undefined truncated nearest doubled nth infinite unknown"
)
HELPERS = """
function copysign "The size of one number with the sign of another; Modelica knows no sign of zero."
  input Real size_;
  input Real sign_;
  output Real value;
algorithm
  value := if sign_ < 0.0 then -abs(size_) else abs(size_);
end copysign;

function expm1 "exp(x) - 1 without loss near 0: twice exp(x/2) sinh(x/2)."
  input Real x;
  output Real value;
algorithm
  value := if abs(x) < 80.0 then 2.0 * exp(0.5 * x) * sinh(0.5 * x) else exp(x) - 1.0;
end expm1;

function undefined "Whether a number is none, or stands for one that is not given."
  input Real x;
  output Boolean value;
algorithm
  value := not (abs(x) < unknown);
end undefined;

function truncated "The whole part."
  input Real x;
  output Integer value;
algorithm
  value := if x < 0.0 then -integer(-x) else integer(x);
end truncated;

function nearest "The nearest whole number, of two the even one."
  input Real x;
  output Integer value;
algorithm
  value := integer(x + 0.5);
  if value - x == 0.5 and mod(value, 2) == 1 then
    value := value - 1;
  end if;
end nearest;

function doubled "A whole number, so many times doubled."
  input Integer number;
  input Integer times;
  output Integer value;
algorithm
  value := number;
  for k in 1:times loop
    value := 2 * value;
  end for;
end doubled;

function nth "The number at a place, counted from 1."
  input Real numbers[:];
  input Integer place;
  output Real value;
algorithm
  value := numbers[place];
end nth;
"""


def quoted(text: str) -> str:
    """A text as a string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


class ModelicaWriter(Writer):
    """Functions of a package; the places of named elements are constants of the package around it."""

    words = Words(
        functions={
            **{name: name for name in (*_SAME, "copysign", "expm1")},
            "isnan": "undefined",
            "floor_int": "integer",
            "int": "truncated",
            "float": "",
            "round": "nearest",
        },
        infix={"and": "and", "or": "or", "!=": "<>"},
        negation="(not ({0}))",
        infinity="infinite",
        nan="unknown",
        true="true",
        false="false",
        select="(if {0} then {1} else {2})",
        power="(({0}) ^ ({1}))",
        integer_division="integer(({0}) / ({1}))",
        remainder="mod({0}, {1})",
        shift_left="doubled({0}, {1})",
        shift_right="integer(({0}) / 2 ^ ({1}))",
        loose_and=True,
    )
    indent = "  "
    leave, again = "break;", ""  # there is no `continue`: `without_continue`
    reserved = frozenset((*_KEYWORDS.split(), *ARRAYS.values()))

    def __init__(self) -> None:
        self._arrays: dict[str, tuple[frozenset[str], frozenset[str]]] = {}

    def program(self, functions: list[Function]) -> str:
        """All functions with what they need."""
        self.functions = {one.name: one for one in functions}
        for one in functions:
            self._arrays[one.name] = self._touched(one)
        return HELPERS.strip("\n") + "\n\n" + "\n\n".join(self.function(one) for one in functions)

    def _touched(self, function: Function) -> tuple[frozenset[str], frozenset[str]]:
        """Arrays that a function needs and those that it changes, by itself or by what it calls before it."""
        needs, changes = set(), set()
        for one in statements(function.body):
            needs |= {part.array for top in expressions(one) for part in walk(top) if isinstance(part, Element)}
            changes |= {one.place.array} if isinstance(one, Store) else set()
        for other in called(function):
            needs |= self._arrays[other][0]
            changes |= self._arrays[other][1]
        return frozenset(needs | changes), frozenset(changes)

    def needed(self, function: Function) -> list[str]:
        """Names of the arrays that a function takes, in order."""
        return [name for array, name in ARRAYS.items() if array in self._arrays[function.name][0]]

    def changed(self, function: Function) -> list[str]:
        """Names of the arrays that it gives back, in order."""
        return [name for array, name in ARRAYS.items() if array in self._arrays[function.name][1]]

    def _written(self, node: Expression) -> tuple[str, int]:
        """An expression; a sign may stand at the begin of a sum only."""
        text, order = super()._written(node)
        return text, 5 if text.startswith("-") and order > 5 else order

    def element(self, array: str, index: str, label: str) -> str:
        """An element of memory, whose arrays are counted from 1."""
        return f"{ARRAYS[array]}[{array.upper()}_{label}]" if label else f"{ARRAYS[array]}[{index} + 1]"

    def expression(self, node: Expression) -> str:
        """An expression; places that are known are counted from 1 at once."""
        if isinstance(node, Element) and not node.label and isinstance(node.index, Number):
            return f"{ARRAYS[node.array]}[{int(node.index.value) + 1}]"
        return super().expression(node)

    def library(self, node: Operation, arguments: list[str]) -> str:
        """A function; whole numbers are real ones as they are."""
        if node.name != "float":
            return super().library(node, arguments)
        return f"(if {arguments[0]} then 1.0 else 0.0)" if node.arguments[0].kind == "bool" else f"({arguments[0]})"

    def choose(self, place: str, *numbers: str) -> str:
        """The number at a place."""
        return f"nth({{{', '.join(numbers)}}}, {place} + 1)"

    def call(self, function: Function, arguments: list[str]) -> str:
        """A call."""
        return f"{self.function_name(function)}({', '.join([*self.needed(function), *arguments])})"

    def function_name(self, function: Function) -> str:
        """A function's name, which no word of the language has."""
        return f"{function.name}_of" if function.name in self.reserved else function.name

    def function(self, function: Function) -> str:
        """The definition of a function."""
        name, words = self.function_name(function), quoted(f"{function.words}.") if function.words else ""
        changed, kinds = self.changed(function), function.results
        inputs = [f"Real {one}{'_before' if one in changed else ''}[:]" for one in self.needed(function)]
        inputs += [f"{_TYPES[one.kind]} {self.variable(one.name)}" for one in function.arguments]
        outputs = [f"Real {one}[size({one}_before, 1)]" for one in changed]
        outputs += [f"{_TYPES[kind]} result_{k}" for k, kind in enumerate(kinds, 1)]
        body = without_continue(function.body)
        counters = {one.name for one in statements(body) if isinstance(one, For)}
        counters -= {one.name for one in statements(body) if isinstance(one, Let)}
        local = [(n, kind) for n, kind in sorted(function.variables.items()) if n not in counters]
        lines = [f"{one} := {one}_before;" for one in changed] + self.block(body, 0)
        if lines and lines[-1] == "return;":
            lines.pop()
        return "\n".join(
            [
                f"function {name} {words}".rstrip(),
                *(f"  input {one};" for one in inputs),
                *(f"  output {one};" for one in outputs),
                *(["protected"] if local else []),
                *(f"  {_TYPES[kind]} {self.variable(one)};" for one, kind in local),
                "algorithm",
                *(f"  {line}" for line in lines),
                f"end {name};",
            ]
        )

    def let(self, name: str, value: str) -> str:
        """A variable takes a value."""
        return f"{name} := {value};"

    def invoke(self, names: tuple[str, ...], function: Function, arguments: list[str]) -> list[str]:
        """A call of a function with several results."""
        every = [*self.changed(function), *names]
        if not every:  # it changes nothing of this model
            return []
        left = every[0] if len(every) == 1 else f"({', '.join(every)})"
        return [f"{left} := {self.call(function, arguments)};"]

    def returned(self, values: list[str]) -> list[str]:
        """A return."""
        return [*(f"result_{k} := {value};" for k, value in enumerate(values, 1)), "return;"]

    def branch(self, condition: str, then: list[str], otherwise: list[str]) -> list[str]:
        """A condition."""
        out = [f"if {condition} then", *then]
        return [*out, "else", *otherwise, "end if;"] if otherwise else [*out, "end if;"]

    def loop(self, condition: Expression, body: list[str]) -> list[str]:
        """A loop with a condition."""
        return [f"while {self.expression(condition)} loop", *body, "end while;"]

    def count(self, name: str, start: str, stop: str, body: list[str]) -> list[str]:
        """A loop over whole numbers."""
        return [f"for {name} in {start}:{stop} - 1 loop", *body, "end for;"]
