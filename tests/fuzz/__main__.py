"""`python -m tests.fuzz --count 10000 --seed 7`: feed random files to the borders of the program.

Every input is told by kind and seed (`--show KIND:SEED` writes it to stdout). A failure is made smaller and kept in
`tests/fuzz/corpus`, which the tests replay.
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing as mp
import sys
import tempfile
import time
from collections import Counter
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path

from tests.fuzz.inputs import MAKERS, Input, made
from tests.fuzz.judge import verdict

CORPUS = Path(__file__).parent / "corpus"
_PATIENCE = 60.0  # s without an answer: a hang that nothing interrupts, on a busy machine
_SHRINKS = 200


def _worker(line: Connection) -> None:
    with tempfile.TemporaryDirectory() as folder:
        while (one := line.recv()) is not None:
            line.send(verdict(one, Path(folder)))


class Worker:
    """A process that judges inputs, replaced when it hangs or dies."""

    def __init__(self) -> None:
        self._start()

    def _start(self) -> None:
        context = mp.get_context("fork")
        self.line, other = context.Pipe()
        self.process = context.Process(target=_worker, args=(other,), daemon=True)
        self.process.start()
        other.close()

    def judge(self, one: Input) -> str:
        """The verdict on one input."""
        try:
            self.line.send(one)
            if self.line.poll(_PATIENCE):
                return str(self.line.recv())
            fact = "hangs"
        except (EOFError, OSError):
            fact = "kills the process"
        self.process.kill()
        self.process.join()
        self._start()
        return fact


def smaller(one: Input, fact: str, worker: Worker) -> Input:
    """The input with everything left out without which it still fails alike."""
    alike = fact.split(":")[0].split(" ")[0]
    tries, size = 0, max(len(one.content) // 2, 1)
    while size >= 1 and tries < _SHRINKS and "hangs" not in fact:
        at, shrunk = 0, False
        while at < len(one.content) and tries < _SHRINKS:
            less = replace(one, content=one.content[:at] + one.content[at + size :])
            tries += 1
            if worker.judge(less).startswith(alike):
                one, shrunk = less, True
            else:
                at += size
        if not shrunk:
            size //= 2
    return one


def main() -> int:
    """The command; exit code 1 where something failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1e9)
    parser.add_argument("--count", type=int, default=0, help="inputs, all kinds together (0: until time is up)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", default=",".join(MAKERS))
    parser.add_argument("--show", help="KIND:SEED of one input, written to stdout")
    parser.add_argument("--keep", type=Path, default=CORPUS, help="where failures go")
    options = parser.parse_args()
    if options.show:
        kind, seed = options.show.split(":")
        sys.stdout.buffer.write(made(kind, int(seed)).content)
        return 0
    kinds = options.kinds.split(",")
    weights = [6 if kind == "readers" else 1 for kind in kinds]
    order = [kind for kind, weight in zip(kinds, weights, strict=True) for _ in range(weight)]
    worker, end, failures = Worker(), time.monotonic() + 60.0 * options.minutes, Counter[str]()
    number = 0
    while time.monotonic() < end and (not options.count or number < options.count):
        kind, seed = order[number % len(order)], options.seed * 1_000_003 + number
        one = made(kind, seed)
        fact = worker.judge(one)
        number += 1
        if fact:
            label = f"{kind}: {fact.split('(')[0][:70]}"
            failures[label] += 1
            print(f"{kind}:{seed} {fact}", flush=True)
            if failures[label] == 1:
                least = smaller(one, fact, worker)
                digest = hashlib.sha256(least.content).hexdigest()[:10]
                options.keep.mkdir(parents=True, exist_ok=True)
                (options.keep / f"{kind}_{digest}{least.suffix}").write_bytes(least.content)
    print(f"{number} inputs, {sum(failures.values())} failures of {len(failures)} sorts")
    return 1 if failures else 0


if __name__ == "__main__":
    raise SystemExit(main())
