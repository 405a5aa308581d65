"""Four ways to say what a base lacks: stepwise regression, LASSO, a Gaussian process, and SINDy.

Each takes rows and base of a campaign and returns an answer as plain values. Models are chosen on the fitted recordings
and have to help on the held-out ones, too. scikit-learn and PySINDy are imported where they are used.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.benchmarks.baselines.columns import Base, Rows, candidates, solve

Array = np.ndarray
MOST = 5  # effects that stepwise regression takes
HELPS = 0.03  # of the held-out mean square that a step has to take away
NAMED = 0.05  # of the gap, from which a share is called an effect
MUCH = 0.8  # of what is left in a recording that a mass or a level of friction has to take away there
FEW = {"payload_change": (2, 3), "friction_level_change": (3, 5)}  # recordings that may have it
TOLD = 0.2  # of the held-out variance that has to be explained before anything is told
GP_ROWS = 200  # a Gaussian process costs their cube
RELEVANT = 2.0  # length scales below so many deviations of an argument make it relevant
SEED = 1


class Problem:
    """The target and all columns of a campaign in units of each recording's scatter, without what the base absorbs."""

    def __init__(self, rows: Rows, base: Base) -> None:
        sizes = {k: np.std(base.target[rows.recording == k]) for k in np.unique(rows.recording)}
        middle = float(np.median(list(sizes.values())))
        self.weight = 1.0 / np.array([max(sizes[k], 0.3 * middle) for k in rows.recording])
        self.fit, self.judge = rows.held_out == 0, rows.held_out == 1
        self.base = np.vstack([base.columns, (rows.a)[None, :]]) * self.weight
        self.target = self.free(base.target[None, :] * self.weight)[0]

    def free(self, columns: Array) -> Array:
        """Columns (k, n) without what the base explains of them on the fitted rows."""
        found = np.linalg.lstsq(self.base[:, self.fit].T, columns[:, self.fit].T, rcond=1e-9)[0]
        return np.asarray(columns - found.T @ self.base)

    def table(self, columns: dict[str, Array]) -> dict[str, Array]:
        """Groups of columns, weighted and freed."""
        return {name: self.free(group * self.weight) for name, group in columns.items()}

    def left(self, design: Array) -> Array:
        """What least squares of the fitted rows on a design (k, n) leave of the target."""
        found, _ = solve(design[:, self.fit], self.target[self.fit])
        return np.asarray(self.target - found @ design)


def stepwise(rows: Rows, base: Base) -> dict[str, Any]:
    """Forward selection of groups by BIC among those that also help on the held-out rows; then single recordings."""
    problem = Problem(rows, base)
    table, chosen = problem.table(candidates(rows, base)), list[str]()
    while len(chosen) < MOST:
        now, before = _judged(problem, table, chosen)
        tried = {name: _judged(problem, table, [*chosen, name]) for name in table if name not in chosen}
        good = [name for name, one in tried.items() if one[0] < now and one[1] < (1 - HELPS) * before]
        if not good:
            break
        chosen.append(min(good, key=lambda name: tried[name][0]))
    answer = _named(problem, {name: table[name] for name in chosen})
    left = problem.left(np.vstack([table[name] for name in chosen])) if chosen else problem.target
    return {**answer, "effects": [*answer["effects"], *_single(rows, left / problem.weight)]}


def _single(rows: Rows, left: Array) -> list[str]:
    """What a mass, or another level of friction, in a few recordings explains: it takes MUCH of what is left there,
    in as many recordings as FEW allows."""
    for name, column in (("payload_change", rows.a), ("friction_level_change", np.sign(rows.v))):
        taken = 0
        for number in np.unique(rows.recording):
            one = rows.recording == number
            found = float(column[one] @ left[one]) / float(column[one] @ column[one])
            taken += float(np.mean((left - found * column)[one] ** 2)) < (1 - MUCH) * float(np.mean(left[one] ** 2))
        if FEW[name][0] <= taken <= FEW[name][1]:
            return [name]
    return []


def _judged(problem: Problem, table: dict[str, Array], names: list[str]) -> tuple[float, float]:
    """BIC of some groups, and the mean square that they leave held out."""
    left = problem.left(np.vstack([table[name] for name in names])) if names else problem.target
    count, terms = int(problem.fit.sum()), sum(table[name].shape[0] for name in names)
    held_out, fitted = (float(np.mean(left[chosen] ** 2)) for chosen in (problem.judge, problem.fit))
    return count * math.log(fitted) + terms * math.log(count), held_out


def _named(problem: Problem, groups: dict[str, Array]) -> dict[str, Any]:
    """An answer with shares: what each group explains of the held-out target."""
    if not groups:
        return {"effects": []}
    found, _ = solve(np.vstack(list(groups.values()))[:, problem.fit], problem.target[problem.fit])
    shares, start = {}, 0
    whole = float(np.sum(problem.target[problem.judge] ** 2))
    for name, group in groups.items():
        part = found[start : start + group.shape[0]] @ group
        shares[name] = float(np.sum((part * problem.target)[problem.judge])) / whole
        start += group.shape[0]
    return _told(shares)


def _told(shares: dict[str, float]) -> dict[str, Any]:
    """An answer with the effects that have a share worth a name, where together they explain anything."""
    if sum(shares.values()) < TOLD:
        return {"effects": []}
    order = [name for name in sorted(shares, key=lambda name: -shares[name]) if shares[name] >= NAMED]
    return {"effects": order, "shares": {name: {"share": shares[name]} for name in order}}


def lasso(rows: Rows, base: Base) -> dict[str, Any]:
    """LASSO over all columns, its penalty by cross-validation that leaves out recordings; a name where its group has a
    share of the held-out gap."""
    from sklearn.linear_model import LassoCV
    from sklearn.model_selection import GroupKFold

    problem = Problem(rows, base)
    table = problem.table(candidates(rows, base))
    design = np.vstack(list(table.values()))
    design = design / (np.std(design[:, problem.fit], axis=1, keepdims=True) + 1e-12)
    folds = list(GroupKFold(5).split(design[:, problem.fit].T, groups=rows.recording[problem.fit]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = LassoCV(cv=folds, max_iter=3000, alphas=40).fit(design[:, problem.fit].T, problem.target[problem.fit])
    whole, start, shares = float(np.sum(problem.target[problem.judge] ** 2)), 0, {}
    for name, group in table.items():
        part = model.coef_[start : start + group.shape[0]] @ design[start : start + group.shape[0]]
        shares[name] = float(np.sum((part * problem.target)[problem.judge])) / whole
        start += group.shape[0]
    return _told(shares)


def process(rows: Rows, base: Base) -> dict[str, Any]:
    """A Gaussian process with a length scale for each argument; it knows no names, so it tells `unknown` and
    arguments."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    problem = Problem(rows, base)
    inputs = {
        "position": rows.y,
        "velocity": rows.v,
        "direction": np.sign(rows.v),
        "motor_force": base.thrust,
        "acceleration": rows.a,
        "time": rows.t,
        "campaign_time": rows.started,
        "travel": rows.travel,
    }
    x = np.stack([(one - one.mean()) / (one.std() + 1e-12) for one in inputs.values()], axis=1)
    random = np.random.default_rng(SEED)
    taken = random.choice(np.flatnonzero(problem.fit), min(GP_ROWS, int(problem.fit.sum())), replace=False)
    kernel = ConstantKernel(1.0) * RBF(np.full(x.shape[1], 3.0), (0.05, 1e3)) + WhiteKernel(0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = GaussianProcessRegressor(kernel, normalize_y=True).fit(x[taken], problem.target[taken])
    rest = problem.target[problem.judge] - model.predict(x[problem.judge])
    explained = 1 - float(np.mean(rest**2) / np.mean(problem.target[problem.judge] ** 2))
    if explained < TOLD:
        return {"effects": []}
    lengths = dict(zip(inputs, model.kernel_.k1.k2.length_scale, strict=True))
    arguments = [name for name in sorted(lengths, key=lambda name: lengths[name]) if lengths[name] < RELEVANT]
    return {"effects": [], "unknown": True, "arguments": arguments[:3]}


# Monomials of SINDy -> the effect of the list that they mean; what is missing is a cause of its own.
_MEANT = {
    ("one",): "constant_force",
    ("position",): "cable_force",
    ("position", "position"): "cable_force",
    ("direction", "velocity"): "asymmetric_friction",
    ("direction", "position"): "position_dependent_friction",
    ("speed", "velocity"): "quadratic_drag",
    ("motor_force", "motor_force"): "force_saturation",
    ("motor_force", "size"): "force_saturation",
    ("motor_force", "time"): "thermal_derating",
    ("direction", "size"): "load_dependent_friction",
    ("direction", "time"): "friction_drift",
    ("campaign_time", "direction"): "friction_drift",
    ("sine",): "cogging",
    ("cosine",): "cogging",
    ("cosine", "sine"): "cogging",
    ("sine", "sine"): "cogging",
    ("motor_force", "position"): "end_effect",
    ("cosine", "motor_force"): "force_ripple",
    ("motor_force", "sine"): "force_ripple",
}
_ARGUMENT = {"sine": "position", "cosine": "position", "speed": "velocity", "size": "motor_force"}


def sindy(rows: Rows, base: Base) -> dict[str, Any]:
    """PySINDy: products of two of what an engineer would measure, sparse by sequential thresholds; the threshold that
    serves the held-out recordings best is taken, and nothing is told unless it explains a part of them."""
    import pysindy

    problem = Problem(rows, base)
    middle, reach = 0.5 * (rows.y.min() + rows.y.max()), 0.5 * float(np.ptp(rows.y))
    force = base.thrust / (np.std(base.thrust) + 1e-12)
    inputs = {
        "position": (rows.y - middle) / reach,
        "velocity": rows.v,
        "speed": np.abs(rows.v),
        "direction": np.sign(rows.v),
        "motor_force": force,
        "size": np.abs(force),
        "sine": np.sin(base.angle),
        "cosine": np.cos(base.angle),
        "time": rows.t,
        "campaign_time": rows.started / rows.started.max(),
    }
    library = pysindy.PolynomialLibrary(degree=2, include_bias=True)
    columns = np.asarray(library.fit_transform(np.stack(list(inputs.values()), axis=1))).T
    labels = [_monomial(name, list(inputs)) for name in library.get_feature_names(list(inputs))]
    design = problem.free(columns * problem.weight)
    kept = np.std(design[:, problem.fit], axis=1) > 0.05
    design, labels = design[kept], [label for label, keep in zip(labels, kept, strict=True) if keep]
    design /= np.std(design[:, problem.fit], axis=1, keepdims=True)
    best, weights = 0.0, np.zeros(len(labels))
    for threshold in (0.05, 0.1, 0.2, 0.3, 0.5):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            optimizer = pysindy.STLSQ(threshold=threshold, alpha=1e-2)
            optimizer.fit(design[:, problem.fit].T, problem.target[problem.fit][:, None])
        found = np.asarray(optimizer.coef_)[0]
        rest = (problem.target - found @ design)[problem.judge]
        explained = 1 - float(np.mean(rest**2) / np.mean(problem.target[problem.judge] ** 2))
        if explained > best:
            best, weights = explained, found
    return _spoken(labels, weights) if best >= TOLD else {"effects": []}


def _monomial(name: str, inputs: list[str]) -> tuple[str, ...]:
    """The factors of a feature's name, sorted; `one` for the constant."""
    factors: list[str] = []
    for part in name.split():
        stem, _, power = part.partition("^")
        if stem in inputs:
            factors += [stem] * int(power or 1)
    return tuple(sorted(factors)) or ("one",)


def _spoken(labels: list[tuple[str, ...]], weights: Array) -> dict[str, Any]:
    """The largest terms (those with a third of the largest weight) as names of the list, or as a cause of its own."""
    order = np.argsort(-np.abs(weights))
    large = [labels[k] for k in order if abs(weights[k]) > abs(weights[order[0]]) / 3 and weights[k] != 0][:MOST]
    names = [_MEANT[label] for label in large if label in _MEANT]
    odd = [label for label in large if label not in _MEANT]
    arguments = [_ARGUMENT.get(factor, factor) for label in odd for factor in label]
    answer: dict[str, Any] = {"effects": list(dict.fromkeys(names))}
    return {**answer, "unknown": True, "arguments": list(dict.fromkeys(arguments))} if odd else answer


METHODS: dict[str, Callable[[Rows, Base], dict[str, Any]]] = {
    "stepwise regression": stepwise,
    "LASSO": lasso,
    "Gaussian process": process,
    "SINDy": sindy,
}
