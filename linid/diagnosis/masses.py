"""The size of mass and all forces, which only recordings with different added masses tell."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import minimize_scalar

from linid.diagnosis.descent import SETTLING
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.unknowns import MASS_RANGE
from linid.physics.parameter import is_force

_STEP = 0.1  # logarithm of one factor and the next that is tried
_STEPS = math.ceil(math.log(MASS_RANGE) / _STEP)  # each way
_EXACT = 1e-3  # of the logarithm
_LOWER = 1e-9  # of the criterion: less is rounding, where a fit's bounds make the range flat


def at_the_masses(fits: JointFit, found: Fitted) -> Fitted:
    """A model where mass and all forces are of the size that recordings with different added masses tell.

    Only free wheels tell it, a few of all rows: a fit that starts far off counts them as bursts, and leaves them so.
    A mass beside which no added one counts is no size: a fit that ran there comes back, though it may end higher.
    """
    forces = {p.name for p in found.model.parameters if is_force(p.unit)}
    if forces & found.held.keys() or len({fits.balance.recordings[k].added_mass for k in found.recordings}) < 2:
        return found

    def scaled(logarithm: float) -> dict[str, float]:
        return {k: x * math.exp(logarithm) if k in forces else x for k, x in found.values.items()}

    def level(logarithm: float) -> float:
        return fits.level_at(found.model, scaled(logarithm), found.preset, found.recordings)

    tried = _STEP * np.arange(-_STEPS, _STEPS + 1)
    levels = np.array([level(float(one)) for one in tried])
    beside = np.minimum(levels[:-2], levels[2:])
    sizes = 1 + np.flatnonzero(levels[1:-1] < beside - _LOWER)
    if not sizes.size:
        return found
    best = float(tried[sizes[np.argmin(levels[sizes])]])
    exact = minimize_scalar(level, bounds=(best - _STEP, best + _STEP), method="bounded", options={"xatol": _EXACT})
    if exact.fun >= found.level and _STEPS in sizes:
        return found
    values = scaled(float(exact.x))
    other = fits.fit(found.model, values, found.preset, found.recordings, SETTLING, shape=found.shape)
    return other if other.level < found.level or _STEPS not in sizes else found
