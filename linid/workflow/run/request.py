"""What is asked of a command: files, settings, and where the results go."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from linid.interface.settings import Settings


@dataclass(frozen=True)
class Request:
    """out: None makes a fresh dated folder; jobs: threads, never changes a result; scheduler: address of a
    dask cluster, or `local` (None: no cluster); line: the command line, for the record."""

    files: tuple[Path, ...] = ()
    settings: Settings = field(default_factory=lambda: Settings())
    out: Path | None = None
    overwrite: bool = False
    resume: bool = False
    jobs: int = 1
    scheduler: str | None = None
    dry_run: bool = False
    line: str = ""
