"""A synthetic axis: rows of a force balance from which one known force is missing, and families as proposals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
from scipy.signal import lfilter

from linid.arrays import Array, Flags
from linid.diagnosis.balance import BIN, BLOCK, Rows
from linid.diagnosis.proposed.arguments import arguments_of
from linid.diagnosis.proposed.family import Family, families, per_recording
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import Proposal
from linid.diagnosis.proposed.regression import Regression, Sums
from linid.diagnosis.proposed.short_formula import FoundFormula, ranked_formulas, short_formula

RECORDINGS, LENGTH, STEP = 12, 900, 3e-3  # 2.7 s each
MASS, STROKE = 2.0, 0.6  # kg, m
NOISE = 0.1  # m/s^2
CREEPING = 0.15  # m/s, a Stribeck velocity that these speeds show
FIELD = 200.0  # rad/m
HELD_EVERY = 4
_TURNS = 30

Force = Callable[[Problem], Array]


def axis(
    missing: Force | None,
    seed: int = 0,
    *,
    noise: float = NOISE,
    memory: float = 0.0,
    rotary: bool = False,
    rests: bool = False,
    stroke: float = STROKE,
    creeping: float = 0.0,
) -> Problem:
    """Swings over the stroke with a known mass, Coulomb and viscous friction and force constant fitted.

    missing: force (n,) in N that the model lacks; noise: deviation in m/s^2; memory: of the noise, from row to row;
    rests: whether the axis stops on its way, for 0.05 to 0.5 s; stroke: in m or rad;
    creeping: Stribeck velocity in m/s, 0: friction is of one level.
    """
    random = np.random.default_rng(seed)
    bare = _bare(random, rotary, rests, stroke, creeping)
    driven = bare.push
    force = np.zeros(driven.size)
    for _ in range(_TURNS if missing is not None else 0):  # the drive moves the axis so whatever is missing
        force = missing(bare)
        bare = replace(bare, push=driven - force)
    white = random.standard_normal(force.size) * noise * np.sqrt(1.0 - memory**2)
    error = lfilter([1.0], [1.0, -memory], white)
    residual = bare.pushed(force[:, None])[:, 0] + error
    modelled = bare.rows.a + error - residual
    known = np.stack([modelled, bare.friction, -bare.rows.v, bare.push], axis=1) / MASS
    fitted = ~bare.held
    residual -= known @ np.linalg.lstsq(known[fitted], residual[fitted], rcond=None)[0]
    weight = 1.0 / float(np.sqrt(np.mean(residual**2)))
    return Problem(
        rows=replace(bare.rows, a=bare.rows.a + error),
        residual=residual,
        weights=np.full(force.size, weight),
        noise=np.full(force.size, noise**2),
        base=known * weight,
        ridge=np.full(4, 1e-3),
        mass=bare.mass,
        push=bare.push,
        friction=bare.friction,
        stribeck=bare.stribeck,
        blur=bare.blur,
        relaxed=bare.relaxed,
        follows=bare.follows,
        damped=bare.damped,
        held=bare.held,
        elapsed=bare.elapsed,
        field=FIELD,
        rotary=rotary,
        seed=1,
    )


def rows_of(problem: Problem, kept: Flags) -> Problem:
    """A problem of some rows (n,) of it."""
    rows = problem.rows
    some = {f.name: getattr(rows, f.name)[kept] for f in fields(rows)}
    own = ("residual", "weights", "noise", "base", "mass", "push", "friction", "stribeck", "blur", "follows", "held")
    return replace(problem, rows=Rows(**some), **{name: getattr(problem, name)[kept] for name in own})


def _bare(random: np.random.Generator, rotary: bool, rests: bool, stroke: float, creeping: float) -> Problem:
    """The motion alone, without any residual."""
    owner = np.repeat(np.arange(RECORDINGS), LENGTH)
    t = np.tile(np.arange(LENGTH) * STEP, RECORDINGS)
    y, v, a = np.full(t.size, stroke / 2.0), np.zeros(t.size), np.zeros(t.size)
    for share, low, high in ((0.6, 0.3, 0.5), (0.25, 0.9, 1.4)):
        size = 0.5 * stroke * share * random.uniform(0.7, 1.0, RECORDINGS)[owner]
        rate = 2.0 * np.pi * random.uniform(low, high, RECORDINGS)[owner]
        angle = rate * t + random.uniform(0.0, 2.0 * np.pi, RECORDINGS)[owner]
        y, v, a = y + size * np.sin(angle), v + size * rate * np.cos(angle), a - size * rate**2 * np.sin(angle)
    if rests:
        y, v, a = _with_rests(random, y)
    friction = -np.tanh(v / 2e-3)
    load = random.uniform(-4.0, 4.0, RECORDINGS)[owner]  # of known weights: force is not acceleration
    n = t.size
    rows = Rows(owner, _numbers(owner, t, BLOCK), _numbers(owner, t, BIN), t, y, v, a, np.zeros(n), np.abs(v) < 1e-9)
    return Problem(
        rows=rows,
        residual=np.zeros(n),
        weights=np.ones(n),
        noise=np.ones(n),
        base=np.zeros((n, 0)),
        ridge=np.zeros(0),
        mass=np.full(n, MASS),
        push=MASS * a - 3.0 * friction + load,
        friction=friction,
        stribeck=1.0 + (0.6 * np.exp(-((v / creeping) ** 2)) if creeping else np.zeros(n)),
        blur=np.zeros(n),
        relaxed=1e-5,
        follows=np.full(n, 1e-9),
        damped=0.0,
        held=owner % HELD_EVERY == 1,
        elapsed=np.arange(RECORDINGS) * LENGTH * STEP,
        field=FIELD,
        rotary=rotary,
        seed=1,
    )


def _with_rests(random: np.random.Generator, y: Array) -> tuple[Array, Array, Array]:
    """The way y (n,) gone with smooth stops on it: y, v, a (n,)."""
    pace = np.ones(y.size)
    for start in np.arange(0, y.size, LENGTH // 3):
        first = start + int(random.integers(20, 60))
        pace[first : first + int(random.uniform(0.05, 0.5) / STEP)] = 0.0
    pace = np.convolve(pace, np.hanning(9) / np.hanning(9).sum(), "same").reshape(RECORDINGS, LENGTH)
    pace[pace < 1e-3] = 0.0
    gone = np.cumsum(pace, axis=1) - pace[:, :1]
    out = np.array([np.interp(g, np.arange(LENGTH), way) for g, way in zip(gone, y.reshape(gone.shape), strict=True)])
    speed = np.gradient(out, STEP, axis=1)
    return out.ravel(), speed.ravel(), np.gradient(speed, STEP, axis=1).ravel()


def _numbers(owner: Array, t: Array, length: float) -> Array:
    """Number (n,) of each row's stretch of some seconds, over all recordings."""
    stretch = (t / length).astype(np.int64)
    return np.unique(owner * (int(stretch.max()) + 1) + stretch, return_inverse=True)[1]


def family_of(problem: Problem, form: str) -> Family:
    """The family of some form."""
    known = [*families(problem, arguments_of(problem)), *per_recording(problem, 0.5)]
    return next(one for one in known if one.form == form)


def proposal_of(problem: Problem, family: Family | str, closed: float = 0.8) -> Proposal:
    """A family as a proposal, whatever its evidence."""
    family = family_of(problem, family) if isinstance(family, str) else family
    regression = Regression(Sums(problem, family.local), family)
    return Proposal(family, regression.best[1], closed, closed - 0.1, 0.01, regression)


def formula_of(problem: Problem, proposal: Proposal) -> FoundFormula | None:
    """The short formula that stands for a proposal's curve, if any."""
    return short_formula(problem, proposal, ranked_formulas(problem, proposal))
