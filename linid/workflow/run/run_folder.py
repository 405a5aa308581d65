"""The folder of one run: fresh, never overwritten unasked, with its configuration and `run.json` beside the results.

Everything that depends on time, threads or the machine goes into `run.json` and nowhere else.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from linid.errors import ConfigError, LinidError, UsageError
from linid.report.files import LIST_FILE, FileList, start_listing, stop_listing, write_atomic
from linid.stop_signals import INTERRUPTED, exit_code_of

RUN_FILE = "run.json"
CONFIG_FILE = "config.yaml"
CHECKPOINT_FILE = "checkpoint.json"
FRICTION_FOLDER = "friction"
CURRENTS_FOLDER = "by_currents"
_LOGS = ("log.txt", "traceback.txt")
LOCK_FILE = ".linid.lock"
_GLANCE = 0.2  # s; as long as another run may take to see whether the folder is in use
FINISHED = ("done", "not_converged")


@dataclass
class RunFolder:
    """An open run folder; `record` is the content of run.json. overwrite: an earlier run's files may be removed."""

    path: Path
    command: str
    record: dict[str, Any] = field(default_factory=dict)
    started: float = field(default_factory=time.monotonic)
    previous: dict[str, Any] | None = None
    overwrite: bool = False
    _lock: Any = None

    @property
    def finished_before(self) -> bool:
        """Whether a resumed run was already complete."""
        return self.previous is not None and self.previous.get("status") in FINISHED

    def begin(
        self, *, identity: str, config: str, inputs: Sequence[Mapping[str, Any]], seed: int | None, jobs: int
    ) -> None:
        """Write config.yaml and a first run.json, in place of an earlier run's files where that is allowed.

        A resumed run of another problem raises ConfigError; UsageError where another run writes into the folder, where
        an input would be removed, or a file that was changed since an earlier run wrote it.
        """
        if self.previous is not None:
            before = self.previous.get("identity")
            if before is not None and before != identity:
                raise ConfigError(
                    str(self.path),
                    "holds a run with other inputs, settings or program versions",
                    "Resume with the command and files it was started with, or choose another --out.",
                )
            if self.finished_before:
                return
        self._create()
        self._lock = _lock(self.path)
        try:
            # Another run may have come and gone since the folder was chosen.
            if self.previous is None and _check_room(self.path, self.overwrite):
                clear_run(self.path, [Path(str(one["file"])) for one in inputs if "file" in one])
        except UsageError:
            self._leave_lock()
            raise
        for half in start_listing(self.path).half_written():
            half.unlink(missing_ok=True)
        self.record = {
            "tool": "linid",
            "command": self.command,
            "status": "running",
            "identity": identity,
            "versions": versions(),
            "seed": seed,
            "jobs": jobs,
            "inputs": list(inputs),
            "started": _now(),
            "resumed": self.previous is not None,
            "process": os.getpid(),
            "host": platform.node(),
        }
        write_text(self.path / CONFIG_FILE, config)
        self._write()

    def end(self, status: str, exit_code: int, **more: Any) -> None:
        """Complete run.json."""
        if not self.record:
            return
        self.record.update(
            status=status,
            exit_code=exit_code,
            finished=_now(),
            seconds=round(time.monotonic() - self.started, 3),
            peak_memory_mb=peak_memory_mb(),
            **more,
        )
        self._write()
        self.close()

    def close(self) -> None:
        """Leave the folder to others."""
        stop_listing(self.path)
        self._leave_lock()

    def _leave_lock(self) -> None:
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def _create(self) -> None:
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UsageError(
                str(self.path), f"cannot be created: {error.strerror}", "Choose another folder by --out."
            ) from None

    def _write(self) -> None:
        write_text(self.path / RUN_FILE, json.dumps(self.record, indent=1, ensure_ascii=False) + "\n")


def open_run_folder(command: str, out: Path | None, *, overwrite: bool = False, resume: bool = False) -> RunFolder:
    """Choose (or with resume: find) the folder of a run; it is created when the run begins.

    out: None makes a fresh folder `linid_COMMAND_DATE_TIME` here; with resume it means the newest such folder that
    is not finished. Raises UsageError when a folder holds something and neither overwrite nor resume is given.
    """
    if resume:
        path = out or _newest_unfinished(command)
        previous = read_run(path)
        if previous is None and path.exists() and any(path.iterdir()):
            raise UsageError(
                f"--resume {path}",
                "the folder holds no run (no run.json)",
                "Name the folder of an earlier run by --out.",
            )
        if previous is not None and previous.get("command") != command:
            raise UsageError(
                f"--resume {path}",
                f"the folder holds a {previous.get('command')} run",
                f"It cannot be resumed by {command}.",
            )
    else:
        path, previous = out or fresh_folder(command), None
        if (path / LOCK_FILE).exists() and (held := _lock(path)) is not None:
            held.release()
        _check_room(path, overwrite)
    return RunFolder(path, command, previous=previous, overwrite=overwrite and not resume)


def read_run(path: Path) -> dict[str, Any] | None:
    """The content of a folder's run.json, None if there is none of this tool."""
    try:
        record = json.loads((path / RUN_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return record if isinstance(record, dict) and record.get("tool") == "linid" else None


def identity_of(*parts: Any) -> str:
    """SHA-256 of JSON-able parts and the versions that decide every bit of a result."""
    decisive = {name: versions()[name] for name in ("linid", "numpy", "scipy", "numba", "deap")}
    text = json.dumps([decisive, *parts], sort_keys=True, allow_nan=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def write_text(path: Path, text: str) -> Path:
    """Write a text file whole or not at all."""
    return write_atomic(path, text.encode("utf-8"))


@cache
def versions() -> dict[str, str]:
    """Versions of the program, of Python and of the libraries that compute."""
    from importlib import metadata

    out = {"python": platform.python_version(), "platform": platform.platform()}
    for name in ("linid", "numpy", "scipy", "numba", "deap", "matplotlib"):
        try:
            out[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            out[name] = "not installed"
    return out


def peak_memory_mb() -> float | None:
    """Largest resident memory of this process so far, in MB (None where the system does not tell)."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (2**20 if sys.platform == "darwin" else 2**10), 1)


def _now() -> str:
    return datetime.now(UTC).astimezone().isoformat(timespec="seconds")


def fresh_folder(command: str) -> Path:
    """A path `linid_COMMAND_DATE_TIME` here that does not exist yet; nothing is made."""
    stem = f"linid_{command}_{datetime.now():%Y-%m-%d_%H%M%S}"
    path, number = Path(stem), 1
    while path.exists():
        number += 1
        path = Path(f"{stem}_{number}")
    return path


def _newest_unfinished(command: str) -> Path:
    folders = sorted(Path().glob(f"linid_{command}_*"), key=lambda p: (p.stat().st_mtime, p.name), reverse=True)
    for folder in folders:
        run = read_run(folder)
        if run is not None and run.get("status") not in FINISHED:
            return folder
    raise UsageError(
        "--resume", f"no unfinished folder linid_{command}_* here", "Name the run's folder: --resume --out DIR."
    )


def _lock(path: Path) -> Any:
    """The folder's lock, taken, which the operating system lets go of when this process ends; None on a file system
    without locks. UsageError where another run holds it."""
    from filelock import FileLock, Timeout

    lock = FileLock(path / LOCK_FILE)
    try:
        lock.acquire(timeout=_GLANCE)
    except Timeout:
        other = read_run(path) or {}
        who = f" (process {other['process']} on {other.get('host')})" if "process" in other else ""
        raise UsageError(
            str(path), f"another run{who} is writing into this folder", "Wait for its end, or choose another --out."
        ) from None
    except (OSError, NotImplementedError):
        return None
    return lock


def _check_room(path: Path, overwrite: bool) -> bool:
    """Whether there is a run to be removed first; UsageError where the folder is somebody's else."""
    if path.is_file():
        raise UsageError(str(path), "is a file", "Name a folder by --out.")
    if not path.exists() or all(child.name in (*_LOGS, LOCK_FILE, LIST_FILE) for child in path.iterdir()):
        return False
    if not overwrite:
        raise UsageError(
            str(path),
            "the folder is not empty",
            "Choose another --out, continue its run by --resume, or allow --overwrite.",
        )
    if read_run(path) is None:
        raise UsageError(
            str(path),
            "the folder holds files that are not a run's, --overwrite would mix them",
            "Choose another --out.",
        )
    if not (path / LIST_FILE).is_file():
        raise UsageError(
            str(path),
            "the folder's run did not list its files, so that nobody knows which are its own",
            "Choose another --out, or empty the folder by hand.",
        )
    return True


def clear_run(path: Path, inputs: Sequence[Path] = ()) -> None:
    """Remove what earlier runs listed as theirs, and nothing else.

    Raises UsageError, before anything is removed, for a file that was changed since or is one of `inputs`.
    """
    folders = _runs_below(path)
    owned = {folder: FileList(folder).own() for folder in folders}
    for file in (file for files in owned.values() for file in files):
        if any(given.exists() and given.samefile(file) for given in inputs):
            raise UsageError(
                str(file), "is an input of this run, which --overwrite would remove", "Choose another --out."
            )
    for folder, files in owned.items():
        for file in (*files, *FileList(folder).half_written()):
            file.unlink(missing_ok=True)
        (folder / LIST_FILE).unlink(missing_ok=True)
        emptied = {parent for file in files for parent in file.parents if parent.is_relative_to(folder)} - {path}
        for parent in sorted(emptied, key=lambda one: -len(one.parts)):
            with suppress(OSError):  # somebody else's files are in it
                (parent / LOCK_FILE).unlink(missing_ok=True)
                parent.rmdir()


def _runs_below(path: Path) -> list[Path]:
    """A folder of a run and those of its jobs, the innermost first."""
    jobs = [child for child in path.iterdir() if child.is_dir() and read_run(child) is not None]
    return [*(folder for job in jobs for folder in _runs_below(job)), path]


class Interrupted(KeyboardInterrupt):
    """Ctrl-C (exit code 130) or SIGTERM (143) during a run; its state is saved in `folder`."""

    def __init__(self, folder: Path, exit_code: int = INTERRUPTED) -> None:
        self.folder = folder
        self.exit_code = exit_code
        super().__init__(str(folder))


@contextmanager
def recorded(folder: RunFolder) -> Iterator[None]:
    """Note in run.json how a run that does not finish ended; raises Interrupted for Ctrl-C and SIGTERM."""
    try:
        yield
    except KeyboardInterrupt as stop:
        code = exit_code_of(stop)
        folder.end("interrupted", code)
        raise Interrupted(folder.path, code) from None
    except LinidError as error:
        folder.end("failed", error.exit_code, error=str(error))
        raise
    except Exception as error:
        folder.end("failed", 1, error=repr(error))
        raise
    finally:
        folder.close()
