"""A fixed suite of campaigns that others can enter: its groups, its campaigns, and their keys.

Names are dealt out over all groups at once, so that no name tells a group; which is which stands in the keys.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from linid.challenge.create import in_threads
from linid.challenge.files import Key, key_of, read_keys_file, write_hidden_campaign, write_keys
from linid.challenge.hidden_axis import LAWS
from linid.challenge.make import ALL, Plan, make_campaign
from linid.errors import ConfigError, UsageError

SUITE_VERSION = "4"  # of the way in which campaigns are drawn: with another one a seed gives other campaigns
DEFAULT_SEED, DEFAULT_SIZE = 2026, 60
_ORDER = 9  # marks the random numbers that deal out names


@dataclass(frozen=True)
class Group:
    """Campaigns of one sort. weight: how many of sixty; text: what they hold; plan: fields of their `Plan`."""

    weight: int
    text: str
    plan: dict[str, Any] = field(default_factory=dict)


GROUPS: dict[str, Group] = {
    "single": Group(12, "one effect of the list", {"kinds": ("single",)}),
    "pairs": Group(8, "two effects of the list", {"kinds": ("pair",)}),
    "crowds": Group(8, "four effects of the list", {"kinds": ("crowd",), "crowd": (4, 4)}),
    "outside": Group(12, "one cause that is not on the list", {"kinds": ("unknown",)}),
    "laws": Group(
        8,
        "one effect of the list, on an axis with Maxwell-slip, Dahl, elasto-plastic or Coulomb friction",
        {"kinds": ("single",), "laws": tuple(law for law in LAWS if law != "lugre")},
    ),
    "coarse": Group(
        6, "one effect of the list, seen by an encoder of 2 to 10 um", {"kinds": ("single",), "encoders": (2e-6, 1e-5)}
    ),
    "none": Group(6, "nothing", {"kinds": ("none",)}),
}
STRENGTH = (0.1, 1.0)


@dataclass(frozen=True)
class SuiteKeys:
    """The keys of a suite. suite: its version; groups: campaign -> group; keys: campaign -> key."""

    suite: str
    groups: dict[str, str]
    keys: dict[str, Key]


def group_sizes(size: int, names: Sequence[str] = tuple(GROUPS)) -> dict[str, int]:
    """How many campaigns each of the named groups has of `size`: by weight, at least one.

    Raises UsageError for groups that are none, and for fewer campaigns than groups.
    """
    odd = [name for name in names if name not in GROUPS]
    if odd or not names:
        raise UsageError("--groups", f"{', '.join(odd) or 'nothing'} is no group", f"Known: {', '.join(GROUPS)}.")
    chosen = [name for name in GROUPS if name in names]
    if size < len(chosen):
        raise UsageError("--size", f"{size} campaigns for {len(chosen)} groups", f"Ask for at least {len(chosen)}.")
    total = sum(GROUPS[name].weight for name in chosen)
    wanted = {name: size * GROUPS[name].weight / total for name in chosen}
    sizes = {name: max(1, int(wanted[name])) for name in chosen}
    while sum(sizes.values()) != size:  # the rest goes where most is lacking, and is taken where most is too much
        step = 1 if sum(sizes.values()) < size else -1
        movable = [name for name in chosen if sizes[name] + step >= 1]
        sizes[max(movable, key=lambda name: step * (wanted[name] - sizes[name]))] += step
    return sizes


def group_plan(group: str, seed: int) -> Plan:
    """The plan that a group's campaigns are drawn from; no two groups share an axis."""
    own = np.random.SeedSequence([seed, list(GROUPS).index(group)]).generate_state(1)[0]
    return Plan(int(own), effects=(ALL,), strength=STRENGTH, **GROUPS[group].plan)


def campaign_plan(group: str, seed: int, number: int) -> Plan:
    """The plan of one campaign of a group, from 0: its friction laws come by turns, not by chance."""
    plan = group_plan(group, seed)
    return replace(plan, laws=(plan.laws[number % len(plan.laws)],))


def dealt_names(sizes: Mapping[str, int], seed: int) -> dict[str, tuple[str, int]]:
    """Campaign name -> (group, number within it), in the order of names."""
    places = [(group, number) for group, count in sizes.items() for number in range(count)]
    order = np.random.default_rng([seed, _ORDER]).permutation(len(places))
    return {f"axis_{place + 1:04d}": places[k] for place, k in enumerate(order)}


def make_campaigns(
    sizes: Mapping[str, int],
    seed: int,
    folder: Path,
    *,
    jobs: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[dict[str, str], dict[str, Key]]:
    """Write a suite's campaigns below `folder`; returns campaign -> group and campaign -> key.

    sizes: campaigns of each group; jobs: threads, which change no byte; progress: called with (done, total).
    """
    dealt = dealt_names(sizes, seed)

    def one(name: str) -> tuple[str, Key]:
        group, number = dealt[name]
        campaign = replace(make_campaign(campaign_plan(group, seed, number), number), name=name)
        write_hidden_campaign(campaign, folder, fresh=False)
        return name, key_of(campaign)

    made = dict(in_threads(one, tuple(dealt), jobs, progress))
    return {name: group for name, (group, _) in dealt.items()}, {name: made[name] for name in dealt}


def write_suite_keys(sealed: SuiteKeys, path: Path, *, seed: int) -> None:
    """Seal a suite's keys in one file."""
    write_keys(sealed.keys, path, seed=seed, more={"suite": sealed.suite, "groups": dict(sealed.groups)})


def read_suite_keys(path: Path) -> SuiteKeys:
    """The keys of a suite. Raises DataError when unreadable, ConfigError when they are not a suite's."""
    keys, more = read_keys_file(path)
    groups = more.get("groups")
    if not isinstance(groups, dict) or not isinstance(more.get("suite"), str) or set(groups) != set(keys):
        raise ConfigError(
            str(path), "holds keys, but not those of a suite", "Name the file that `challenge export` wrote."
        )
    return SuiteKeys(more["suite"], {name: str(groups[name]) for name in keys}, keys)
