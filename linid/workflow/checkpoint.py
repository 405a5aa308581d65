"""The state of a search on disk, so that a run cut short goes on to the same result, bit for bit."""

from __future__ import annotations

import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from linid.errors import ConfigError
from linid.report.files import write_atomic

if TYPE_CHECKING:
    from linid.identification.genetic import SearchState

SCHEMA = 1
# A kill loses at most this much work; writing more often would cost more than it saves.
_EVERY = 0.2  # s


class Checkpoint:
    """Saves each generation of one search; identity: hash of inputs and settings that the state belongs to."""

    def __init__(self, path: Path, identity: str) -> None:
        self.path = path
        self.identity = identity
        self._written = float("-inf")
        self._pending: str | None = None

    def save(self, state: SearchState) -> None:
        """Keep the state after a generation; on disk at once unless the last writing was a moment ago."""
        # The search goes on changing `state`, so it is turned into text here and now.
        self._pending = json.dumps({"schema": SCHEMA, "identity": self.identity, "state": asdict(state)})
        if time.monotonic() - self._written >= _EVERY:
            self.flush()

    def flush(self) -> None:
        """Write what is not yet on disk."""
        if self._pending is not None:
            write_atomic(self.path, self._pending.encode())
            self._pending = None
            self._written = time.monotonic()

    def load(self) -> SearchState | None:
        """The saved state, None if there is none; another problem's or a damaged one raises ConfigError."""
        from linid.identification.genetic import SearchState

        if not self.path.exists():
            return None
        try:
            body = json.loads(self.path.read_text(encoding="utf-8"))
            identity, schema, state = body["identity"], body["schema"], SearchState(**body["state"])
        except (OSError, ValueError, KeyError, TypeError):
            raise ConfigError(str(self.path), "is not a search state", "Delete it to start this search anew.") from None
        if identity != self.identity or schema != SCHEMA:
            raise ConfigError(
                str(self.path), "belongs to a search with other inputs, settings or program versions",
                "Resume with the command and files it was started with, or choose another --out.",
            )  # fmt: skip
        return state
