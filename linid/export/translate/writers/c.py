"""The small tree as C99 without allocation: memory is one structure, several results go by pointers."""

from __future__ import annotations

from linid.export.translate.tree import Expression, Function, Kind, Operation
from linid.export.translate.writers.writer import Words, Writer

_TYPES: dict[Kind, str] = {"float": "double", "int": "long", "bool": "int"}
_FUNCTIONS = {
    **{
        n: n for n in ("exp", "expm1", "log", "sin", "cos", "tan", "tanh", "atan", "atan2", "sqrt", "copysign", "isnan")
    },
    "floor": "floor",
    "floor_int": "(long)floor",
    "round": "lrint",
    "int": "(long)",
    "float": "(double)",
    "abs": "fabs",
    "min": "smaller",
    "max": "larger",
}
_WHOLE = {"abs": "labs", "min": "smaller_whole", "max": "larger_whole"}
_KEYWORDS = (
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while main "
    "exp expm1 log sin cos tan tanh atan atan2 sqrt copysign isnan floor lrint fabs labs pow y0 y1 yn j0 j1 jn gamma "
    "div index remove smaller larger smaller_whole larger_whole"
)
HELPERS = {
    "smaller": "static double smaller(double a, double b) { return b < a ? b : a; }",
    "larger": "static double larger(double a, double b) { return b > a ? b : a; }",
    "smaller_whole": "static long smaller_whole(long a, long b) { return b < a ? b : a; }",
    "larger_whole": "static long larger_whole(long a, long b) { return b > a ? b : a; }",
}


class CWriter(Writer):
    """Functions as static C functions of a structure `memory`. type: the structure's name."""

    words = Words(
        functions=_FUNCTIONS,
        infix={"and": "&&", "or": "||"},
        negation="!({0})",
        infinity="HUGE_VAL",
        nan="NAN",
        true="1",
        false="0",
        select="({0} ? {1} : {2})",
        power="pow({0}, {1})",
        integer_division="{0} / {1}",
        remainder="{0} % {1}",
        shift_left="(({0}) << ({1}))",
        shift_right="(({0}) >> ({1}))",
        loose_and=True,
    )
    leave, again = "break;", "continue;"
    reserved = frozenset(_KEYWORDS.split())

    def __init__(self, structure: str) -> None:
        self.type = structure
        self._results: tuple[str, ...] = ()

    def program(self, functions: list[Function]) -> str:
        """All functions, behind what they need."""
        self.functions = {one.name: one for one in functions}
        text = "\n".join(self.function(one) for one in functions)
        helpers = [line for name, line in HELPERS.items() if f"{name}(" in text]
        return "\n".join([*helpers, "", text])

    def element(self, array: str, index: str, label: str) -> str:
        """An element of memory."""
        return f"memory->{array}[{array.upper()}_{label}]" if label else f"memory->{array}[{index}]"

    def choose(self, place: str, *numbers: str) -> str:
        """The number at a place."""
        return f"(const double[]){{{', '.join(numbers)}}}[{place}]"

    def library(self, node: Operation, arguments: list[str]) -> str:
        """A function of the mathematical library, or one of whole numbers."""
        name = self.words.functions[node.name]
        if node.kind == "int" and node.name in _WHOLE:
            name = _WHOLE[node.name]
        return f"{name}({', '.join(arguments)})"

    def call(self, function: Function, arguments: list[str]) -> str:
        """A call."""
        first = ["memory"] if function.reads or function.writes else []
        return f"{self.function_name(function)}({', '.join(first + arguments)})"

    def function_name(self, function: Function) -> str:
        """A function's name, which no word of the language has."""
        return f"{function.name}_of" if function.name in self.reserved else function.name

    def function(self, function: Function) -> str:
        """The definition of a function."""
        several = len(function.results) > 1
        first = (
            [f"{'' if function.writes else 'const '}{self.type} *memory"] if function.reads | function.writes else []
        )
        given = [f"{_TYPES[v.kind]} {self.variable(v.name)}" for v in function.arguments]
        self._results = tuple(f"result_{k + 1}" for k in range(len(function.results))) if several else ()
        back = [f"{_TYPES[kind]} *{name}" for name, kind in zip(self._results, function.results, strict=False)]
        type_ = _TYPES[function.results[0]] if len(function.results) == 1 else "void"
        head = f"static {type_} {self.function_name(function)}({', '.join([*first, *given, *back]) or 'void'})"
        words = f"/* {function.words.replace('*/', '')}. */" if function.words else None
        declared = [f"    {_TYPES[kind]} {self.variable(name)};" for name, kind in sorted(function.variables.items())]
        lines = [words, head, "{", *declared, *self.block(function.body, 1), "}", ""]
        return "\n".join(line for line in lines if line is not None)

    def let(self, name: str, value: str) -> str:
        """A variable takes a value."""
        return f"{name} = {value};"

    def invoke(self, names: tuple[str, ...], function: Function, arguments: list[str]) -> list[str]:
        """A call of a function with several results."""
        if len(names) == 1:
            return [f"{names[0]} = {self.call(function, arguments)};"]
        return [self.call(function, [*arguments, *(f"&{name}" for name in names)]) + ";"]

    def returned(self, values: list[str]) -> list[str]:
        """A return."""
        if len(values) == 1:
            return [f"return {values[0]};"]
        return [*(f"*{name} = {value};" for name, value in zip(self._results, values, strict=True)), "return;"]

    def branch(self, condition: str, then: list[str], otherwise: list[str]) -> list[str]:
        """A condition."""
        out = [f"if ({condition}) {{", *then]
        return [*out, "} else {", *otherwise, "}"] if otherwise else [*out, "}"]

    def loop(self, condition: Expression, body: list[str]) -> list[str]:
        """A loop with a condition."""
        return [f"while ({self.expression(condition)}) {{", *body, "}"]

    def count(self, name: str, start: str, stop: str, body: list[str]) -> list[str]:
        """A loop over whole numbers."""
        return [f"for ({name} = {start}; {name} < {stop}; {name}++) {{", *body, "}"]
