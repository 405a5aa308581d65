"""What a public docstring has to say, measured on the source: shapes, errors, units, sources.

A name counts as described where one sentence, or one part of it between semicolons, has the name together with a shape
(a unit); "as in `other`" takes over what the other docstring says. A method may leave its names to its class, and a
term of an effect its source to the module. `tests/test_docstrings.py` lists the rules.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ARRAY = re.compile(r"\b(Array|Flags|Integers|NDArray|ArrayLike|ndarray)\b")
NUMBER = re.compile(r"\b(float|complex|Array|ArrayLike|float64|complex128)\b")

# Units are asked for where quantities are physical, sources where physics or statistics are computed.
WITH_UNITS = (
    "linid/physics/",
    "linid/simulation/",
    "linid/recording/",
    "linid/design/",
    "linid/identification/signals/",
    "linid/identification/guess/",
    "linid/identification/uncertainty/",
)
SOURCED = ("linid/physics/", "linid/statistics.py")

_DIM = r"(?:\.\.\.|\w+(?:\([\w ]+\))?(?: ?[-+*/] ?\w+)*)"
_TUPLE = re.compile(rf"\(({_DIM}),(?: ?({_DIM}(?:, ?{_DIM})*))?\)")
# One dimension of a matrix at least is a number, one or two letters, a constant, or one of these words.
_WORDS = "samples|points|states|orders|count|rows|modes|windows|steps|parameters|recordings|columns|places"
_SURE = re.compile(rf"[1-9]\d*\b.*|[A-Za-z]{{1,2}}\b.*|[A-Z][A-Z_]+\b.*|len\(.*|\.\.\.|\d?(?:{_WORDS})\b.*")
_SHAPE_WORDS = re.compile(
    r"\b(?:any|same|its|that|whatever) shape\b|\bshapes? (?:of|that)\b|broadcastable shape|\w\W?s shape\b|\bscalar\b",
    re.I,
)
_REFERENCE = re.compile(r"\b(?:[Ss]ee|as\s+(?:in|of|for|by|with))\s+`([\w.]+)`")

_SYMBOLS = "m|s|kg|N|V|Hz|kHz|rad|W|J|H|K|T|ohm|Wb|mm|um|ms|us|dB|mA"
_A_C = r"(?:A|C)(?=\s*(?:$|[;,.):/^|]|\b(?:and|or|s|rms|RMS|per|m|of|for|in|at|by|from|to)\b))"
# What has no unit says so by one of these words.
_NUMBERS = (
    "dimensionless|SI|radians?|degrees|seconds?|shares?|probability|probabilities|p-value|numbers?|counts?|factors?|"
    "ratios?|per cent|exponents?|nomes?|seeds?|fractions?|units?|weights?|relative|log|normalised|correlations?|index|"
    "genes?|samples|costs?|search coordinates?"
)
_UNIT = re.compile(rf"(?<![\w'.])(?:(?:{_SYMBOLS})(?![\w'])|(?<=\bin )A|{_A_C})|\b(?i:{_NUMBERS})(?!\w)|\d %")
# Names that say it themselves: a number's, or one that ends in its unit.
_PLAIN_NAME = re.compile(
    rf" (?:\w+_)?(?:{_NUMBERS}|tolerance|quantile|confidence|kg|kg_m2|mm|hz)$| (?:\w+_)?(?:time|period)_s$"
)
_SOURCE = re.compile(
    r"\bSources?:|\beqs?\. ?\d|\((?:[1-9]\d?)[a-z]?\)|\bpaper\b"
    r"|\b[A-Z][a-z]+(?:,? (?:and|et al|&)[^.;]*?)? ?\(?(?:1[89]|20)\d\d\b"
)
_NEVER = {"NotImplementedError", "AssertionError"}  # mistakes of the program, which nobody is to catch
_FAMILIES = {
    "LinidError": {"UsageError", "ConfigError", "DataError"},
    "OSError": {"IsADirectoryError", "FileNotFoundError", "PermissionError"},
    "LookupError": {"KeyError", "IndexError"},
}

Said = Callable[[str], Any]


@dataclass(frozen=True)
class Finding:
    """One omission: the rule, the file, the line, the dotted name and what is missing."""

    rule: str
    path: str
    line: int
    name: str
    what: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line} {self.name}: {self.what}"


@dataclass
class Definition:
    """A public module, class, function or method; outer: its class' docstring; module: what it stands in."""

    path: str
    name: str
    node: ast.Module | ast.ClassDef | ast.FunctionDef
    outer: str
    module: Module

    @property
    def doc(self) -> str:
        return ast.get_docstring(self.node) or ""

    @property
    def line(self) -> int:
        return getattr(self.node, "lineno", 1)

    @property
    def decorators(self) -> set[str]:
        assert isinstance(self.node, ast.FunctionDef)
        return {ast.unparse(d) for d in self.node.decorator_list}

    @property
    def is_term(self) -> bool:
        """Whether it is a compiled term of an effect, whose arguments `effect.py` describes for all."""
        return isinstance(self.node, ast.FunctionDef) and "term" in self.decorators

    def parameters(self) -> list[tuple[str, str]]:
        """Names and annotations of a function's parameters."""
        assert isinstance(self.node, ast.FunctionDef)
        a = self.node.args
        every = [*a.posonlyargs, *a.args, *a.kwonlyargs, *([a.vararg] if a.vararg else [])]
        return [(p.arg, ast.unparse(p.annotation) if p.annotation else "") for p in every]

    def returned(self) -> str:
        assert isinstance(self.node, ast.FunctionDef)
        return ast.unparse(self.node.returns) if self.node.returns else ""

    def fields(self) -> list[tuple[str, str, str]]:
        """Names, annotations and comments (behind, above, or a description) of a class' public fields."""
        assert isinstance(self.node, ast.ClassDef)
        found = []
        for n in self.node.body:
            if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name) and not n.target.id.startswith("_"):
                above = self.module.lines[n.lineno - 2].strip()
                behind = self.module.lines[(n.end_lineno or n.lineno) - 1].partition("#")[2]
                described = ast.unparse(n.value) if isinstance(n.value, ast.Call) else ""
                text = f"{above if above[:1] == '#' else ''} {behind} {described}"
                found.append((n.target.id, ast.unparse(n.annotation), text))
        return found


Known = dict[str, list[Definition]]  # by the last part of the name


@dataclass
class Module:
    """A source file: its lines, its docstring and its private functions and methods by name."""

    lines: list[str]
    doc: str
    private: dict[str, ast.FunctionDef] = field(default_factory=dict)


def definitions(source: str, path: str, name: str) -> list[Definition]:
    """All public definitions of a module; what stands inside functions is not public."""
    tree = ast.parse(source)
    module = Module(source.splitlines(), ast.get_docstring(tree) or "")
    found = [Definition(path, name, tree, "", module)]

    def visit(body: list[ast.stmt], prefix: str, outer: str) -> None:
        for node in body:
            if isinstance(node, ast.If):
                visit([*node.body, *node.orelse], prefix, outer)
            if isinstance(node, ast.FunctionDef) and node.name.startswith("_"):
                module.private[node.name] = node
            elif isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
                if not any(ast.unparse(d).endswith((".setter", "overload")) for d in node.decorator_list):
                    found.append(Definition(path, f"{prefix}.{node.name}", node, outer, module))
                if isinstance(node, ast.ClassDef):
                    visit(node.body, f"{prefix}.{node.name}", ast.get_docstring(node) or "")

    visit(tree.body, name, "")
    return [] if any(piece.startswith("_") for piece in name.split(".")) else found


def package(root: Path) -> list[Definition]:
    """All public definitions of a package."""
    found: list[Definition] = []
    for path in sorted(root.rglob("*.py")):
        pieces = path.relative_to(root.parent).with_suffix("").parts
        name = ".".join(pieces[:-1] if pieces[-1] == "__init__" else pieces)
        found += definitions(path.read_text(encoding="utf-8"), path.relative_to(root.parent).as_posix(), name)
    return found


def segments(text: str) -> list[str]:
    """A docstring's sentences, and their parts between semicolons."""
    flat = re.sub(r"\s+", " ", re.sub(r"\n\s*\n", ". ", text))
    flat = re.sub(r"\b(eqs?|e\.g|i\.e|cf|Sect|Fig|pp?|vol)\. ", r"\1@ ", flat)
    return [s for s in re.split(r";|\.+\s+|\.+$", flat) if s.strip()]


def shapes(text: str) -> list[str]:
    """Shapes of arrays in a text, such as (n,), (3, n) or `any shape`."""
    found = []
    for match in _TUPLE.finditer(text):
        dims = [d.strip() for d in match.group(0)[1:-1].split(",") if d.strip()]
        if match.group(2) is None or (any(_SURE.fullmatch(d) for d in dims) and not {"0", *dims} <= {"0", "1"}):
            found.append(match.group(0))
    return found + [m.group(0) for m in _SHAPE_WORDS.finditer(text)]


def units(text: str) -> list[str]:
    """Units in a text, or words for what has none."""
    return [m.group(0) for m in _UNIT.finditer(text)]


def named(name: str, text: str) -> bool:
    """Whether a text has a name; one of more than three letters also as words: `phase_currents`, Phase currents."""
    if re.search(rf"(?<![\w.]){re.escape(name)}(?!\w)", text):
        return True
    words = re.escape(name).replace("_", "[_ -]")
    return len(name) > 3 and re.search(rf"(?<![\w.]){words}s?(?!\w)", text, re.I) is not None


def said(name: str, d: Definition, known: Known, what: Said) -> bool:
    """Whether a docstring, or another one that it refers to (one of its module first), says something of a name."""
    texts = [d.doc, d.outer]
    for reference in _REFERENCE.findall(f"{d.doc}\n{d.outer}"):
        others = known.get(reference.rpartition(".")[2], [])
        near = [other for other in others if other.path == d.path]
        texts += [text for other in near or others for text in (other.doc, other.outer)]
    return any(named(name, s) and what(s) for text in texts for s in segments(text))


def lacking(d: Definition, known: Known, kind: re.Pattern[str], what: Said) -> Iterator[str]:
    """Parameters, fields and the returned value of a kind of which the docstring does not say something."""
    if isinstance(d.node, ast.ClassDef):
        for_all = any(re.search(r"\barrays\b", s) and what(s) for s in segments(d.doc))  # (n,) arrays in SI
        for name, annotation, comment in d.fields():
            if kind.search(annotation) and not (for_all or what(comment) or said(name, d, known, what)):
                yield f"field {name}"
    elif isinstance(d.node, ast.FunctionDef):
        for name, annotation in d.parameters():
            if kind.search(annotation) and not said(name, d, known, what):
                yield f"parameter {name}"
        if kind.search(d.returned()) or (kind is NUMBER and d.is_term):
            own = {name for name, _ in d.parameters()}
            rest = [s for s in segments(d.doc) if not _is_item(s, own)]
            if not any(what(s) or _REFERENCE.search(s) for s in rest):
                yield "what is returned"


def _is_item(segment: str, own: set[str]) -> bool:
    """Whether a segment only says what parameters are: `a, b: ...`."""
    head, colon, _ = segment.partition(":")
    names = [n for n in re.split(r",\s*|\s+and\s+", head.strip()) if n]
    return bool(colon) and bool(own & set(names)) and all(re.fullmatch(r"\w+", n) for n in names)


def raised(d: Definition, errors: dict[str, str]) -> set[str]:
    """Classes of errors that a function raises, by itself or in private functions of its module that it calls.

    errors: classes of the errors that functions return, by the function's name. What it catches, it does not raise.
    """
    found: set[str] = set()
    seen: set[str] = set()

    def visit(node: ast.AST, caught: set[str]) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.Lambda | ast.ClassDef):
                continue
            inside = caught
            if isinstance(node, ast.Try) and child in node.body:
                inside = caught | {name for handler in node.handlers for name in _caught(handler)}
            if isinstance(child, ast.Raise) and child.exc is not None:
                what = child.exc.func if isinstance(child.exc, ast.Call) else child.exc
                name = ast.unparse(what).rpartition(".")[2]
                found.update({name if name[:1].isupper() else errors.get(name, "")} - inside - _NEVER)
            if isinstance(child, ast.Call):
                name = ast.unparse(child.func).removeprefix("self.").removeprefix("cls.")
                if name in d.module.private and name not in seen:
                    seen.add(name)
                    visit(d.module.private[name], inside)
            visit(child, inside)

    visit(d.node, set())
    return found - {""}


def _caught(handler: ast.ExceptHandler) -> set[str]:
    kinds = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type] if handler.type else []
    names = {ast.unparse(kind).rpartition(".")[2] for kind in kinds}
    return names.union(*(_FAMILIES.get(name, set()) for name in names))


def returned_errors(every: list[Definition]) -> dict[str, str]:
    """Classes of the errors that functions return, private ones included, by the function's name."""
    functions = [n for d in every for n in [*d.module.private.values(), d.node] if isinstance(n, ast.FunctionDef)]
    kinds = {f.name: ast.unparse(f.returns) for f in functions if f.returns}
    return {name: kind for name, kind in kinds.items() if re.fullmatch(r"\w+Error", kind)}


def says_raises(error: str, text: str) -> bool:
    sentences = re.split(r"\.\s", re.sub(r"\s+", " ", text))
    return any(re.search(r"\braises?\b", s, re.I) and named(error, s) for s in sentences)


def needs_source(d: Definition) -> bool:
    """Whether it computes numbers in a place of physics or statistics: not what is only looked up."""
    if not isinstance(d.node, ast.FunctionDef) or not d.path.startswith(SOURCED) or "property" in d.decorators:
        return False
    return d.is_term or NUMBER.search(d.returned()) is not None


def findings(every: list[Definition]) -> list[Finding]:
    """All omissions."""
    known: Known = {}
    for d in every:
        known.setdefault(d.name.rpartition(".")[2], []).append(d)
    errors = returned_errors(every)
    found: list[Finding] = []
    for d in every:
        missing = [] if d.doc else [("docstring", "has none")]
        missing += [("shape", what) for what in lacking(d, known, ARRAY, shapes)]
        if isinstance(d.node, ast.FunctionDef):
            missing += [("raises", error) for error in sorted(raised(d, errors)) if not says_raises(error, d.doc)]
        if d.path.startswith(WITH_UNITS):
            missing += [("unit", what) for what in lacking(d, known, NUMBER, units) if not _PLAIN_NAME.search(what)]
        texts = (d.doc, d.outer, d.module.doc if d.is_term else "")
        if needs_source(d) and not any(_SOURCE.search(text) for text in texts):
            missing += [("source", "names none")]
        found += [Finding(rule, d.path, d.line, d.name, what) for rule, what in missing]
    return found
