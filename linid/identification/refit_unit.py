"""Free parameters of a functional mock-up unit, identified anew on recordings: what of its gap is only their values."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array, Integers
from linid.errors import DataError, UsageError
from linid.recording.recording import Recording
from linid.simulation.functional_unit import FunctionalUnit, UnitRuns
from linid.statistics import robust_spread

WINDOW = 0.5  # s, after which the unit starts anew at the measured motion: long open-loop runs tell their start most
_DIVERGED = 1e3  # residual of a window that fails or is no number, in what the median sample is off at first
_TRIALS = 30
_STEP = 1e-3  # of a parameter's range, for differences: many times what an integrator's steps make


@dataclass(frozen=True)
class UnitEstimate:
    """A free parameter of a unit, in its unit there: value and 95 % interval; at_end: whether its range stopped it;
    start: as it was."""

    name: str
    start: float
    value: float
    low: float
    high: float
    at_end: bool

    @property
    def sentence(self) -> str:
        """For people."""
        end = ", at the end of its range" if self.at_end else ""
        return f"{self.name} {self.start:.4g} -> {self.value:.4g} [{self.low:.4g}, {self.high:.4g}]{end}"


@dataclass(frozen=True)
class UnitFit:
    """A unit with its free parameters as identified; before, after: RMS error of its runs of a window, m (rad)."""

    unit: FunctionalUnit
    estimates: tuple[UnitEstimate, ...]
    before: float
    after: float


def refit_unit(
    unit: FunctionalUnit, recordings: Sequence[Recording], progress: Callable[[int, int], None] | None = None
) -> UnitFit:
    """Identify a unit's free parameters on the fitted recordings, by robust least squares of its position errors.

    Where it can start anywhere it does so every half second. Intervals are those of independent windows, whatever the
    errors within one (White 1980, Econometrica 48, 817; Huber's sandwich). progress: called with the runs of all
    windows so far and the most there can be. Raises UsageError for what `unit.free` names wrongly and where nothing is
    fitted, DataError where the unit fails at its start values or crashes.
    """
    from scipy.optimize import least_squares
    from scipy.stats import t as student

    fitted = [r for r in recordings if r.split == "fit"]
    if not fitted or not unit.free:
        what = "frees no parameter" if fitted else "has no recording to be fitted to"
        raise UsageError(unit.file, what, "Name `free: {parameter: [low, high]}`, and recordings with `split: fit`.")
    names = tuple(unit.free)
    most = _TRIALS * (1 + len(names))
    low, high = np.array([unit.free[name] for name in names], dtype=np.float64).T
    with UnitRuns(unit, fitted) as runs:
        begun = np.clip(runs.start_values(names, 0.5 * (low + high)), low, high)
        windows = [w for r in fitted for w in runs.windows(r, WINDOW)]
        measured = np.concatenate([w.y for w in windows])
        owner = np.repeat(np.arange(len(windows)), [w.y.size for w in windows])
        first = runs.positions(windows, {})
        if not np.all(np.isfinite(first)):
            raise DataError(fitted[0].name, "is simulated to no number", "Give `parameters` with which the unit runs.")
        scale = max(robust_spread(first - measured), 1e-12)

        def errors(share: Array) -> Array:
            values = dict(zip(names, (low + (share - 1.0) * (high - low)).tolist(), strict=True))
            found = (runs.positions(windows, values) - measured) / scale
            if progress is not None:
                progress(min(runs.count, most), most)
            return np.where(np.isfinite(found), np.clip(found, -_DIVERGED, _DIVERGED), _DIVERGED)

        # Shares of the ranges, from 1 to 2: relative steps of differences are then those of the range.
        start = 1.0 + (begun - low) / (high - low)
        found = least_squares(
            errors, start, bounds=(1.0, 2.0), loss="soft_l1", diff_step=_STEP, xtol=1e-5, ftol=1e-6, max_nfev=_TRIALS
        )
    value = low + (found.x - 1.0) * (high - low)
    half = student.ppf(0.975, max(len(windows) - 1, 1)) * _deviations(found.jac, found.fun, owner) * (high - low)
    ends = np.clip([value - half, value + half], low, high)
    stopped = np.minimum(found.x - 1.0, 2.0 - found.x) < _STEP
    rows = zip(names, *np.array([begun, value, *ends]).tolist(), stopped.tolist(), strict=True)
    estimates = tuple(UnitEstimate(*row) for row in rows)
    anew = {**unit.parameters, **dict(zip(names, value.tolist(), strict=True))}
    before, after = (scale * float(np.sqrt(np.mean(x**2))) for x in ((first - measured) / scale, found.fun))
    return UnitFit(unit.model_copy(update={"parameters": anew, "free": {}}), estimates, before, after)


def _deviations(jacobian: Array, errors: Array, owner: Integers) -> Array:
    """Standard deviations (k,) from the errors (n,) of windows, numbered by owner (n,), under the loss soft_l1.

    jacobian: (n, k) as scipy scales it, by the root of the loss' curvature, (1 + e^2)^(-3/4).
    """
    curvature = (1.0 + errors**2) ** -1.5
    slopes = jacobian * (errors / np.sqrt(1.0 + errors**2) / np.sqrt(curvature))[:, None]
    scores = np.array([np.bincount(owner, column) for column in slopes.T])
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    count = scores.shape[1]
    spread = bread @ (scores @ scores.T) @ bread * (count / max(count - 1, 1))
    return np.array([math.sqrt(max(x, 0.0)) for x in np.diag(spread)])
