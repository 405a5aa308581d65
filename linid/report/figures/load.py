"""The drawing library, loaded while something is being computed: that takes a third of a second."""

from __future__ import annotations

from threading import Thread

_loading: list[Thread] = []


def load_early() -> None:
    """Begin to load it in a thread of its own."""
    if not _loading:
        _loading.append(Thread(target=_load, daemon=True))
        _loading[0].start()


def wait_until_loaded() -> None:
    """Return when nothing is being loaded: a process that is forked meanwhile would wait for it for ever."""
    for thread in _loading:
        thread.join()


def _load() -> None:
    import matplotlib.backends.backend_agg
    import matplotlib.figure  # noqa: F401
