"""Where the reference data live that are not part of the project."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


def shared(*parts: str) -> Path:
    """Path below the shared data (environment variable LINID_SHARED, else ../shared); skips the test when missing."""
    root = Path(os.environ.get("LINID_SHARED") or Path(__file__).resolve().parents[2] / "shared")
    path = root.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"reference data not found: {path} (set LINID_SHARED to the folder that holds them)")
    return path
