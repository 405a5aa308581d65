"""Figures drawn by a process of their own, which loads the drawing library while something is being computed."""

from __future__ import annotations

import atexit
import gc
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from linid.report.figures.write import Drawing, Progress

from linid.own_process import own_python

_SERVE = "from linid.report.figures.drawing_process import serve; serve()"
_waiting: list[subprocess.Popen[bytes]] = []  # one at most, that has begun and was not asked yet


class Order(NamedTuple):
    """Figures to be written. make() -> drawings, pickled on its way to another process; how_many: `few`, `all` or
    `none`; folder, formats, processes: as in `write_drawings`."""

    make: Callable[[], list[Drawing]]
    how_many: str
    folder: Path
    formats: Sequence[str]
    processes: int

    def write(self, progress: Progress | None = None) -> list[Path]:
        """Write them here; returns the files."""
        from linid.report.figures.write import wanted, write_drawings

        if self.how_many == "none":
            return []
        drawings = wanted(self.make(), self.how_many)
        return write_drawings(drawings, self.folder, formats=self.formats, progress=progress, processes=self.processes)


class Ordered:
    """Orders on their way: `files` waits until they are done, or does them here where no process has begun or it is
    lost."""

    def __init__(self, order: Order) -> None:
        self._orders: list[Order] = []
        self._helper = _waiting.pop() if _waiting and order.how_many != "none" else None
        self.then(order)

    def then(self, order: Order) -> None:
        """Order more, to be drawn next."""
        self._orders.append(order)
        if self._helper is not None and not _asked(self._helper, order):
            self._helper = None

    def files(self, progress: Progress | None = None) -> list[Path]:
        """The written files. Raises what drawing raises; Ctrl-C ends the process that draws."""
        if self._helper is None:
            return self._drawn_here(progress)
        answers: list[tuple[str, Any]] = []
        try:
            while len(answers) < len(self._orders) and "error" not in dict(answers):
                answers.append(_answer(self._helper, progress))
        except (EOFError, OSError, pickle.UnpicklingError):
            return self._drawn_here(progress)
        finally:
            _end(self._helper)
        for kind, found in answers:
            if kind == "error":
                raise found
        return [path for _, found in answers for path in found]

    def _drawn_here(self, progress: Progress | None) -> list[Path]:
        return [path for order in self._orders for path in order.write(progress)]


def begin() -> None:
    """Begin a process that will draw: what it loads takes half a second, on another core."""
    if _waiting or not sys.executable:
        return
    try:
        _waiting.append(subprocess.Popen(own_python(_SERVE), stdin=subprocess.PIPE, stdout=subprocess.PIPE))
    except OSError:  # no process to be had
        return


def serve() -> None:
    """Load what figures need, wait for `Order`s on standard input, write them, and answer on standard output.

    Answers are pickled pairs: ("progress", (done, total, stem)), after each order ("files", paths) or ("error", what
    was raised). It ends with who asks.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches who asks, and that ends this process
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing that a library prints gets among the answers
    gc.disable()  # what is loaded stays: to look through it is a tenth of the time
    _load()
    gc.enable()

    def answer(kind: str, found: Any) -> None:
        pickle.dump((kind, found), answers)
        answers.flush()

    while True:
        try:
            order: Order = pickle.load(sys.stdin.buffer)
        except Exception:  # no more, or one of functions that are not known here: who asks draws them
            return
        try:
            answer("files", order.write(lambda *done: answer("progress", done)))
        except Exception as error:
            answer("error", error)


def _load() -> None:
    from linid.report.figures.diagnosis_write import diagnosis_drawings  # noqa: F401
    from linid.report.style import new_figure, style

    with style():  # the first drawing takes longest: it looks for fonts
        new_figure(10.0, "$x$").canvas.draw()


def _asked(helper: subprocess.Popen[bytes], order: Order) -> bool:
    """Send an order; whether it has gone."""
    assert helper.stdin is not None
    try:
        helper.stdin.write(pickle.dumps(order, pickle.HIGHEST_PROTOCOL))
        helper.stdin.flush()
    except (OSError, pickle.PicklingError, AttributeError, TypeError):  # lost, or nothing that travels
        _end(helper)
        return False
    return True


def _answer(helper: subprocess.Popen[bytes], progress: Progress | None) -> tuple[str, Any]:
    """The last answer of a process that draws."""
    assert helper.stdout is not None
    while True:
        kind, found = pickle.load(helper.stdout)
        if kind != "progress":
            return kind, found
        if progress is not None:
            progress(*found)


@atexit.register
def _dismiss() -> None:
    """End a process that was never asked."""
    while _waiting:
        _end(_waiting.pop())


def _end(helper: subprocess.Popen[bytes]) -> None:
    helper.kill()
    for channel in (helper.stdin, helper.stdout):
        if channel is not None:
            channel.close()
    helper.wait()
