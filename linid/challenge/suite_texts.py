"""What a suite tells entrants: its README and the notice of its licence."""

from __future__ import annotations

from collections.abc import Mapping

from linid.challenge.catalogue import ARGUMENTS, LISTED
from linid.challenge.suite import GROUPS
from linid.physics.effects.registry import BUILT_IN

LICENSE = """The recordings, texts and lists of this suite are generated data, made by linid (`linid challenge export`).

They are licensed under the Creative Commons Attribution 4.0 International License (CC BY 4.0). You may share and adapt
them for any purpose if you give credit to the linid project, link to the licence, and say what you changed. They come
without any warranty.

Licence text: https://creativecommons.org/licenses/by/4.0/legalcode
SPDX-License-Identifier: CC-BY-4.0
"""

_README = """# Challenge suite {suite}

{total} simulated axes of linear motors. In most of them something acts that textbook friction and an ideal motor do not
have: find out what, how much of the gap it makes, and where nothing is hidden. No program of ours is needed.

## What you get

Each folder `axis_NNNN` is one axis with 19 recordings. Its `campaign.yaml` lists them:

| field | meaning |
|---|---|
| `file` | a CSV file with one header line: time in ms, position in mm, three phase currents in A (the drive's frame) |
| `kind` | `free_wheel`: the axis coasts, its motor without current; `motor`: driven |
| `split` | `fit`: to fit models to; `held_out`: to judge them by |
| `added_mass_kg` | known mass that was put on the axis for this recording |

Nothing else is known: mass, friction, motor, pole pitch and commutation are to be found from the recordings. The axis
is one mass on a guideway with LuGre friction (bristles, Stribeck, viscous; in some campaigns Maxwell-slip or Dahl
friction instead), and a three-phase motor whose back-EMF is a sine or a Jacobi theta function of the position.
`suite.json` has the SHA-256 of every file.

Campaigns belong to these groups; which is in which is not told:

{groups}

## What you hand in

One JSON file; `submission.schema.json` is its schema.

```json
{{
 "suite": "{suite}",
 "entrant": "your name",
 "answers": {{
  "axis_0001": {{"effects": ["cogging", "cable_force"],
                "shares": {{"cogging": {{"share": 0.7, "low": 0.6, "high": 0.8}}}}}},
  "axis_0002": {{"effects": [], "unknown": true, "arguments": ["time"]}},
  "axis_0003": {{"effects": []}}
 }}
}}
```

- `effects`: names from the list below, the largest first; empty: none of them acts.
- `unknown`: true where a cause acts that is not on the list.
- `shares` (optional): how much of the gap each named effect makes, with a 95 % interval. The gap is the mean square of
  the acceleration that the axis without hidden effects misses on the held-out recordings; 1 is all of it.
- `arguments` (optional, with `unknown`): what the unlisted cause depends on: {arguments}.
- `law` (optional): friction law of the axis: lugre, maxwell, dahl, elasto_plastic or coulomb.

A campaign that is left out counts as not answered, which is worse than an empty answer where nothing is hidden.

## How it is scored

Effects with at least 5 % of the gap are to be named. A campaign gives named / (to be named + wrong) points, where wrong
are names that are not there; so a guess that fails costs. Where nothing is hidden, silence gives 1 point. An unlisted
cause gives 1 point if it is told and nothing else is named. Beside the points stand the rates of each group with 95 %
intervals, and how often the stated intervals of shares hold the true ones.

Whoever has the keys scores with `linid challenge score SUBMISSION.json --keys KEYS.yaml`. {seed}
`suite.json` holds the SHA-256 of the keys, so that nobody can change them afterwards.

## The list of effects

| name | what acts |
|---|---|
{effects}

## Licence

CC BY 4.0, see `LICENSE`.
"""


def readme(suite: str, sizes: Mapping[str, int], seed: int | None) -> str:
    """The README of a suite with so many campaigns of each group; seed: None where it is not told."""
    told = (
        "The seed is not told." if seed is None else f"The seed is {seed}: it makes the keys again, so do not use it."
    )
    physics = {effect.name: effect.physics.replace("|", "\\|") for effect in BUILT_IN}
    groups = ["| group | campaigns | hidden in each |", "|---|---|---|"]
    groups += [f"| {name} | {count} | {GROUPS[name].text} |" for name, count in sizes.items()]
    return _README.format(
        suite=suite,
        total=sum(sizes.values()),
        groups="\n".join(groups),
        arguments=", ".join(f"`{name}`" for name in ARGUMENTS),
        seed=told,
        effects="\n".join(f"| `{name}` | {physics[name]} |" for name in LISTED),
    )
