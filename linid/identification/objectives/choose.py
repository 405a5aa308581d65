"""Which objective each recording follows, and whether a model can be fitted to it at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.errors import DataError, UsageError
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.free_run import FreeRun
from linid.identification.objectives.objective import Part
from linid.identification.objectives.winding_currents import WindingCurrents, tells_windings
from linid.identification.settings import FitSettings
from linid.identification.signals.motion import measure_motion
from linid.physics.model import Model
from linid.recording.recording import Recording


@dataclass(frozen=True)
class Look:
    """How closely to look: every `thin`-th window, start states taken out linearly, steps as coarse as given."""

    thin: int = 1
    project: bool = False
    coarse: bool = False


FULL = Look()
# Internal steps per sample of the 0.1 s predictions, if no others are asked for: they restart from the measurement, so
# that the error of a step has no time to grow.
WINDOW_STEPS = 2


def window_steps(settings: FitSettings, substeps: int) -> int:
    """Internal steps per sample of predictions from the measurement, where whole runs take `substeps`."""
    return substeps if settings.substeps else min(substeps, WINDOW_STEPS)


def make_parts(
    model: Model, recordings: Sequence[Recording], settings: FitSettings, substeps: int, *, look: Look = FULL
) -> tuple[Part, ...]:
    """The objectives: free wheels and driven runs may follow different ones.

    A motor with windings moves by its measured currents, and these follow from the measured voltages.
    """
    windings = tuple(r for r in recordings if model.winding and tells_windings(r))
    electrical = (WindingCurrents(model, windings),) if windings else ()
    model = replace(model, winding="")
    free = tuple(r for r in recordings if r.kind == "free_wheel")
    driven = tuple(r for r in recordings if r.kind != "free_wheel")
    chosen = settings.objective
    parts: list[Part] = []
    for group, automatic in ((free, "free_run"), (driven, "ahead")):
        if not group:
            continue
        objective = automatic if chosen == "auto" else chosen
        if objective == "free_run":
            # Coast-downs are so free of noise that a coarse step would bias them by more than their interval.
            steps = substeps if look.coarse else max(substeps, 4)
            parts.append(FreeRun(model, group, steps, settings.jobs, look.project))
        elif objective == "ahead":
            steps = min(substeps, WINDOW_STEPS) if look.coarse else window_steps(settings, substeps)
            # A coarse look leads to where all data go on: it weighs driven runs beside free wheels as they do.
            each = look.thin if look.coarse else 1
            parts.append(Ahead(model, group, steps, settings.jobs, settings.horizon, look.thin, stands_for=each))
        else:
            parts.append(Acceleration(model, group, settings.jobs))
    return (*parts, *electrical)


def thinning(recordings: Sequence[Recording]) -> int:
    """Of many windows every fourth is looked at, of few each."""
    return 1 if sum(r.t.size for r in recordings) < 8000 else 4


def coarse_parts(model: Model, recordings: Sequence[Recording], settings: FitSettings) -> tuple[Part, ...]:
    """The objectives as a global search looks at them: thinned, start states taken out linearly, in coarse steps."""
    look = Look(thinning(recordings), project=True, coarse=True)
    return make_parts(model, [without_rest(r) for r in recordings], settings, 1, look=look)


def without_rest(recording: Recording) -> Recording:
    """A free wheel cut 0.15 s after it came to rest: what follows costs time and tells nothing."""
    if recording.kind != "free_wheel":
        return recording
    moving = np.flatnonzero(~measure_motion([recording]).standstill)
    end = int(moving[-1]) + round(0.15 / recording.period) if moving.size else recording.t.size
    end = max(min(end, recording.t.size), min(50, recording.t.size))
    return replace(
        recording,
        t=recording.t[:end],
        y=recording.y[:end],
        v=None,
        phase_currents=None,
        drive_input=None,
        phase_voltages=None,
    )


def check_recordings(recordings: Sequence[Recording], model: Model) -> None:
    """Refuse recordings that the model cannot be fitted to; raises DataError or UsageError."""
    if not recordings:
        raise UsageError(
            "FILE", "there is no recording to fit", "Give at least one recording, or a campaign with `split: fit`"
        )
    for recording in recordings:
        if recording.t.size < 50:
            raise DataError(
                recording.name,
                f"has {recording.t.size} samples, at least 50 are needed for a fit",
                "Record longer or at a higher rate",
            )
    driven = [r for r in recordings if r.kind != "free_wheel"]
    if model.phases:
        if not driven:
            raise UsageError(
                "--model",
                f"{model.kind} needs driven recordings, all are free wheels",
                "Add recordings with phase currents",
            )
        for recording in driven:
            if recording.phase_currents is None:
                raise DataError(
                    recording.name,
                    f"the {model.kind} model needs three phase currents, the recording has none",
                    "Map them with channels: current_u, current_v, current_w, or use --model force",
                )
    if model.single:
        for recording in driven:
            if recording.drive_input is None:
                raise DataError(
                    recording.name,
                    f"the {model.kind} model needs a q-current or command, the recording has none",
                    "Map it with channels: current_q or command, or use --model sine",
                )
