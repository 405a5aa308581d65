"""One axis of the independent plant under every friction law, as a campaign records it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from linid.challenge.axes import draw_axis
from linid.challenge.hidden_axis import HiddenAxis, Law, varied
from linid.challenge.plant import simulate
from linid.diagnosis.base import numbered
from linid.recording.recording import Recording
from linid.stand.measurement import measure
from linid.stand.mode_descriptions import FreeWheel

NAMES: dict[Law, str] = {  # the plant's law -> as linid calls it
    "lugre": "lugre",
    "maxwell": "maxwell_slip",
    "dahl": "dahl",
    "elasto_plastic": "elasto_plastic",
    "coulomb": "coulomb",
}
_SEED, _ROUNDED = 105, 10  # of the axis; samples on either side by which a velocity is smoothed


def axis_of(law: Law) -> HiddenAxis:
    """An axis that logs one current."""
    return varied(
        draw_axis("axis", np.random.default_rng(_SEED)),
        np.random.default_rng(_SEED + 1),
        kind="q_linear",
        law=law,
        rate=1000.0,
        resolution=None,
    )


@cache
def recorded(law: Law) -> tuple[Recording, ...]:
    """Free wheels and driven recordings, slow ramps below breakaway among them, with the noise of the sensors."""
    axis, made = axis_of(law), []
    for index, mode in enumerate(axis.campaign):
        run, powered = simulate(axis, mode), not isinstance(mode, FreeWheel)
        y, currents = measure(run.reading, run.currents, axis.measurement, seed=5, index=index, powered=powered)
        made.append(
            Recording(
                name=mode.name,
                t=np.arange(y.size) * axis.measurement.sample_period_s,
                y=y,
                drive_input=currents[0] if powered else None,
                kind="motor" if powered else "free_wheel",
                split=mode.split,
                added_mass=mode.added_mass_kg,
            )
        )
    return tuple(numbered(made))


def sliding(law: Law) -> tuple[Recording, ...]:
    """The free wheels, each cut while it still has a tenth of its speed: no stop, and no presliding."""
    cut = []
    for one in recorded(law):
        if one.kind == "free_wheel":
            width = 2 * _ROUNDED + 1
            speed = np.abs(np.gradient(np.convolve(one.y, np.ones(width) / width, "valid"), one.t[1] - one.t[0]))
            end = int(np.flatnonzero(speed < 0.1 * speed.max())[0])
            cut.append(replace(one, t=one.t[:end], y=one.y[:end]))
    return tuple(numbered(cut))
