"""What all tests share: speed decides nothing, so no example of a property may fail for the time it took; and no test
leaves the process in another folder, whose removal would fail those that follow."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("linid", deadline=None)
settings.load_profile("linid")


@pytest.fixture(autouse=True, scope="module")
def stays_in_its_folder() -> Iterator[None]:
    """Each module of tests ends in the folder that it began in."""
    before = Path.cwd()
    yield
    assert Path.cwd() == before
