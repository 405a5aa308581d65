"""What decides a run, as hashes: its recordings, its settings and the task of a fit."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from linid.workflow.run.run_folder import identity_of

if TYPE_CHECKING:
    from linid.interface.settings import Settings
    from linid.interface.stages import FitTask
    from linid.recording import Recording


def fingerprint(recordings: Iterable[Recording]) -> list[list[str]]:
    """Name and hash of every recording as it enters a fit (after cutting and resampling)."""
    rows = []
    for r in recordings:
        about = f"{r.axis} {r.kind} {r.split} {r.added_mass!r} {r.input_unit} {r.repeat_of} {r.number} {r.elapsed!r}"
        digest = hashlib.sha256(about.encode())
        for array in (r.t, r.y, r.phase_currents, r.drive_input):
            digest.update(b"-" if array is None else array.tobytes())
        for more in (r.reference, None if (r.between_samples, r.jump_at) == ("detected", None) else r.between_samples):
            if more is not None:
                digest.update(f"{r.jump_at!r} {more}".encode() if isinstance(more, str) else more.tobytes())
        if r.simulated is not None:
            digest.update(b"simulated" + r.simulated.tobytes())
        if r.phase_voltages is not None:
            digest.update(b"voltages" + r.phase_voltages.tobytes())
        rows.append([r.name, digest.hexdigest()])
    return rows


def decisive(settings: Settings) -> dict[str, Any]:
    """The settings that decide a result; figures do not."""
    return settings.model_dump(mode="json", exclude={"figures", "figure_formats"})


def task_identity(task: FitTask) -> str:
    """Hash of all that decides the result of a fit."""
    from linid.identification.model_file import model_to_text

    start = None if task.start is None else model_to_text(task.start)
    return identity_of(task.kind, fingerprint(task.recordings), decisive(task.settings), task.known, start)
