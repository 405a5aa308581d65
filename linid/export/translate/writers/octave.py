"""The small tree as MATLAB and Octave: memory is a structure that functions take and, if they change it, give back."""

from __future__ import annotations

from linid.export.translate.tree import Element, Expression, Function, Number
from linid.export.translate.writers.writer import Words, Writer

_SAME = (
    "min",
    "max",
    "copysign",
    "exp",
    "expm1",
    "log",
    "sin",
    "cos",
    "tan",
    "tanh",
    "atan",
    "atan2",
    "sqrt",
    "isnan",
    "floor",
    "round",
    "abs",
)
_KEYWORDS = (
    "end function if else elseif while for switch case otherwise return break continue try catch global persistent "
    "parfor do until unwind_protect endif endfor endwhile endfunction endswitch pi e i j Inf NaN inf nan eps true "
    "false pick nth copysign memory ans"
)
HELPERS = """
function value = copysign(size, sign)
% The size of one number with the sign of another, that of zero too.
value = abs(size);
if sign < 0 || (sign == 0 && 1 / sign < 0)
    value = -value;
end
end

function value = pick(condition, one, other)
% One of two numbers.
if condition
    value = one;
else
    value = other;
end
end

function value = nth(numbers, place)
% The number at a place, counted from 1.
value = numbers(place);
end
"""


class OctaveWriter(Writer):
    """Functions as local functions of a file; `memory` has a field per array, and one per named element."""

    words = Words(
        functions={**{name: name for name in _SAME}, "floor_int": "floor", "int": "fix", "float": "double"},
        infix={"and": "&&", "or": "||", "!=": "~="},
        negation="~({0})",
        infinity="Inf",
        nan="NaN",
        true="true",
        false="false",
        select="pick({0}, {1}, {2})",
        power="(({0}) ^ ({1}))",
        integer_division="floor(({0}) / ({1}))",
        remainder="mod({0}, {1})",
        shift_left="(({0}) * 2 ^ ({1}))",
        shift_right="floor(({0}) / 2 ^ ({1}))",
        loose_and=True,
    )
    reserved = frozenset(_KEYWORDS.split())
    leave, again = "break;", "continue;"

    def program(self, functions: list[Function]) -> str:
        """All functions with what they need."""
        self.functions = {one.name: one for one in functions}
        return HELPERS.strip("\n") + "\n\n" + "\n\n".join(self.function(one) for one in functions)

    def element(self, array: str, index: str, label: str) -> str:
        """An element of memory, whose arrays are counted from 1."""
        return f"memory.{label}" if label else f"memory.{array}({index} + 1)"

    def expression(self, node: Expression) -> str:
        """An expression; places that are known are counted from 1 at once."""
        if isinstance(node, Element) and not node.label and isinstance(node.index, Number):
            return f"memory.{node.array}({int(node.index.value) + 1})"
        return super().expression(node)

    def choose(self, place: str, *numbers: str) -> str:
        """The number at a place."""
        return f"nth([{', '.join(numbers)}], {place} + 1)"

    def call(self, function: Function, arguments: list[str]) -> str:
        """A call."""
        first = ["memory"] if function.reads or function.writes else []
        return f"{function.name}({', '.join(first + arguments)})"

    def _results(self, function: Function, names: list[str]) -> str:
        every = (["memory"] if function.writes else []) + names
        return every[0] if len(every) == 1 else f"[{', '.join(every)}]"

    def function(self, function: Function) -> str:
        """The definition of a function."""
        first = ["memory"] if function.reads or function.writes else []
        results = [f"result_{k + 1}" for k in range(len(function.results))]
        given = ", ".join(first + [self.variable(v.name) for v in function.arguments])
        head = f"function {self._results(function, results)} = {function.name}({given})"
        words = f"% {function.words}." if function.words else None
        lines = [head, words, *self.block(function.body, 0), "end"]
        return "\n".join(line for line in lines if line is not None)

    def let(self, name: str, value: str) -> str:
        """A variable takes a value."""
        return f"{name} = {value};"

    def invoke(self, names: tuple[str, ...], function: Function, arguments: list[str]) -> list[str]:
        """A call of a function with several results."""
        return [f"{self._results(function, list(names))} = {self.call(function, arguments)};"]

    def returned(self, values: list[str]) -> list[str]:
        """A return."""
        return [*(f"result_{k} = {value};" for k, value in enumerate(values, 1)), "return;"]

    def branch(self, condition: str, then: list[str], otherwise: list[str]) -> list[str]:
        """A condition."""
        out = [f"if {condition}", *then]
        return [*out, "else", *otherwise, "end"] if otherwise else [*out, "end"]

    def loop(self, condition: Expression, body: list[str]) -> list[str]:
        """A loop with a condition."""
        return [f"while {self.expression(condition)}", *body, "end"]

    def count(self, name: str, start: str, stop: str, body: list[str]) -> list[str]:
        """A loop over whole numbers."""
        return [f"for {name} = {start}:({stop} - 1)", *body, "end"]
