"""The small tree as Python that needs nothing but `math`."""

from __future__ import annotations

from linid.export.translate.tree import Expression, Function
from linid.export.translate.writers.writer import Words, Writer

_FUNCTIONS = {
    "exp": "exp",
    "expm1": "math.expm1",
    "log": "math.log",
    "sin": "math.sin",
    "cos": "math.cos",
    "tan": "math.tan",
    "tanh": "math.tanh",
    "atan": "math.atan",
    "atan2": "math.atan2",
    "sqrt": "math.sqrt",
    "copysign": "math.copysign",
    "isnan": "math.isnan",
    "floor_int": "math.floor",
    "floor": "math.floor",
    "round": "round",
    "int": "int",
    "float": "float",
    "abs": "abs",
    "min": "min",
    "max": "max",
}
# math.exp ends where others give infinity.
PRELUDE = '''

def exp(x):
    """Infinite where a double ends."""
    return math.exp(x) if x < 709.0 else math.inf
'''


class PythonWriter(Writer):
    """Functions as Python; memory is one object with an attribute per array, and one per named element."""

    words = Words(
        functions=_FUNCTIONS,
        infix={"and": "and", "or": "or"},
        negation="not {0}",
        infinity="math.inf",
        nan="math.nan",
        true="True",
        false="False",
        select="({1} if {0} else {2})",
        power="{0} ** {1}",
        integer_division="{0} // {1}",
        remainder="{0} % {1}",
    )

    def choose(self, place: str, *numbers: str) -> str:
        """The number at a place."""
        return f"({', '.join(numbers)})[{place}]"

    def element(self, array: str, index: str, label: str) -> str:
        """An element of memory."""
        return f"memory.{label}" if label else f"memory.{array}[{index}]"

    def call(self, function: Function, arguments: list[str]) -> str:
        """A call."""
        first = ["memory"] if function.reads or function.writes else []
        return f"{function.name}({', '.join(first + arguments)})"

    def function(self, function: Function) -> str:
        """The definition of a function."""
        first = ["memory"] if function.reads or function.writes else []
        head = f"def {function.name}({', '.join(first + [self.variable(v.name) for v in function.arguments])}):"
        words = f'    """{function.words}."""' if function.words else None
        body = self.block(function.body, 1) or ["    pass"]
        return "\n".join(line for line in (head, words, *body) if line is not None) + "\n"

    def let(self, name: str, value: str) -> str:
        """A variable takes a value."""
        return f"{name} = {value}"

    def invoke(self, names: tuple[str, ...], function: Function, arguments: list[str]) -> list[str]:
        """A call of a function with several results."""
        call = self.call(function, arguments)
        return [f"{', '.join(names)} = {call}" if names else call]

    def returned(self, values: list[str]) -> list[str]:
        """A return."""
        return [f"return {', '.join(values)}".rstrip()]

    def branch(self, condition: str, then: list[str], otherwise: list[str]) -> list[str]:
        """A condition."""
        out = [f"if {condition}:", *then]
        return [*out, "else:", *otherwise] if otherwise else out

    def loop(self, condition: Expression, body: list[str]) -> list[str]:
        """A loop with a condition."""
        return [f"while {self.expression(condition)}:", *body]

    def count(self, name: str, start: str, stop: str, body: list[str]) -> list[str]:
        """A loop over whole numbers."""
        return [f"for {name} in range({start}, {stop}):", *body]

    leave, again = "break", "continue"
