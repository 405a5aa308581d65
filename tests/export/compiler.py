"""The C compiler, where there is one."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

CC = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
needs_compiler = pytest.mark.skipif(CC is None, reason="no C compiler here")
STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O1")


def compiled(sources: list[Path], out: Path, *flags: str) -> Path:
    """A program or, with -shared, a library of sources, compiled without a warning."""
    command = [str(CC), *STRICT, *flags, "-o", str(out), *map(str, sources), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out
