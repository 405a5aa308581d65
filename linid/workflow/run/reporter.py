"""Progress on stderr: a live line on a terminal, occasional plain lines elsewhere, nothing when quiet."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from linid.workflow.run.outcome import Outcome

_EVERY = 5.0  # s between plain lines


class Reporter:
    """Says what is going on. verbosity: -1 quiet (warnings only), 0 normal, 1 all notes; stream: default stderr.

    on_result: is given a command's outcome as soon as its files stand, before the figures are drawn.
    """

    def __init__(
        self, verbosity: int = 0, stream: TextIO | None = None, on_result: Callable[[Outcome], Outcome] | None = None
    ) -> None:
        self.verbosity = verbosity
        self.stream = stream or sys.stderr
        self.on_result = on_result
        self._stage = ""
        self._last = float("-inf")
        self._live: Progress | None = None
        self._task: TaskID | None = None
        self._terminal = verbosity >= 0 and self.stream.isatty()

    def __enter__(self) -> Reporter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def say(self, text: str) -> None:
        """A line that belongs to normal progress."""
        if self.verbosity >= 0:
            self._line(text)

    def detail(self, text: str) -> None:
        """A line for those who ask for more."""
        if self.verbosity > 0:
            self._line(text)

    def warn(self, text: str) -> None:
        """A line that is shown even when quiet."""
        self._line(f"warning: {text}")

    def step(self, stage: str, done: int, total: int, best: float | None = None) -> None:
        """`done` of `total` steps of a stage; best: relative error so far."""
        if self.verbosity < 0:
            return
        cost = "" if best is None else f"relative error {best:.3g}"
        if self._terminal:
            self._bar(stage, done, total, cost)
            return
        now = time.monotonic()
        if stage != self._stage or now - self._last >= _EVERY:
            self._stage, self._last = stage, now
            self._line(f"{stage}: {done}/{total} {cost}".rstrip())

    def show(self, outcome: Outcome) -> Outcome:
        """Hand over the outcome of a command that has only figures left to draw; returns it, marked where shown."""
        self.close()
        return outcome if self.on_result is None else self.on_result(outcome)

    def close(self) -> None:
        """End the live line."""
        if self._live is not None:
            self._live.stop()
            self._live = self._task = None

    def _bar(self, stage: str, done: int, total: int, cost: str) -> None:
        if self._live is None:
            self._live = _progress(self.stream)
            self._live.start()
        if stage != self._stage or self._task is None:
            if self._task is not None:
                self._live.remove_task(self._task)
            self._stage, self._task = stage, self._live.add_task(stage, total=total, cost=cost)
        self._live.update(self._task, completed=done, total=total, cost=cost)

    def _line(self, text: str) -> None:
        if self._live is not None:
            self._live.console.print(text, markup=False, highlight=False)
        else:
            print(text, file=self.stream, flush=True)


def _progress(stream: TextIO) -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TextColumn("{task.fields[cost]}"),
        TimeElapsedColumn(),
        console=Console(file=stream),
        transient=True,
    )
