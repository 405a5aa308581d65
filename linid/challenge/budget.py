"""Scoring a diagnosis as a budget: what share of the gap it finds, names wrongly, and leaves, against the true shares.

Each entry of a budget accounts for one hidden effect at most: first those that name it, then those that list it among
their rivals (names that the recordings cannot tell apart). What is left over names something that is not there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from linid.challenge.answers import Answer, BudgetEntry
from linid.challenge.files import Key
from linid.challenge.outside import OUTSIDE
from linid.challenge.rates import Rate, rate

MATTERS_SHARE = 0.05  # of the gap: an effect with less of it need not be found
VISIBLE_FLOORS = 0.05  # share of the gap times the gap: what no method could tell from noise is less
CLOSE = 0.05  # of the gap, between stated and true unexplained remainder
SHARES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # edges of the table of recall


@dataclass(frozen=True)
class Item:
    """One hidden effect against a budget. share: true; visible: whether it moves the gap by as much as noise could;
    entry: the one that accounts for it; rival: only as one of its rivals."""

    effect: str
    share: float
    visible: bool
    entry: BudgetEntry | None
    rival: bool

    @property
    def matters(self) -> bool:
        """Whether it has a share of the gap that a diagnosis is asked to find."""
        return self.share >= MATTERS_SHARE


@dataclass(frozen=True)
class Ledger:
    """One campaign's budget against its key. absent: names that are not there; unexplained: stated less true share,
    covered: whether the stated interval holds the true one (None where nothing is stated)."""

    items: tuple[Item, ...]
    absent: tuple[str, ...]
    unexplained: float | None
    covered: bool | None


@dataclass(frozen=True)
class ShareBin:
    """Effects whose true share of the gap lies in [low, high): how many are found."""

    low: float
    high: float
    found: Rate


@dataclass(frozen=True)
class BudgetScore:
    """Rates over a group of campaigns (see `RATES`), and recall against share."""

    campaigns: int
    rates: dict[str, Rate]
    bins: tuple[ShareBin, ...]


def true_shares_of(key: Key) -> dict[str, float]:
    """True shares by effect; a single effect without recorded shares has all of the gap."""
    if key.shares:
        return dict(key.shares)
    return {key.effects[0]: 1.0} if key.kind == "single" else {}


def ledger(key: Key, answer: Answer) -> Ledger:
    """Set a campaign's budget against its key."""
    shares = true_shares_of(key)
    matched: dict[str, BudgetEntry] = {entry.effect: entry for entry in answer.entries if entry.effect in key.effects}
    named = set(matched)
    taken = [id(entry) for entry in matched.values()]
    for entry in answer.entries:
        if id(entry) in taken:
            continue
        free = [name for name in entry.rivals if name in key.effects and name not in matched]
        if free:
            matched[max(free, key=lambda name: shares.get(name, 0.0))] = entry
            taken.append(id(entry))
    items = tuple(
        Item(
            name,
            shares[name],
            key.gap is None or shares[name] * key.gap >= VISIBLE_FLOORS,
            matched.get(name),
            name in matched and name not in named,
        )
        for name in key.effects
        if name in shares and name not in OUTSIDE
    )
    absent = tuple(entry.effect for entry in answer.entries if id(entry) not in taken)
    stated, truth = answer.unexplained, key.unexplained
    # Of another friction law than the library's the key holds an upper bound only.
    knows = bool(key.shares) and key.law == "lugre" and stated.share is not None
    return Ledger(
        items,
        absent,
        stated.share - truth if knows and stated.share is not None else None,
        stated.covers(truth) if knows else None,
    )


def score_budgets(pairs: Sequence[tuple[Key, Answer]]) -> BudgetScore:
    """Rates of a group of campaigns."""
    ledgers = [(key, answer, ledger(key, answer)) for key, answer in pairs]
    items = [item for _, _, one in ledgers for item in one.items]
    large = [item for item in items if item.matters]
    hiding = [(one, key) for key, _, one in ledgers if one.items]
    covered = [item.entry.stated.covers(item.share) for item in items if item.entry is not None]
    names = [(entry, one) for _, answer, one in ledgers for entry in answer.entries]
    remainders = [one.unexplained for _, _, one in ledgers if one.unexplained is not None]
    rates = {
        "found": rate(_marks(item.entry is not None for item in large)),
        "found_visible": rate(_marks(item.entry is not None for item in large if item.visible)),
        "found_as_rival": rate(_marks(item.rival for item in large if item.entry is not None)),
        "absent": rate(_marks(entry.effect in one.absent for entry, one in names)),
        "share_covered": rate(_marks(yes for yes in covered if yes is not None)),
        "unexplained_close": rate(_marks(abs(value) <= CLOSE for value in remainders)),
        "unexplained_covered": rate(_marks(one.covered for _, _, one in ledgers if one.covered is not None)),
        "complete": rate(
            _marks(not one.absent and all(x.entry is not None for x in one.items if x.matters) for one, _ in hiding)
        ),
        "none_right": rate(_marks(answer.status == "none" for key, answer, _ in ledgers if key.kind == "none")),
    }
    return BudgetScore(len(pairs), rates, tuple(_bins(items)))


def groups(keys: Mapping[str, Key], answers: Mapping[str, Answer]) -> dict[str, BudgetScore]:
    """Budget scores of all campaigns, of each kind, and of axes, friction laws and rates other than the usual."""
    members: dict[str, list[tuple[Key, Answer]]] = {"all": []}
    for name, key in keys.items():
        unusual = [key.axis] * (key.axis != "phase") + [key.law] * (key.law != "lugre")
        unusual += [f"{key.rate:g} Hz"] * (key.rate != 1000.0) + ["encoder > 1 um"] * (key.encoder > 1e-6)
        for group in ("all", key.kind, *unusual):
            members.setdefault(group, []).append((key, answers[name]))
    return {group: score_budgets(pairs) for group, pairs in members.items()}


def _bins(items: Sequence[Item]) -> Iterable[ShareBin]:
    """Recall by share; what lies outside the edges joins the outermost bin."""
    for i in range(len(SHARES) - 1):
        low = -math.inf if i == 0 else SHARES[i]
        high = math.inf if i == len(SHARES) - 2 else SHARES[i + 1]
        inside = [item for item in items if low <= item.share < high]
        yield ShareBin(SHARES[i], SHARES[i + 1], rate(_marks(item.entry is not None for item in inside)))


def _marks(values: Iterable[bool | None]) -> list[float]:
    return [float(bool(value)) for value in values]
