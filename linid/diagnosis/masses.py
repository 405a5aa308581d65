"""The size of mass and all forces, which only recordings with different added masses tell."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import minimize_scalar

from linid.diagnosis.descent import SETTLING
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.unknowns import is_force

_REACH, _STEP = math.log(25.0), 0.1  # logarithms of the factor that is tried
_EXACT = 1e-3  # of its logarithm


def at_the_masses(fits: JointFit, found: Fitted) -> Fitted:
    """A model where mass and all forces are of the size that recordings with different added masses tell.

    Only free wheels tell it, a few of all rows: a fit that starts far off counts them as bursts, and leaves them so.
    """
    forces = {p.name for p in found.model.parameters if is_force(p.unit)}
    if forces & found.held.keys() or len({fits.balance.recordings[k].added_mass for k in found.recordings}) < 2:
        return found

    def scaled(logarithm: float) -> dict[str, float]:
        return {k: x * math.exp(logarithm) if k in forces else x for k, x in found.values.items()}

    def level(logarithm: float) -> float:
        return fits.level_at(found.model, scaled(logarithm), found.preset, found.recordings)

    tried = np.arange(-_REACH, _REACH, _STEP)
    best = float(tried[int(np.argmin([level(float(one)) for one in tried]))])
    exact = minimize_scalar(level, bounds=(best - _STEP, best + _STEP), method="bounded", options={"xatol": _EXACT})
    if not exact.fun < found.level:
        return found
    values = scaled(float(exact.x))
    other = fits.fit(found.model, values, found.preset, found.recordings, SETTLING, shape=found.shape)
    return other if other.level < found.level else found
