"""Public names say what they are: shapes, units, errors and sources, measured on the source (`docstring_rules.py`).

docstring: every public module, class, function and method has one.
shape: parameters, fields and returned values that are arrays are named, with a shape such as (n,), (3, n) or any shape.
raises: a function says "raises X" of each error that it, or a private function of its module that it calls, raises;
    not of what it catches, nor of mistakes of the program (NotImplementedError, AssertionError).
unit: parameters, fields and returned values that are floats or arrays of them have a unit, or a word for what has none
    (share, ratio, number, nome ...), in the packages of `WITH_UNITS`; terms of effects of what they return.
source: what computes numbers in `SOURCED` names an equation of the paper, author and year, or its "Source:".
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from tests.docstring_rules import Finding, definitions, findings, package

PACKAGE = Path(__file__).resolve().parents[1] / "linid"
RULES = ("docstring", "shape", "raises", "unit", "source")
_SHAPES = "linid.physics.effects.shapes"
EXCEPTIONS = {
    ("source", f"{_SHAPES}.bounded"): "a lower bound, no physics",
    ("source", f"{_SHAPES}.marked"): "reads a bit",
    ("source", f"{_SHAPES}.share_of"): "a proportion",
    ("source", f"{_SHAPES}.sine_pair"): "its sentence is the whole formula",
    ("source", "linid.physics.effects.effect.Outlook.place"): "interpolates a table",
    ("source", "linid.physics.model.Model.vector"): "puts values in their places",
    ("raises", "linid.recording.source.open_source"): "`reading` around it makes a DataError of it",
}


@pytest.fixture(scope="module")
def found() -> list[Finding]:
    return findings(package(PACKAGE))


@pytest.mark.parametrize("rule", RULES)
def test_docstrings_say_it(rule: str, found: list[Finding]) -> None:
    missing = [str(f) for f in found if f.rule == rule and (rule, f.name) not in EXCEPTIONS]
    assert missing == [], f"{len(missing)} without {rule}:\n" + "\n".join(missing)


def test_no_exception_is_left_over(found: list[Finding]) -> None:
    assert set(EXCEPTIONS) - {(f.rule, f.name) for f in found} == set()


def test_the_whole_package_is_measured() -> None:
    kinds = Counter(type(d.node).__name__ for d in package(PACKAGE))
    assert kinds["Module"] > 300 and kinds["FunctionDef"] > 1000 and kinds["ClassDef"] > 250


def missing(source: str, path: str = "linid/physics/made_up.py") -> set[tuple[str, str]]:
    return {(f.rule, f.what) for f in findings(definitions(source, path, "linid.made_up"))}


MODULE = '"""Made up."""\n'


@pytest.mark.parametrize(
    ("source", "wanted"),
    [
        ("", ("docstring", "has none")),
        (MODULE + "def f(): ...", ("docstring", "has none")),
        (MODULE + 'class C:\n    """C."""\n    def f(self): ...', ("docstring", "has none")),
        (MODULE + 'def f(x: Array) -> None:\n    """Of x in m."""', ("shape", "parameter x")),
        (MODULE + 'def f(x: NDArray[Any]) -> None:\n    """Of (n,)."""', ("shape", "parameter x")),
        (
            MODULE + 'def f(x: Flags) -> None:\n    """One of (0, 1) or (a word, another); x."""',
            ("shape", "parameter x"),
        ),
        (MODULE + 'def f(x: Array) -> Array:\n    """It, m.\n\n    x: (n,) m."""', ("shape", "what is returned")),
        (MODULE + 'class C:\n    """C.\n\n    a: m.\n    """\n    a: Array', ("shape", "field a")),
        (MODULE + 'def f() -> None:\n    """F."""\n    raise DataError("")', ("raises", "DataError")),
        (MODULE + 'def f() -> None:\n    """ValueError."""\n    raise ValueError', ("raises", "ValueError")),
        (MODULE + 'def _g(): raise OSError\ndef f():\n    """F."""\n    _g()', ("raises", "OSError")),
        (MODULE + 'def _e() -> DataError: ...\ndef f():\n    """F."""\n    raise _e()', ("raises", "DataError")),
        (MODULE + 'def f(v: float) -> None:\n    """Of v."""', ("unit", "parameter v")),
        (MODULE + 'def f(v: float, w: float) -> None:\n    """Of v in m/s; w."""', ("unit", "parameter w")),
        (MODULE + 'def f() -> float:\n    """A force; it\'s eq. 3."""', ("unit", "what is returned")),
        (MODULE + 'class C:\n    """C."""\n    v: float', ("unit", "field v")),
        (MODULE + '@term\ndef force(t, y):\n    """The drag."""', ("unit", "what is returned")),
        (MODULE + 'def f() -> float:\n    """Force in N."""', ("source", "names none")),
        (MODULE + '@term\ndef force(t, y):\n    """The drag, N."""', ("source", "names none")),
    ],
)
def test_a_lacking_docstring_is_seen(source: str, wanted: tuple[str, str]) -> None:
    assert wanted in missing(source)


RIGHT = '''"""Made up. Source: Somebody 1995."""

def f(v: Array, gain: float) -> Array:
    """Force (n,) in N (42); raises DataError for no samples.

    v: (n,) m/s; gain: N s/m.
    """
    _check(v)

def g(v: Array, gain: float, share: float) -> Array:
    """The other force (n,) in N, eq. 43. v, gain: as in `f`; raises DataError."""
    _check(v)

def _check(v): raise _error()

def _error() -> DataError: ...

def caught() -> None:
    """Nothing."""
    try:
        raise ConfigError("")
    except LinidError:
        raise NotImplementedError from None

@term
def force(t, y, v):
    """The drag, N."""

class C:
    """Motion, (n,) arrays in SI; period: s."""
    t: Array
    y: Array
    period: float
    mask: Flags  # (3, n)
    _hidden: Array

    def at(self, y: Array) -> float:
        """Speed in m/s at y, any shape, m (Author and Other 1999)."""
        def inside(x: float): raise ValueError

    @property
    def length(self) -> float:
        """Length in m."""

def _private(x: Array): ...
'''


def test_a_right_docstring_passes() -> None:
    assert missing(RIGHT) == set()


def test_units_and_sources_are_asked_for_where_they_belong() -> None:
    source = MODULE + 'def f(v: float) -> float:\n    """Of v."""'
    assert {rule for rule, _ in missing(source)} == {"unit", "source"}
    assert {rule for rule, _ in missing(source, "linid/recording/made_up.py")} == {"unit"}
    assert missing(source, "linid/workflow/made_up.py") == set()
