"""What a diagnosis said of one campaign, read from its result folder."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from linid.challenge.files import DIAGNOSIS_FILE, RESULTS_FOLDER
from linid.errors import DataError

STATUSES = ("none", "explained", "partly explained", "unknown")
FAILED = "failed"
ORACLE_FILE = "oracle.json"
FRESH_FILE = "fresh.json"
_LAW = {"maxwell_slip": "maxwell"}  # the plant's names of laws that the diagnosis calls otherwise


@dataclass(frozen=True)
class Stated:
    """A share of the gap with its 95 % interval; None where nothing was stated."""

    share: float | None = None
    low: float | None = None
    high: float | None = None

    def covers(self, value: float) -> bool | None:
        """Whether the interval holds a value; None without an interval."""
        return None if self.low is None or self.high is None else self.low <= value <= self.high


@dataclass(frozen=True)
class BudgetEntry:
    """One cause of the budget: its name, names that these recordings cannot tell from it, and its share."""

    effect: str
    rivals: tuple[str, ...] = ()
    stated: Stated = Stated()


@dataclass(frozen=True)
class Proposal:
    """A term proposed for what no listed effect explains: what it depends on, and the share of the excess that it
    closes (None: not stated); refines: named effects of whose form it may be a part."""

    arguments: tuple[str, ...]
    closed: float | None = None
    refines: tuple[str, ...] = ()


@dataclass(frozen=True)
class Answer:
    """What a diagnosis said of one campaign.

    entries: of its budget, the largest share first; unexplained: the share that it leaves; closure: share of the
    gap closed by the verdict's model, oracle: by the true effects; weakest: the least that one of those closes of
    what the others leave; ahead: held-out error 0.1 s ahead over that which the true term would leave; covered,
    fresh: how many of how many gaps of fresh recordings lie in the 95 % intervals stated for them; excess: held-out
    excess of the base over the floor, in floors; proposal: None where no term is proposed; law: of friction, by the
    plant's name, None where it is not told.
    """

    status: str
    entries: tuple[BudgetEntry, ...] = ()
    unexplained: Stated = Stated()
    closure: float | None = None
    oracle: float | None = None
    weakest: float | None = None
    ahead: float | None = None
    covered: int = 0
    fresh: int = 0
    excess: float | None = None
    proposal: Proposal | None = None
    law: str | None = None

    @property
    def another_cause(self) -> bool:
        """Whether a term is proposed as a cause beyond the named ones."""
        return self.proposal is not None and not self.proposal.refines

    @property
    def named(self) -> tuple[str, ...]:
        """Effects of the budget in order of size."""
        return tuple(entry.effect for entry in self.entries)


def read_answer(folder: Path) -> Answer:
    """The answer in a result folder: diagnosis.json, with oracle.json and fresh.json where they exist.

    No diagnosis.json: `failed`. fresh.json: {"gaps": [{"recording", "measure", "value", "low", "high"}]}, the gap
    measured on fresh recordings beside the interval stated for it. Raises DataError for what is not in the schema.
    """
    if not (folder / DIAGNOSIS_FILE).exists():
        return Answer(FAILED)
    body = _json(folder / DIAGNOSIS_FILE)
    try:
        status = str(body["verdict"]["status"])
        budget = body.get("budget") or {}
        entries = _entries(body["verdict"], budget)
        left = budget.get("unexplained") or {}
        unexplained = Stated(_finite(left.get("share")), _finite(left.get("low")), _finite(left.get("high")))
        closure, excess = _finite(budget.get("closed")), _finite(budget.get("gap"))
        proposal = _proposal(body.get("proposal"))
        law = _law(body.get("friction_law"))
    except (KeyError, TypeError, AttributeError, IndexError):
        raise _bad(folder / DIAGNOSIS_FILE, "does not follow the schema of a diagnosis") from None
    if status not in STATUSES:
        raise _bad(folder / DIAGNOSIS_FILE, f"has the status {status!r}")
    known = _json(folder / ORACLE_FILE) if (folder / ORACLE_FILE).exists() else {}
    each = [_finite(value) for value in known.get("each", {}).values()]
    gaps = _json(folder / FRESH_FILE).get("gaps", []) if (folder / FRESH_FILE).exists() else []
    return Answer(
        status,
        entries,
        unexplained,
        closure,
        _finite(known.get("closure")),
        None if not each or None in each else min(value for value in each if value is not None),
        _over_oracle(body.get("measures", {}).get("ahead"), _finite(known.get("ahead"))),
        sum(gap["low"] <= gap["value"] <= gap["high"] for gap in gaps),
        len(gaps),
        excess,
        proposal,
        law,
    )


def read_answers(folder: Path, names: Iterable[str]) -> dict[str, Answer]:
    """The answers of a challenge's results; raises DataError when there are none at all."""
    results = folder / RESULTS_FOLDER
    if not results.is_dir():
        raise DataError(str(results), "does not exist", "Run `linid challenge run` first.")
    return {name: read_answer(results / name) for name in names}


def _entries(verdict: Mapping[str, Any], budget: Mapping[str, Any]) -> tuple[BudgetEntry, ...]:
    """The budget's entries, largest share first; a verdict without a budget names without shares."""
    if "entries" not in budget:
        rivals = tuple(map(str, verdict.get("equivalent", ())))
        names = tuple(map(str, verdict.get("effects", ())))
        return tuple(BudgetEntry(name, rivals if len(names) == 1 else ()) for name in names)
    found = [
        BudgetEntry(
            str(entry["effect"]),
            tuple(map(str, entry.get("rivals", ()))),
            Stated(_finite(entry.get("share")), _finite(entry.get("low")), _finite(entry.get("high"))),
        )
        for entry in budget["entries"]
    ]
    return tuple(sorted(found, key=lambda entry: -(entry.stated.share or 0.0)))


def _over_oracle(measure: Mapping[str, Any] | None, left: float | None) -> float | None:
    """Error 0.1 s ahead over the true term's. measure: before, after and floor in m; left: share of what the base
    misses there, beyond the floor, that the true term leaves; None without one of them."""
    before, after, floor = (_finite((measure or {}).get(name)) for name in ("before", "after", "floor"))
    if left is None or before is None or after is None or floor is None:
        return None
    return after / math.hypot(floor, left * math.sqrt(max(before**2 - floor**2, 0.0)))


def _proposal(body: Mapping[str, Any] | None) -> Proposal | None:
    """The diagnosis' proposal; older diagnoses know none."""
    if not body:
        return None
    return Proposal(tuple(map(str, body["arguments"])), _finite(body.get("closed")), tuple(body.get("refines", ())))


def _law(body: Mapping[str, Any] | None) -> str | None:
    """The friction law that a diagnosis tells: another than LuGre's, or LuGre's where all others are refuted."""
    if not body or (body["law"] == "lugre" and not body["told"]):
        return None
    return _LAW.get(str(body["law"]), str(body["law"]))


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


def _finite(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None
