"""SIGTERM treated like Ctrl-C: what runs saves its state and ends with the code that shells expect, 128 + signal."""

from __future__ import annotations

import signal
from types import FrameType

INTERRUPTED = 128 + signal.SIGINT  # 130
TERMINATED = 128 + signal.SIGTERM  # 143


class Terminated(KeyboardInterrupt):
    """SIGTERM came, from `kill`, a service manager or a batch queue."""


def exit_code_of(stop: KeyboardInterrupt) -> int:
    """130 for Ctrl-C, 143 for SIGTERM."""
    return getattr(stop, "exit_code", TERMINATED if isinstance(stop, Terminated) else INTERRUPTED)


def raise_on_sigterm() -> None:
    """From now on the first SIGTERM raises Terminated in the main thread; later ones do not disturb the saving."""

    def stop(number: int, frame: FrameType | None) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        raise Terminated

    signal.signal(signal.SIGTERM, stop)
