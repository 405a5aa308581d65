"""Making a whole challenge: campaigns on several threads, keys sealed in a file of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import TypeVar

from linid.challenge.changed import make_changed
from linid.challenge.files import KEYS_FILE, Key, key_of, write_hidden_campaign, write_keys
from linid.challenge.make import Plan, assignment, make_campaign
from linid.challenge.term import plan_body
from linid.errors import UsageError

Task = TypeVar("Task")
Made = TypeVar("Made")


def make_challenge(
    plan: Plan,
    count: int,
    folder: Path,
    *,
    keys_path: Path | None = None,
    jobs: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Key]:
    """Write `count` campaigns below `folder` and their keys to keys_path (default: folder/keys.yaml).

    A campaign depends on the plan and its number only, never on count or jobs (threads). Returns the keys.
    Raises UsageError when the folder is not empty or the keys file exists.
    """
    keys_path = keys_path or folder / KEYS_FILE
    if folder.is_file() or (folder.exists() and any(folder.iterdir())):
        raise UsageError(str(folder), "is not an empty folder", "Choose another one by --out.")
    if keys_path.exists():
        raise UsageError(str(keys_path), "exists", "Name another file by --keys.")

    def one(index: int) -> tuple[str, Key]:
        make = make_changed if assignment(plan, index)[0] == "changed" else make_campaign
        campaign = make(plan, index)
        write_hidden_campaign(campaign, folder)
        return campaign.name, key_of(campaign)

    keys = dict(in_threads(one, range(count), jobs, progress))
    ordered = dict(sorted(keys.items()))
    write_keys(ordered, keys_path, seed=plan.seed, more={"plan": plan_body(plan)})
    return ordered


def in_threads(
    work: Callable[[Task], Made], tasks: Sequence[Task], jobs: int, progress: Callable[[int, int], None] | None = None
) -> Iterator[Made]:
    """work(task) of all tasks as they come, on `jobs` threads; progress: called with (done, total)."""
    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(work, task) for task in tasks]
        try:
            for done, future in enumerate(as_completed(futures), 1):
                yield future.result()
                if progress is not None:
                    progress(done, len(tasks))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
