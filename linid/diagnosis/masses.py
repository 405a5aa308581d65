"""The size of mass and all forces, which only recordings with different added masses tell."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from linid.arrays import Array
from linid.diagnosis.descent import SETTLING
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.unknowns import MASS_RANGE
from linid.physics.parameter import is_force

_STEP = 0.1  # logarithm of one factor and the next that is tried
_STEPS = math.ceil(math.log(MASS_RANGE) / _STEP)  # each way
_TOLD_BY = (0.0, 0.7, -0.7)  # logarithms: the size as it is, and two others
_AS_SIMULATED = 1e-7  # of the largest residual: what rounding leaves
_EXACT = 1e-3  # of the logarithm
_LOWER = 1e-9  # of the criterion: less is rounding, where a fit's bounds make the range flat


def at_the_masses(fits: JointFit, found: Fitted) -> Fitted:
    """A model where mass and all forces are of the size that recordings with different added masses tell.

    Only free wheels tell it, a few of all rows: a fit that starts far off counts them as bursts, and leaves them so.
    A mass beside which no added one counts is no size: a fit that ran there comes back, though it may end higher.
    """
    forces = _forces(found)
    if forces & found.held.keys() or len({fits.balance.recordings[k].added_mass for k in found.recordings}) < 2:
        return found
    level = _level_by_size(fits, found)
    tried = _STEP * np.arange(-_STEPS, _STEPS + 1)
    levels = np.array([level(float(one)) for one in tried])
    beside = np.minimum(levels[:-2], levels[2:])
    sizes = 1 + np.flatnonzero(levels[1:-1] < beside - _LOWER)
    if not sizes.size:
        return found
    best = float(tried[sizes[np.argmin(levels[sizes])]])
    from scipy.optimize import minimize_scalar  # takes long to load, and few campaigns get here

    exact = minimize_scalar(level, bounds=(best - _STEP, best + _STEP), method="bounded", options={"xatol": _EXACT})
    if exact.fun >= found.level and _STEPS in sizes:
        return found
    values = _scaled(found, float(exact.x))
    other = fits.fit(found.model, values, found.preset, found.recordings, SETTLING, shape=found.shape)
    return other if other.level < found.level or _STEPS not in sizes else found


def _forces(found: Fitted) -> set[str]:
    """What grows with the size: mass and all forces."""
    return {p.name for p in found.model.parameters if is_force(p.unit)}


def _scaled(found: Fitted, logarithm: float) -> dict[str, float]:
    """The values of a model, SI, with mass and all forces of another size."""
    forces = _forces(found)
    return {k: x * math.exp(logarithm) if k in forces else x for k, x in found.values.items()}


def _level_by_size(fits: JointFit, found: Fitted) -> Callable[[float], float]:
    """The criterion per row of a model by the logarithm of the factor on mass and all forces.

    The motion hangs on ratios of these: with an added mass a, accelerations are (m + a) / (m + a / factor) times as
    large. So two sizes tell all others, where a third one bears it out; else (a formula in N, say) each is simulated.
    """
    added = np.array([r.added_mass for r in fits.balance.recordings])[fits.balance.rows.recording]
    mass, rows = found.values["mass"], fits.rows_of(found.recordings)

    def simulated(logarithm: float) -> tuple[Array, Array]:
        return fits.unfitted(found.model, _scaled(found, logarithm), found.preset, found.recordings)

    def growth(logarithm: float) -> Array:
        return np.asarray((mass + added) / (mass + added * math.exp(-logarithm)) - 1.0)

    (here, floor), (other, _), (third, _) = (simulated(one) for one in _TOLD_BY)
    unit = growth(_TOLD_BY[1])  # 0 without an added mass
    change = np.divide(other - here, unit, out=np.zeros_like(here), where=unit != 0.0)
    foretold = here + change * growth(_TOLD_BY[2])
    as_simulated = bool(np.max(np.abs(foretold - third)) < _AS_SIMULATED * np.max(np.abs(third)))

    least, most = _room(fits, found) if as_simulated else (0.0, 0.0)

    def level(logarithm: float) -> float:
        if least <= logarithm <= most:
            return fits.level(here + change * growth(logarithm), floor, rows)
        return fits.level(*simulated(logarithm), rows)

    return level


def _room(fits: JointFit, found: Fitted) -> tuple[float, float]:
    """The logarithms of the least and the largest factor of those tried that lie within what is searched."""

    def ends(way: float) -> float:
        able, beyond = 0, _STEPS + 1
        while beyond - able > 1:
            middle = (able + beyond) // 2
            values = _scaled(found, way * _STEP * middle)
            able, beyond = (middle, beyond) if fits.has_room(found.model, values, found.preset) else (able, middle)
        return way * _STEP * able

    return ends(-1.0), ends(1.0)
