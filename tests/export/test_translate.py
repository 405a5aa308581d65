"""Translated functions give what the originals give: every term of every effect, motor and law, in C and in Python."""

from __future__ import annotations

import ctypes
import inspect
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.errors import ConfigError
from linid.export.translate.program import Program
from linid.export.translate.tree import Number
from linid.export.translate.values import Group, Known, Running, Value, leaves
from linid.export.translate.writers.c import CWriter
from linid.export.translate.writers.python import PRELUDE, PythonWriter
from linid.physics import friction
from linid.physics.effects.registry import EFFECTS
from linid.physics.laws.registry import LAWS
from tests.export.compiler import compiled, needs_compiler

REAL = Running(Number(0.0, "float"))
CLOSE = 1e-12  # relative: libraries round the last digits of their functions differently
TERMS = {f"{effect.name}_{name}": term for effect in EFFECTS for name, term in effect.terms.items()}
TERMS |= {f"{law.name}_rate": law.rate for law in LAWS.values() if law.rate is not None}
_OWN = 4  # numbers of a law's own parameters, which come as a tuple


def forms(term: Any) -> list[Value]:
    """Real arguments, a law's own parameters as a tuple."""
    names = inspect.signature(term.py_func).parameters
    return [Group((REAL,) * _OWN) if name == "own" else REAL for name in names]


class Translated:
    """All terms in one program. results: forms of what they give; used: which of their numbers each takes."""

    def __init__(self) -> None:
        self.program = Program()
        self.made = {name: self.program.entry(term, forms(term), name) for name, term in TERMS.items()}
        self.functions = self.program.needed([one.function.name for one in self.made.values()])

    def values(self, name: str, found: tuple[float, ...]) -> list[float]:
        """What a term gives, with what of it is known beforehand."""
        rest = iter(found)
        parts = (leaf for _, leaf in leaves(self.made[name].result))
        return [next(rest) if isinstance(leaf, Running) else float(leaf.value) for leaf in parts]  # type: ignore[union-attr]

    def taken(self, name: str, numbers: list[float]) -> list[float]:
        """Those of a term's numbers that its translation takes."""
        return [x for x, used in zip(numbers, self.made[name].used, strict=True) if used]


@pytest.fixture(scope="module")
def translated() -> Translated:
    return Translated()


@pytest.fixture(scope="module")
def in_python(translated: Translated) -> dict[str, Any]:
    names: dict[str, Any] = {"math": math}
    exec(PRELUDE + PythonWriter().program(translated.functions), names)
    return names


@pytest.fixture(scope="module")
def in_c(translated: Translated, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, list[float]], list[float]]:
    """Terms by name, compiled in one library."""
    folder = tmp_path_factory.mktemp("terms")
    writer = CWriter("void")
    text = "#include <math.h>\n" + writer.program(translated.functions)
    for name, made in translated.made.items():
        function = made.function
        given_ = [f"x[{k}]" for k in range(len(function.arguments))]
        if len(function.results) == 1:
            body = f"y[0] = {writer.function_name(function)}({', '.join(given_)});"
        elif function.results:
            back = [f"y + {k}" for k in range(len(function.results))]
            body = f"{writer.function_name(function)}({', '.join([*given_, *back])});"
        else:
            body = ""
        text += f"\nvoid call_{name}(const double *x, double *y) {{ (void)x; (void)y; {body} }}\n"
    (folder / "terms.c").write_text(text, encoding="utf-8")
    library = ctypes.CDLL(str(compiled([folder / "terms.c"], folder / "terms.so", "-shared", "-fPIC", "-Wno-unused")))

    def call(name: str, numbers: list[float]) -> list[float]:
        made = translated.made[name]
        x = np.array([*translated.taken(name, numbers), 0.0])
        y = np.zeros(8)
        pointer = ctypes.POINTER(ctypes.c_double)
        getattr(library, f"call_{name}")(x.ctypes.data_as(pointer), y.ctypes.data_as(pointer))
        return translated.values(name, tuple(y[: len(made.function.results)].tolist()))

    return call


def original(name: str, numbers: list[float]) -> list[float]:
    """What the compiled term itself gives."""
    rest = iter(numbers)
    arguments = [
        tuple(next(rest) for _ in range(_OWN)) if isinstance(f, Group) else next(rest) for f in forms(TERMS[name])
    ]
    found = TERMS[name](*arguments)
    return [float(x) for x in (found if isinstance(found, tuple) else (found,))]


def alike(found: list[float], wanted: list[float]) -> bool:
    """Equal but for rounding; what is no number, or infinite, is so in both."""
    return bool(np.allclose(found, wanted, rtol=CLOSE, atol=1e-300 + CLOSE * max(map(abs, wanted)), equal_nan=True))


def count(name: str) -> int:
    return sum(_OWN if isinstance(form, Group) else 1 for form in forms(TERMS[name]))


# Plausible magnitudes of both signs, and the edges at which terms branch. The examples are always the same: among all,
# some cancel to their last digits, which compilers round differently.
NUMBERS = st.one_of(
    st.sampled_from([0.0, 1.0, -1.0, 2.0, 16.0]), st.floats(1e-3, 5.0), st.floats(-1.0, 1.0), st.floats(1e-6, 1e-2)
)


@needs_compiler
@pytest.mark.parametrize("name", list(TERMS))
@given(data=st.data())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_a_term_is_the_same_in_c(name: str, in_c: Callable[[str, list[float]], list[float]], data: Any) -> None:
    numbers = data.draw(st.lists(NUMBERS, min_size=count(name), max_size=count(name)))
    with np.errstate(all="ignore"):
        wanted = original(name, numbers)
    if all(map(math.isfinite, wanted)):  # beyond what a term is made for, nobody says which infinity comes out
        assert alike(in_c(name, numbers), wanted)


@pytest.mark.parametrize("name", list(TERMS))
@given(data=st.data())
@settings(max_examples=30, deadline=None, derandomize=True)
def test_a_term_is_the_same_in_python(name: str, translated: Translated, in_python: dict[str, Any], data: Any) -> None:
    numbers = data.draw(st.lists(NUMBERS, min_size=count(name), max_size=count(name)))
    wanted = original(name, numbers)
    if not all(map(math.isfinite, wanted)):
        return
    try:
        found = in_python[translated.made[name].function.name](*translated.taken(name, numbers))
    except (ZeroDivisionError, ValueError):  # Python refuses what others call infinite or no number on the way
        return
    assert alike(translated.values(name, found if isinstance(found, tuple) else (found,)), wanted)


def made_of(function: Any, arguments: list[Value]) -> Any:
    """A function's translation, to be called."""
    program = Program()
    made = program.entry(function, arguments, "made")
    names: dict[str, Any] = {"math": math}
    exec(PRELUDE + PythonWriter().program(program.needed([made.function.name])), names)
    return names[made.function.name]


@given(st.floats(-30.0, 1.0), st.floats(-4.0, 4.0))
def test_the_step_of_the_bristle_is_the_same(half_trace: float, square: float) -> None:
    wanted = friction._phi_pairs(half_trace, square)
    assert alike(list(PAIRS(half_trace, square)), list(wanted))


PAIRS = made_of(friction._phi_pairs, [REAL, REAL])


# Functions that try what the translation does with loops, conditions and names that change.


def swaps(a, b, n):
    for _ in range(40):
        a, b = b, a + b
        if b > n:
            break
    return a, b


def chooses(x, known):
    y = 3.0 * x if known == 2 else nowhere(x)  # noqa: F821 - never reached: what is known decides
    places = (x, 2.0 * x, 4.0 * x)
    total = 0.0
    for k in range(3):
        total += places[k] if x > 0.0 and k != 1 else -1.0
    k = int(abs(y)) % 3
    return total + places[k]


def early(x):
    while True:
        x *= 0.5
        if x < 1.0:
            return x


def unsupported(x):
    return sorted([x])[0]


def test_loops_and_conditions_keep_their_meaning() -> None:
    assert made_of(swaps, [REAL] * 3)(1.0, 1.0, 50.0) == swaps(1.0, 1.0, 50.0)
    translated_ = made_of(chooses, [REAL, Known(2)])
    assert [translated_(x) for x in (-0.4, 0.3, 0.7)] == [chooses(x, 2) for x in (-0.4, 0.3, 0.7)]
    assert made_of(early, [REAL])(37.0) == early(37.0)


def test_what_cannot_be_translated_is_named_with_its_line() -> None:
    line = unsupported.__code__.co_firstlineno + 1
    with pytest.raises(ConfigError, match=rf"test_translate\.py:{line}: .*cannot be translated"):
        made_of(unsupported, [REAL])
