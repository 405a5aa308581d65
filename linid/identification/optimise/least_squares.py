"""The local least squares: damped steps on search coordinates and start offsets, with the class noise re-estimated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.linearisation import Linearisation, Told
from linid.identification.result import Generation
from linid.identification.settings import Ending
from linid.identification.space.field_vector import FieldVector, field_vector

FIRST_DAMPING = 1e-4  # at first, relative to each parameter's own curvature
_LEAST_AT_FIRST = 1e-9  # where a fit goes on: its weights may be others
# By which factor damping goes on where a step gains more than a share of what it promised: along a valley that hardly
# bends each step is as long as damping lets it be. Far from a minimum such steps leave for others.
_NEAR, _FAR = ((0.9, 0.03), (0.75, 0.1), (0.25, 1.0)), ((0.75, 0.1), (0.25, 1.0))
_MORE_DAMPED = 4.0
_UNDAMPED = 1e-12
_DAMPING_AGAIN = 1e-8  # at least, once a step has failed
_TRUST_RADIUS = 0.3  # of the search box at most in a step: search coordinates that hardly matter here may matter there
_LEAST_GAIN_RATIO = 1e-3  # of the promised gain
_VALLEY_STEPS = 4
# Where the linearisation holds nowhere, as where each change of the parameters makes an axis turn a sample earlier or
# later: so many steps one after the other, each damped that much, that gain less of what an undamped one promises.
_STALLING_STEPS, _STALLING_DAMPING, _STALLING_GAIN = 2, 1.0, 0.01
# A step is bent by the second derivative of the residuals along it, probed at a tenth of the step; if the bend is too
# long beside the step, the curve is not known well enough (Transtrum and Sethna 2012).
_CURVE_PROBE = 0.1
_LARGEST_BEND = 0.375
_WORTH_BENDING = 0.3  # promised gain of a step, above which looking is worth a simulation
_CHANCE = 1e-3  # that steps go back to where all groups count alike though the model is right
_LEFT_OUT = "left out as asked; intervals hold at a minimum only"


@dataclass(frozen=True)
class Start:
    """Where least squares begin: search coordinates, point (p,), start offsets (k,) or None for none yet, and the
    damping, None where that may be far from a minimum; told: of the same problem there, but for its weights; by_groups:
    as of `LeastSquaresFit`."""

    point: Array
    offsets: Array | None = None
    damping: float | None = None
    told: Told | None = None
    by_groups: bool = False


@dataclass(frozen=True)
class LeastSquaresFit:
    """Search coordinates, point (p,), offsets (k,), cost, whether it converged and why, history, and the final
    linearisation.

    residuals: (N,) weighted; jacobian: (N, p + k) of the weighted residuals; damping: of the next step, if there were
    one; weights: (N,) of each part's residuals; told: what the simulation last told of residuals and slopes without
    their weights, if it is kept; moved_from: (p + k,) where the Jacobian is, None: where the fit is; ended:
    no step was left to take, be it that it converged or that the linearisation held nowhere; by_groups: the samples of
    free runs do not count each, see `_Cheapest`.
    """

    point: Array
    offsets: Array
    cost: float
    converged: bool
    reason: str
    history: tuple[Generation, ...]
    evaluations: int
    residuals: Array
    jacobian: Array
    damping: float = FIRST_DAMPING
    weights: tuple[Array, ...] = field(default=(), repr=False)
    told: Told | None = field(default=None, repr=False)
    moved_from: Array | None = field(default=None, repr=False)
    ended: bool = True
    by_groups: bool = False

    @property
    def linearised_at(self) -> Array:
        """Search coordinates and offsets (p + k,) where the Jacobian is."""
        return np.concatenate([self.point, self.offsets]) if self.moved_from is None else self.moved_from

    @property
    def start(self) -> Start:
        """To go on from."""
        return Start(self.point, self.offsets, self.damping, by_groups=self.by_groups)


def levenberg_marquardt(
    problem: Problem,
    cost: Cost,
    start: Array | Start,
    *,
    ending: Ending | None = None,
    final: bool = True,
    bend: bool = True,
    keep: bool = False,
    watch: Callable[[int, float], None] | None = None,
) -> LeastSquaresFit:
    """Refine search coordinates within the box, the noise re-estimated at each step.

    start: search coordinates (p,) alone, or all that is known; final: also return the linearisation at the end; bend:
    follow curved valleys, to second order; keep: also what was last told without weights, to go on from under others;
    watch: called after each step with its number and cost.
    Source: Marquardt 1963, J. Soc. Indust. Appl. Math. 11; weights and bends as of `Linearisation` and `_bent`.
    """
    ending = Ending() if ending is None else ending
    start = start if isinstance(start, Start) else Start(start)
    line = Linearisation(problem, cost, told=start.told, by_groups=start.by_groups)
    steps = _Steps(line, bend, ending.precision, start.damping)
    p, offsets = line.p, np.zeros(line.k) if start.offsets is None else start.offsets
    x = np.concatenate([np.clip(start.point, 1e-9, 1.0 - 1e-9), offsets])
    cheapest = _Cheapest(line, steps, x)
    history = []
    gains: list[float] = []
    reason = ""
    for number in range(1, ending.steps + 1):
        x, gain, reason = steps.next(x)
        if reason:
            break
        x, current = cheapest.or_back(x, line.reweight(x))
        history.append(Generation("least_squares", number, cost.evaluations, cheapest.cost, current))
        if watch is not None:
            watch(number, current)
        if current <= ending.cost:
            reason = f"a cost of {ending.cost:.4g} was all that was asked for"
            break
        gains.append(gain)
        reason = _along_a_valley(gains, ending.valley_gain)
        if reason:
            break
    central = final and bool(np.all((x[:p] > 1e-4) & (x[:p] < 1.0 - 1e-4)))
    return LeastSquaresFit(
        x[:p],
        x[p:],
        cheapest.cost,
        bool(reason) and not steps.stalled,
        f"least squares: {reason or (f'{ending.steps} steps used' if ending.steps else _LEFT_OUT)}",
        tuple(history),
        cost.evaluations,
        line.residuals(x),
        line.jacobian(x, central=central) if final else np.zeros((0, 0)),
        steps.damping,
        tuple(line.weights),
        line.told if keep else None,
        ended=bool(reason),
        by_groups=line.by_groups,
    )


def _along_a_valley(gains: Sequence[float], least: float) -> str:
    """Why steps end that have gained less than the least in the sum of squares of late; empty where they have not."""
    gained = sum(gains[-_VALLEY_STEPS:])
    if len(gains) < _VALLEY_STEPS or gained >= least:
        return ""
    return f"{_VALLEY_STEPS} steps gained {gained:.2g} (one standard deviation weighs 1)"


class _Cheapest:
    """Where least squares have been at the least cost, to go back to if samples that count each lead astray.

    Once nothing but the encoder's noise is left of a free run, each of its samples counts, which tells most if the
    model is right. If it is not, they count ever more as the fit to them comes closer, and all else is left behind.
    So the point that they lead to must lie no farther from the cheapest one, where each group counts, than chance
    leaves open (as Hausman 1978, Econometrica 46, 1251, tells an efficient estimate from one that holds more widely).
    """

    def __init__(self, line: Linearisation, steps: _Steps, x: Array) -> None:
        self.line, self.steps, self.told = line, steps, line.told
        self._keep(x, line.reweight(x))
        self._room = _within_chance(x.size)

    def _keep(self, x: Array, cost: float) -> None:
        self.x, self.cost, self.damping = x, cost, self.steps.damping

    def or_back(self, x: Array, cost: float) -> tuple[Array, float]:
        """x (p + k,) and its cost, or, where it is out of reach of the cheapest point, that one, from where each group
        counts, and no sample."""
        line = self.line
        if line.told is not None and np.array_equal(line.told.x, self.x):
            self.told = line.told
        if cost <= self.cost:
            self._keep(x, cost)
        elif line.samples_count and 2.0 * line.cost.groups * np.log(cost / self.cost) > self._room:
            line.by_groups, line.told, self.steps.damping = True, self.told, self.damping
            return self.x, line.reweight(self.x)
        return x, cost


def _within_chance(parameters: int) -> float:
    """How much twice the logarithm of a likelihood falls by chance between a minimum and the true parameters."""
    from scipy.special import chdtri

    return float(chdtri(parameters, _CHANCE))


class _Steps:
    """Damped steps with a trust region; the damping follows how well the linearisation predicted the gain."""

    def __init__(self, line: Linearisation, bend: bool, precision: float, damping: float | None) -> None:
        self.line, self.bend, self.precision = line, bend, precision
        motions = [part.motion for part in line.problem.parts]
        self.field = field_vector(line.problem.space, motions) if bend else None
        self.lower, self.upper = line.bounds
        self.damping = FIRST_DAMPING if damping is None else min(max(damping, _LEAST_AT_FIRST), FIRST_DAMPING)
        self.calmer = _FAR if damping is None else _NEAR
        self.trust_radius = np.concatenate([np.full(line.p, _TRUST_RADIUS), np.full(line.k, np.inf)])
        self._stalling = 0  # steps so far

    @property
    def stalled(self) -> bool:
        """Whether the linearisation holds nowhere: an end, but no minimum."""
        return self._stalling >= _STALLING_STEPS

    def next(self, x: Array) -> tuple[Array, float, str]:
        """The next point (p + k,), what it gains in the sum of squares, and why it is the last (else empty)."""
        line, lower, upper = self.line, self.lower, self.upper
        if self.stalled:
            return x, 0.0, f"{_STALLING_STEPS} steps gained next to nothing of what longer ones promise"
        tangent = line.tangent(x)
        residual, jacobian = tangent.rotated
        before = float(residual @ residual)
        undamped, damped = (
            _damped_step(residual, jacobian, d, lower - x, upper - x)[1] for d in (_UNDAMPED, self.damping)
        )
        if undamped < self.precision and damped < self.precision:
            return x, 0.0, f"no step promises to gain {self.precision:g} (one standard deviation weighs 1)"
        while True:
            room = np.maximum(lower - x, -self.trust_radius), np.minimum(upper - x, self.trust_radius)
            move, predicted = _damped_step(residual, jacobian, self.damping, *room)
            if self.bend and predicted > _WORTH_BENDING:
                probed = line.residuals(_moved(self.field, x, _CURVE_PROBE * move, lower, upper))
                move = _bent(move, tangent.pulled(probed), residual, jacobian, self.damping)
            trial = _moved(self.field, x, move, lower, upper)
            gain = before - float(np.sum(line.residuals(trial) ** 2))
            gain_ratio = gain / predicted
            if gain_ratio > _LEAST_GAIN_RATIO or predicted < _LEAST_GAIN_RATIO * self.precision:
                break
            self.damping = max(10.0 * self.damping, _DAMPING_AGAIN)
        if gain_ratio <= _LEAST_GAIN_RATIO:
            why = f"no step gains anything (the next promises {predicted:.1g}, one standard deviation weighs 1)"
            return x, 0.0, why
        stalls = self.damping >= _STALLING_DAMPING and gain < _STALLING_GAIN * undamped
        self._stalling = self._stalling + 1 if stalls else 0
        self.damping *= next((factor for least, factor in self.calmer if gain_ratio > least), _MORE_DAMPED)
        return trial, gain, ""


def _moved(field: FieldVector | None, x: Array, move: Array, lower: Array, upper: Array) -> Array:
    """x + move within the bounds, the field's vector in a straight line."""
    return np.clip(x + move if field is None else field.moved(x, move), lower, upper)


def _bent(move: Array, pulled: Array, residual: Array, jacobian: Array, damping: float) -> Array:
    """The step (n,) bent along the valley that it follows: with half the geodesic acceleration added.

    pulled: (n,) transposed Jacobian times the residuals at `_CURVE_PROBE` of the step; residual, jacobian: (m,), (m, n)
    in rotated axes at its start. The step as it is, where the acceleration is not small beside it.
    Source: Transtrum and Sethna 2012, arXiv:1201.5885.
    """
    free = move != 0.0
    second = (pulled - jacobian.T @ residual) / _CURVE_PROBE - jacobian.T @ (jacobian @ move)
    norms = np.linalg.norm(jacobian[:, free], axis=0)
    norms[norms == 0.0] = 1.0
    scaled = jacobian[:, free] / norms
    normal = scaled.T @ scaled + damping * np.eye(norms.size)
    bend = -np.linalg.lstsq(normal, second[free] / (_CURVE_PROBE * norms), rcond=None)[0]
    if not np.linalg.norm(bend) <= _LARGEST_BEND * np.linalg.norm(move[free] * norms):
        return move
    out = move.copy()
    out[free] += bend / norms
    return out


def _damped_step(residual: Array, jacobian: Array, damping: float, lower: Array, upper: Array) -> tuple[Array, float]:
    """The damped Gauss-Newton step (n,) between lower <= 0 and upper >= 0, and the decrease that it promises of the sum
    of squares. residual: (m,); jacobian: (m, n)."""
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0.0] = 1.0
    stacked = np.vstack([jacobian / norms, np.sqrt(damping) * np.eye(norms.size)])
    aim = np.concatenate([-residual, np.zeros(norms.size)])
    move = np.linalg.lstsq(stacked, aim, rcond=None)[0] / norms
    if np.any((move < lower) | (move > upper)):
        from scipy.optimize import lsq_linear

        move = lsq_linear(stacked, aim, (lower * norms, upper * norms), method="bvls").x / norms
    change = jacobian @ move
    return move, -float(2.0 * residual @ change + change @ change)
