"""What the selection alone names on a challenge's campaigns: `python -m tests.benchmarks.selection FOLDER`.

Base, selection and shares without models, measures and report, which take most of a diagnosis' time: for work on the
selection. Printed beside the keys per campaign, and the rates at the end: effects with 5 % of the gap and more that are
named, names that are not there, true shares inside the stated intervals, remainders right within 5 %.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Iterator, Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import Any

MATTERS, CLOSE = 0.05, 0.05  # of the gap


def found(path: Path) -> dict[str, Any]:
    """What the selection says of one campaign: entries, dropped effects, gap and CPU seconds."""
    from linid.api import read
    from linid.diagnosis.base import fit_base_model, numbered
    from linid.diagnosis.means import Means
    from linid.diagnosis.screen import Screening
    from linid.diagnosis.select import select
    from linid.diagnosis.shares import shares_of
    from linid.interface.stages import base_kind

    def quiet(stage: str, done: int, total: int) -> None:
        del stage, done, total

    start = time.process_time()
    recordings = numbered(read(path / "campaign.yaml").recordings)
    base = fit_base_model(recordings, base_kind(recordings), {}, Means(), [])
    chosen = select(base, Screening(base.judge.fits, base.fitted, 1), quiet)
    shares = shares_of(base.judge, chosen.base, chosen.best, 1)
    entries = {}
    for part in chosen.parts:
        portion = shares.portions[part.name]
        rivals = [name for name, _ in chosen.rivals.get(part.name, ())]
        evidence = tuple(vars(part.evidence).values())
        entries[part.name] = {"share": (portion.share, portion.low, portion.high), "rivals": rivals, "test": evidence}
    return {
        "name": path.name,
        "before": shares.before,
        "after": shares.after,
        "entries": entries,
        "unexplained": shares.unexplained[0] if entries else 1.0,
        "seconds": time.process_time() - start,
        "dropped": {part.name: tuple(vars(part.evidence).values()) for part in chosen.dropped},
    }


def against(one: dict[str, Any], key: dict[str, Any]) -> dict[str, list[bool]]:
    """Hits and misses of one campaign by kind of rate."""
    entries, shares = one["entries"], key.get("shares") or {}
    names = {name: {name, *entry["rivals"]} for name, entry in entries.items()}
    there = set(key["effects"])
    inside = [
        entry["share"][1] <= shares[name] <= entry["share"][2] for name, entry in entries.items() if name in shares
    ]
    return {
        "recall": [any(name in own for own in names.values()) for name, x in shares.items() if x >= MATTERS],
        "absent": [not own & there for own in names.values()],
        "covered": inside,
        "remainder": [abs(one["unexplained"] - key.get("unexplained", 0.0)) < CLOSE] if there else [not entries],
    }


def lines(one: dict[str, Any], key: dict[str, Any]) -> Iterator[str]:
    """One campaign in words."""
    yield (
        f"{one['name']} {key['motor']} {key.get('law', '')}: {one['before']:.1f} -> {one['after']:.2f} floors, "
        f"{one['unexplained']:.2f} unexplained, {one['seconds']:.0f} CPU s"
    )
    for name in dict.fromkeys((*key["effects"], *one["entries"], *one["dropped"])):
        share = (key.get("shares") or {}).get(name)
        entry, dropped = one["entries"].get(name), one["dropped"].get(name)
        said = "not named"
        if entry:
            said = " or ".join(["{:.3f} [{:.3f}, {:.3f}]".format(*entry["share"]), *entry["rivals"]])
        elif dropped:
            said = f"dropped (certainty {dropped[1]:.1f}, closed {dropped[2]:.2f})"
        yield f"    {name:28} true {'absent' if share is None else f'{share:.3f}':8} {said}"


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    import yaml

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("folder", type=Path)
    parser.add_argument("campaigns", nargs="*")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, help="one JSON object per campaign and line")
    options = parser.parse_args(arguments)
    keys = yaml.safe_load((options.folder / "keys.yaml").read_text(encoding="utf-8"))["campaigns"]
    names = options.campaigns or sorted(keys)
    rates: dict[str, list[bool]] = {"recall": [], "absent": [], "covered": [], "remainder": []}
    with get_context("spawn").Pool(options.jobs) as pool:
        for one in pool.imap_unordered(found, [options.folder / name for name in names]):
            print("\n".join(lines(one, keys[one["name"]])), flush=True)
            for kind, hits in against(one, keys[one["name"]]).items():
                rates[kind] += hits
            if options.out:
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(one) + "\n")
    print(", ".join(f"{kind} {sum(hits)} of {len(hits)}" for kind, hits in rates.items()))


if __name__ == "__main__":
    main()
