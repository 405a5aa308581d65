"""Scoring a diagnosis against the sealed keys.

Rules: a single effect counts 1 when the verdict is `identified` with exactly its name, and one half when it is
`ambiguous` with a group of two that holds it. `none`, `unknown` and `ambiguous` are never "named but wrong"; that is
`identified` with a name that is not in the key.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from linid.challenge.files import DIAGNOSIS_FILE, RESULTS_FOLDER, Key
from linid.errors import DataError

STATUSES = ("none", "identified", "ambiguous", "unknown")
FAILED = "failed"
BINS = (0.05, 0.1, 0.2, 0.5, 1.0)
ORACLE_FILE = "oracle.json"
FRESH_FILE = "fresh.json"
# Share of the held-out excess that the true effects must close for an effect to count as visible, or as faint.
VISIBLE, FAINT = 0.5, 0.2
# Held-out excess, in floors, from which an effect outside the library matters.
MATTERS = 0.3


@dataclass(frozen=True)
class Answer:
    """What a diagnosis said of one campaign.

    named: effects of its verdict; group: those of an ambiguous one; ranking: effects best first; closure: share of the
    gap closed by the verdict's model, oracle: by the true effects; weakest: the least that one of those closes of what
    the others leave; covered, fresh: how many of how many gaps of fresh recordings lie in the 95 % intervals stated for
    them; excess: held-out excess of the base over the floor, in floors.
    """

    status: str
    named: tuple[str, ...] = ()
    group: tuple[str, ...] = ()
    ranking: tuple[str, ...] = ()
    closure: float | None = None
    oracle: float | None = None
    weakest: float | None = None
    covered: int = 0
    fresh: int = 0
    excess: float | None = None


@dataclass(frozen=True)
class Line:
    """One scored campaign. strength: of the weakest hidden effect; top_1, top_3: 0, 1/2 or 1 (None where the rule does
    not apply); wrong: a name was given that is not in the key."""

    campaign: str
    kind: str
    hidden: tuple[str, ...]
    strength: float | None
    answer: Answer
    top_1: float | None
    top_3: float | None
    wrong: bool


@dataclass(frozen=True)
class Rate:
    """`count` of `total` (count may hold halves) with the 95 % Wilson interval; nan without any."""

    count: float
    total: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The rate itself."""
        return self.count / self.total if self.total else math.nan


@dataclass(frozen=True)
class Bin:
    """Rates of the campaigns whose strength lies in [low, high)."""

    low: float
    high: float
    top_1: Rate
    top_3: Rate
    wrong: Rate
    silent: Rate


@dataclass(frozen=True)
class Score:
    """All figures of a scored challenge. confusion: (rows, columns, counts): key against verdict."""

    lines: tuple[Line, ...]
    rates: dict[str, Rate]
    bins: tuple[Bin, ...]
    confusion: tuple[tuple[str, ...], tuple[str, ...], tuple[tuple[float, ...], ...]]
    closure: float | None
    relative_closure: float | None
    relative_count: int


def rate(values: Iterable[float]) -> Rate:
    """Mean of values in [0, 1] with its 95 % Wilson score interval."""
    from scipy.stats import norm

    listed = list(values)
    n, k = len(listed), float(sum(listed))
    if n == 0:
        return Rate(0.0, 0, math.nan, math.nan)
    z = float(norm.ppf(0.975))
    p = k / n
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return Rate(k, n, max(0.0, middle - half), min(1.0, middle + half))


def read_answer(folder: Path) -> Answer:
    """The answer in a result folder: diagnosis.json, with oracle.json and fresh.json where they exist.

    No diagnosis.json: `failed`. fresh.json: {"gaps": [{"recording", "measure", "value", "low", "high"}]}, the gap
    measured on fresh recordings beside the interval stated for it. Raises DataError for what is not in the schema.
    """
    if not (folder / DIAGNOSIS_FILE).exists():
        return Answer(FAILED)
    body = _json(folder / DIAGNOSIS_FILE)
    try:
        verdict = body["verdict"]
        status = str(verdict["status"])
        effects = tuple(map(str, verdict.get("effects", ())))
        equivalent = tuple(map(str, verdict.get("equivalent", ())))
        ranking = list(body.get("ranking", ()))
        names = tuple(dict.fromkeys(str(n) for entry in ranking for n in entry.get("effects", [entry["effect"]])))
        closure = body.get("closure", verdict.get("closure"))
        if closure is None:
            # The model of the verdict, or the best one where nothing was named.
            wanted = next((e for e in ranking if e["effect"] in effects), ranking[0] if ranking else {})
            closure = wanted.get("closure")
    except (KeyError, TypeError, AttributeError, IndexError):
        raise _bad(folder / DIAGNOSIS_FILE, "does not follow the schema of a diagnosis") from None
    if status not in STATUSES:
        raise _bad(folder / DIAGNOSIS_FILE, f"has the status {status!r}")
    known = _json(folder / ORACLE_FILE) if (folder / ORACLE_FILE).exists() else {}
    each = [_finite(value) for value in known.get("each", {}).values()]
    gaps = _json(folder / FRESH_FILE).get("gaps", []) if (folder / FRESH_FILE).exists() else []
    return Answer(
        status,
        effects if status == "identified" else (),
        tuple(dict.fromkeys(effects + equivalent)) if status == "ambiguous" else (),
        names,
        _finite(closure),
        _finite(known.get("closure")),
        None if not each or None in each else min(value for value in each if value is not None),
        sum(gap["low"] <= gap["value"] <= gap["high"] for gap in gaps),
        len(gaps),
        _excess(body.get("excess") or {}),
    )


def read_answers(folder: Path, names: Iterable[str]) -> dict[str, Answer]:
    """The answers of a challenge's results; raises DataError when there are none at all."""
    results = folder / RESULTS_FOLDER
    if not results.is_dir():
        raise DataError(str(results), "does not exist", "Run `linid challenge run` first.")
    return {name: read_answer(results / name) for name in names}


def score_line(name: str, key: Key, answer: Answer) -> Line:
    """Score one campaign."""
    hidden = set(key.effects)
    wrong = bool(set(answer.named) - hidden) if key.kind != "unknown" else bool(answer.named)
    top_1 = top_3 = None
    if key.kind == "single":
        half = 0.5 if len(answer.group) == 2 and hidden <= set(answer.group) else 0.0
        top_1 = 1.0 if set(answer.named) == hidden else half
        top_3 = 1.0 if hidden <= set(answer.ranking[:3]) else top_1
    elif key.kind == "pair":
        top_1 = 1.0 if set(answer.named) == hidden else 0.0
        top_3 = 1.0 if hidden <= set(answer.ranking[:3]) else top_1
    return Line(name, key.kind, key.effects, key.weakest, answer, top_1, top_3, wrong)


def score(keys: Mapping[str, Key], answers: Mapping[str, Answer], bins: Sequence[float] = BINS) -> Score:
    """Score all campaigns; bins: edges of strength."""
    lines = tuple(score_line(name, key, answers[name]) for name, key in keys.items())
    singles = _of(lines, "single")
    pairs = _of(lines, "pair")
    none = _of(lines, "none")
    unknown = _of(lines, "unknown")
    rates = {
        "top_1": rate(_marks(singles, lambda x: x.top_1)),
        "top_3": rate(_marks(singles, lambda x: x.top_3)),
        "top_1_visible": rate(_marks(_reached(singles, VISIBLE, math.inf), lambda x: x.top_1)),
        "top_3_visible": rate(_marks(_reached(singles, VISIBLE, math.inf), lambda x: x.top_3)),
        "top_1_faint": rate(_marks(_reached(singles, FAINT, VISIBLE), lambda x: x.top_1)),
        "named_but_wrong": rate(_marks(lines, lambda x: x.wrong)),
        "false_alarms": rate(_marks(none, lambda x: x.answer.status in ("identified", "ambiguous", "unknown"))),
        "false_names": rate(_marks(none, lambda x: x.answer.status == "identified")),
        "unknown_recall_visible": rate(
            _marks((x for x in unknown if (x.answer.excess or 0.0) >= MATTERS), lambda x: x.answer.status == "unknown")
        ),
        "unknown_recall": rate(_marks(unknown, lambda x: x.answer.status == "unknown")),
        "pairs_both_named": rate(_marks(pairs, lambda x: x.top_1)),
        "pairs_both_visible": rate(
            _marks((x for x in pairs if (x.answer.weakest or 0.0) >= VISIBLE), lambda x: x.top_1)
        ),
        "pairs_one_named": rate(
            _marks(pairs, lambda x: x.top_1 == 0 and bool(set(x.answer.named) & set(x.hidden)) and not x.wrong)
        ),
        "interval_coverage": _coverage(lines),
        "failed": rate(_marks(lines, lambda x: x.answer.status == FAILED)),
    }
    hiding = [line for line in lines if line.hidden]
    closures = [line.answer.closure for line in hiding if line.answer.closure is not None]
    relative = [
        line.answer.closure / line.answer.oracle
        for line in hiding
        if line.answer.closure is not None and line.answer.oracle is not None and line.answer.oracle > 0
    ]
    return Score(
        lines, rates, tuple(_bins(singles, bins)), confusion(lines), median(closures) if closures else None,
        median(relative) if relative else None, len(relative),
    )  # fmt: skip


def confusion(lines: Sequence[Line]) -> tuple[tuple[str, ...], tuple[str, ...], tuple[tuple[float, ...], ...]]:
    """Key against verdict for all campaigns but pairs; effects outside the library are one row `unknown`.

    A verdict of several names counts in equal parts for each.
    """
    cells: dict[tuple[str, str], float] = {}
    for line in lines:
        if line.kind == "pair":
            continue
        row = line.hidden[0] if line.kind == "single" else line.kind
        said = line.answer.named or (line.answer.status,)
        for name in said:
            cells[row, name] = cells.get((row, name), 0.0) + 1 / len(said)
    last = ("none", "unknown", "ambiguous", FAILED)
    rows = sorted({row for row, _ in cells} - set(last)) + [n for n in last if any(r == n for r, _ in cells)]
    said_names = sorted({c for _, c in cells} | {r for r, _ in cells} - set(last) - set(last))
    columns = [n for n in said_names if n not in last] + [n for n in last if any(c == n for _, c in cells) or n in rows]
    counts = tuple(tuple(cells.get((row, column), 0.0) for column in columns) for row in rows)
    return tuple(rows), tuple(columns), counts


def _of(lines: Sequence[Line], kind: str) -> list[Line]:
    return [line for line in lines if line.kind == kind]


def _reached(lines: Iterable[Line], low: float, high: float) -> list[Line]:
    """Campaigns in which the true effects close a share of the excess in [low, high)."""
    return [x for x in lines if x.answer.oracle is not None and low <= x.answer.oracle < high]


def _marks(lines: Iterable[Line], mark: Callable[[Line], Any]) -> list[float]:
    return [float(mark(line)) for line in lines]


def _coverage(lines: Sequence[Line]) -> Rate:
    covered = sum(line.answer.covered for line in lines)
    total = sum(line.answer.fresh for line in lines)
    return rate([1.0] * covered + [0.0] * (total - covered))


def _bins(singles: Sequence[Line], edges: Sequence[float]) -> Iterable[Bin]:
    """Bins of strength; what lies below the first or above the last edge joins the outermost bin."""
    for i in range(len(edges) - 1):
        low = -math.inf if i == 0 else edges[i]
        high = math.inf if i == len(edges) - 2 else edges[i + 1]
        inside = [x for x in singles if x.strength is not None and low <= x.strength < high]
        yield Bin(
            edges[i], edges[i + 1], rate(_marks(inside, lambda x: x.top_1)), rate(_marks(inside, lambda x: x.top_3)),
            rate(_marks(inside, lambda x: x.wrong)), rate(_marks(inside, lambda x: x.answer.status == "none")),
        )  # fmt: skip


def _json(path: Path) -> dict[str, Any]:
    try:
        body = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise _bad(path, "cannot be read as JSON") from None
    if not isinstance(body, dict):
        raise _bad(path, "is not a JSON object")
    return body


def _bad(path: Path, fact: str) -> DataError:
    return DataError(str(path), fact, "Remove the folder and run the challenge with --resume.")


def _excess(stated: Mapping[str, Any]) -> float | None:
    before, floor = _finite(stated.get("before")), _finite(stated.get("floor"))
    return None if before is None or not floor else before / floor


def _finite(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None
