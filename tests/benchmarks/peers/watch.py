"""What looks on while a peer fits: the clock, the count of evaluations and every improvement."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.peers.problems import Problem, rms

Array = NDArray[np.float64]


class Done(Exception):  # noqa: N818
    """The target is reached or the time is over."""


def peak_memory() -> float:
    """Largest memory of this process so far in MB; unlike the kernel's count for children, without the parent's."""
    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return float(line.split()[1]) / 1024.0
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


class Watch:
    """Counts evaluations and keeps every improvement: (s, evaluations, cost, x); ends the fit by raising Done.

    limit: s of processor time, which other work on the machine does not lengthen; tell: called with every improvement
    and now and then with the count alone, so that nothing is lost if the process is ended from outside.
    """

    def __init__(self, limit: float, target: float, tell: Callable[[dict[str, Any]], None] = lambda line: None) -> None:
        self.limit, self.target, self.tell = limit, target, tell
        self.begin = self.told = time.process_time()
        self.evaluations = 0
        self.best = math.inf

    def look(self, x: Array, cost: float) -> None:
        """Note one evaluation."""
        self.many(np.atleast_2d(x), np.array([cost]))

    def many(self, xs: Array, costs: Array) -> None:
        """Note evaluations made at once: xs (C, p), costs (C,)."""
        now = time.process_time()
        self.evaluations += len(costs)
        seconds = now - self.begin
        first = int(np.argmin(costs))
        line: dict[str, Any] = {"s": seconds, "evaluations": self.evaluations, "mb": peak_memory()}
        if costs[first] < self.best:
            self.best = float(costs[first])
            self.tell({**line, "cost": self.best, "x": [float(g) for g in xs[first]]})
        elif now - self.told > 1.0:
            self.told = now
            self.tell(line)
        if self.best <= self.target or seconds > self.limit:
            raise Done


def noted_errors(problem: Problem, simulation: Any, watch: Watch) -> Callable[[Any], Array]:
    """Position errors (N,) in m at a point of the unit cube (p,), each evaluation noted."""

    def errors(x: Any) -> Array:
        x = np.asarray(x, dtype=float)
        found = problem.errors(simulation, x)
        watch.look(x, rms(found))
        return found

    return errors
