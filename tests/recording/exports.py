"""Small scope exports for the tests: a short motion with currents, written in many dialects."""

from __future__ import annotations

from pathlib import Path

import numpy as np

N = 200
T = np.arange(N) * 1e-3
Y = 0.1 + 0.05 * np.sin(2 * np.pi * 3 * T)
IU = 0.5 * np.sin(2 * np.pi * 5 * T + 0.3)
IV = 0.5 * np.sin(2 * np.pi * 5 * T + 2.4)
IW = -(IU + IV)
HEADER = "Time (ms),Actual Position (mm),Phase Current U (A),Phase Current V (A),Phase Current W (A)"


def rows(*, decimals: int = 4) -> list[str]:
    """The motion as comma-separated lines (ms, mm, A, A, A)."""
    return [
        ",".join(f"{x:.{decimals}f}" for x in (1e3 * t, 1e3 * y, u, v, w))
        for t, y, u, v, w in zip(T, Y, IU, IV, IW, strict=True)
    ]


def lines() -> list[str]:
    """Header and rows of a clean export."""
    return [HEADER, *rows()]


def write(folder: Path, content: list[str] | str | bytes, name: str = "scope.csv", encoding: str = "utf-8") -> Path:
    """Write an export and return its path."""
    path = folder / name
    if isinstance(content, list):
        content = "\n".join(content) + "\n"
    path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
    return path


def german(text: str) -> str:
    """Semicolons and decimal commas."""
    return text.replace(",", ";").replace(".", ",")
