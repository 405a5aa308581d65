"""Processes that this one starts beside itself."""

from __future__ import annotations

import sys


def own_python(code: str) -> list[str]:
    """The command of a Python process that runs `code` with this one's modules.

    By `python -c` or `-m` alone, a user's `numpy.py` in the working folder would be taken for the library.
    """
    return [sys.executable, "-P", "-c", f"import sys; sys.path[:] = {sys.path!r}; {code}"]
