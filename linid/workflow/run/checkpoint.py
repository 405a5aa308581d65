"""The state of a search on disk, so that a run cut short goes on to the same result, bit for bit."""

from __future__ import annotations

import json
import time
from collections import UserDict
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from linid.config import read_json
from linid.errors import ConfigError
from linid.report.files import write_atomic
from linid.workflow.run.checkpoint_schema import STEPS, StateBody

if TYPE_CHECKING:
    from linid.identification.optimise.search_state import SearchState

SCHEMA = 2  # 2: first candidates with their start offsets
_ANEW = "Delete it to start this search anew."
# A kill loses at most this much work; writing more often would cost more than it saves.
_EVERY = 0.2  # s


class Checkpoint:
    """Saves each generation of one search; identity: hash of inputs and settings that the state belongs to."""

    def __init__(self, path: Path, identity: str) -> None:
        self.path = path
        self.identity = identity
        self._written = float("-inf")
        self._pending: dict[str, Any] | None = None

    def save(self, state: SearchState) -> None:
        """Keep the state after a generation; on disk at once unless the last writing was a moment ago."""
        # A generation replaces what the state holds, but only adds to the history.
        self._pending = {**vars(state), "history": list(state.history)}
        if time.monotonic() - self._written >= _EVERY:
            self.flush()

    def flush(self) -> None:
        """Write what is not yet on disk."""
        if self._pending is not None:
            self._written = _write_state(self.path, self.identity, self._pending)
            self._pending = None

    def load(self) -> SearchState | None:
        """The saved state, None if there is none; another problem's or a damaged one raises ConfigError."""
        from linid.identification.optimise.search_state import SearchState

        state = _saved_state(self.path, self.identity)
        if state is None:
            return None
        try:
            StateBody.model_validate(state)
        except (ValidationError, TypeError) as error:
            raise _damaged(self.path, _first(error)) from None
        return SearchState(**state)


class Memory(UserDict[str, Any]):
    """Finished steps of a long computation by key; identity: as above. On disk at once unless the last writing was a
    moment ago; with the end of a `with` all of them."""

    def __init__(self, path: Path, identity: str) -> None:
        self.path = path
        self.identity = identity
        self._lock = Lock()
        self._written = float("-inf")
        self._pending = False
        super().__init__()

    def __enter__(self) -> Memory:
        return self

    def __exit__(self, *_: object) -> None:
        with self._lock:
            if self._pending:
                self._write()

    def __setitem__(self, key: str, value: Any) -> None:
        with self._lock:  # steps may end in several threads
            super().__setitem__(key, value)
            self._pending = True
            if time.monotonic() - self._written >= _EVERY:
                self._write()

    def _write(self) -> None:
        self._written = _write_state(self.path, self.identity, self.data)
        self._pending = False

    def load(self) -> None:
        """Take over the steps that an earlier run finished; another problem's or a damaged file raises ConfigError."""
        state = _saved_state(self.path, self.identity) or {}
        try:
            self.data = dict(STEPS.validate_python(state))
        except ValidationError as error:
            raise _damaged(self.path, _first(error)) from None


def _write_state(path: Path, identity: str, state: dict[str, Any]) -> float:
    """Put a state on disk; returns when that was."""
    body = {"schema": SCHEMA, "identity": identity, "state": state}
    write_atomic(path, json.dumps(body).encode())
    return time.monotonic()


def _saved_state(path: Path, identity: str) -> dict[str, Any] | None:
    if not path.exists():
        return None
    body = read_json(path, _ANEW, finite=False)
    try:
        found, schema, state = body["identity"], body["schema"], dict(body["state"])
    except (ValueError, KeyError, TypeError):
        raise _damaged(path, "no schema, identity and state") from None
    if found != identity or type(schema) is not int or schema != SCHEMA:
        raise ConfigError(
            str(path),
            "belongs to a search with other inputs, settings or program versions",
            "Resume with the command and files it was started with, or choose another --out.",
        )
    return state


def _first(error: Exception) -> str:
    """The first complaint in a line."""
    if not isinstance(error, ValidationError):
        return str(error)[:200]
    one = error.errors(include_url=False)[0]
    where = ".".join(str(step)[:60] for step in one["loc"])
    return f"{where}: {one['msg']}"[:200] if where else one["msg"].removeprefix("Value error, ")[:200]


def _damaged(path: Path, why: str) -> ConfigError:
    return ConfigError(str(path), f"is not a search state ({why})", _ANEW)
