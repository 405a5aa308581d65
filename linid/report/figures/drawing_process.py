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
    """An order on its way: `files` waits until it is done, or does it here where no process has begun or it is lost."""

    def __init__(self, order: Order) -> None:
        self._order = order
        self._helper = _waiting.pop() if _waiting and order.how_many != "none" else None
        if self._helper is not None and not _asked(self._helper, order):
            self._helper = None

    def files(self, progress: Progress | None = None) -> list[Path]:
        """The written files. Raises what drawing raises; Ctrl-C ends the process that draws."""
        if self._helper is None:
            return self._order.write(progress)
        try:
            kind, found = _answer(self._helper, progress)
        except (EOFError, OSError, pickle.UnpicklingError):
            kind, found = "lost", None
        finally:
            _end(self._helper)
        if kind == "error":
            raise found
        return list(found) if kind == "files" else self._order.write(progress)


def begin() -> None:
    """Begin a process that will draw: what it loads takes half a second, on another core."""
    if _waiting or not sys.executable:
        return
    try:
        _waiting.append(subprocess.Popen(own_python(_SERVE), stdin=subprocess.PIPE, stdout=subprocess.PIPE))
    except OSError:  # no process to be had
        return


def serve() -> None:
    """Load what figures need, wait for an `Order` on standard input, write it, and answer on standard output.

    Answers are pickled pairs: ("progress", (done, total, stem)), at the end ("files", paths) or ("error", what was
    raised). Without an order, as where who would ask has ended, nothing is done.
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

    try:
        order: Order = pickle.load(sys.stdin.buffer)
    except Exception:  # no order, or one of functions that are not known here: who asks draws them
        return
    try:
        answer("files", order.write(lambda *done: answer("progress", done)))
    except BrokenPipeError:  # who asked has ended
        os._exit(0)  # without a word about what is left for the channel
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
        with helper.stdin as channel:
            channel.write(pickle.dumps(order, pickle.HIGHEST_PROTOCOL))
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
