"""Friction laws tried as alternatives of the base, along the measured motion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from linid.arrays import Flags
from linid.diagnosis.descent import SETTLING, Effort
from linid.diagnosis.held_out_tests import CERTAINTY, LEAST_CERTAINTY, LEAST_GAIN
from linid.diagnosis.joint import Fitted, JointFit
from linid.diagnosis.judge import Evidence, Judge, compare
from linid.diagnosis.steps_of_selection import further
from linid.parallel_tasks import in_parallel
from linid.physics import friction
from linid.physics.laws.registry import COULOMB, DAHL, LAWS, LUGRE, find_law

# First values tried: factors on the stiffness that another law's fit has found, and the law's own parameters.
_STIFFNESS = {"lugre": (0.4, 2.0), "dahl": (1.0, 0.5), "elasto_plastic": (1.0, 0.5), "maxwell_slip": (1.0, 2.5)}
_RACE, _MORE = Effort(8, 1e-3, 1), SETTLING  # from each start, and from the best of them
# Starts, and the log power by which a law is worse after a race from these, that say that more of it will not help.
_RACED, _FAR_BEHIND = 2, 0.2
# Slopes that hang on the law; by all other unknowns they are those of the model that is there.
_LAWS_OWN = {p.name for p in friction.PARAMETERS} - {"mass", "viscous_friction"}
_USUAL_BREAKAWAY, _USUAL_STRIBECK = 1.5, 0.01  # of the Coulomb force, of the top speed
# Thresholds: `python -m tests.benchmarks.laws --seed 31 --count 2 --derive` tells what they do at half and twice.
LEAST_CLOSED = 0.3  # of the log power above the floor: what closes less is some effect's work
EQUAL = 0.05  # of the log power per row, within which a law of fewer parameters does as well
REFUTED = 2.0  # deviations from block to block: what is worse by less may be chance
VISIBLE_BREAKAWAY = 1.1  # of the Coulomb force: what the recordings must refute to tell that there is none
VISIBLE_BRISTLE = 0.5  # of the fastest swing that rows resolve: the bristle to be refuted before there is none
# Laws on which a base goes on once they are better; under LuGre's, effects are found beside Dahl's too.
OF_THEIR_OWN = tuple(law for law in LAWS if law not in (LUGRE, DAHL))
# Of LEAST_CLOSED, that one of them promises after a race: true ones, or one for another, have closed two thirds of the
# gap by then, and a quarter beside an effect that lacks (`python -m tests.benchmarks.laws --seed 6151 --count 5`).
PROMISING = 0.5


@dataclass(frozen=True)
class LawTrial:
    """A friction law fitted in the place of the base's, with its evidence against LuGre on fitted and held-out rows."""

    law: str
    fitted: Fitted
    on_fitted: Evidence
    on_held_out: Evidence


def starts_of(one: Fitted, law: str) -> Iterator[dict[str, float]]:
    """First values in SI for a fit of the model under another friction law."""
    model = replace(one.model, law=law)
    names = {p.name: p.default for p in model.parameters}
    values = {**names, **{k: x for k, x in one.values.items() if k in names}}
    if "bristle_stiffness" not in one.values and "bristle_stiffness" in names:
        vector = one.vector
        values["bristle_stiffness"] = float(vector[one.model.slot("bristle_stiffness")])
    for factor in _STIFFNESS.get(law, (1.0,)):
        if "bristle_stiffness" in values:
            yield {**values, "bristle_stiffness": factor * values["bristle_stiffness"]}
        else:
            yield values


def _plain_stribeck(fits: JointFit, values: Mapping[str, float]) -> dict[str, float]:
    """A usual breakaway force and Stribeck speed: LuGre's go astray where its bristle has to do for several, or for one
    that does not drift below breakaway."""
    speed = float(np.quantile(np.abs(fits.balance.rows.v), 0.99))
    return {"static_force": _USUAL_BREAKAWAY * values["coulomb_force"], "stribeck_velocity": _USUAL_STRIBECK * speed}


def _raced(fits: JointFit, one: Fitted, law: str, most: int | None = None) -> Fitted:
    """The best fit of the model under a friction law after a race from several starts about where it is, or from the
    likeliest ones alone. most: stiffnesses of the bristle that are tried (None: all)."""
    model = replace(one.model, law=law)
    tried = [one] if law == one.model.law else []
    searched = find_law(law)
    known = {name: slope for name, slope in fits.slopes(one).items() if name not in _LAWS_OWN}
    astray = searched.own and "static_force" not in searched.absent  # LuGre's breakaway force may not be this law's
    starts = [
        first
        for start in islice(starts_of(one, law), most)
        for first in ((start, {**start, **_plain_stribeck(fits, start)}) if astray else (start,))
    ]
    if searched.elements:
        # The elements' shares trade against all else: what they stand on settles before they are free.
        shares = [p.name for p in searched.own]
        settled = [
            fits.fit(
                model, start, {**one.preset, **{name: start[name] for name in shares}}, one.recordings, _RACE, known
            )
            for start in starts
        ]
        starts = [found.values for found in sorted(settled, key=lambda found: found.level)]
    for start in starts:
        if len(tried) >= _RACED and min(fitted.level for fitted in tried) > one.level + _FAR_BEHIND:
            break
        tried.append(fits.fit(model, start, one.preset, one.recordings, _RACE, known))
    return min(tried, key=lambda fitted: fitted.level)


def under_law(fits: JointFit, one: Fitted, law: str) -> Fitted:
    """The model under a friction law, fitted to the same recordings from where it is."""
    best = _raced(fits, one, law)
    if best is one or best.level > one.level + _FAR_BEHIND:
        return best
    return further(fits, best, best.recordings, _MORE)


def try_laws(judge: Judge, one: Fitted) -> tuple[LawTrial, ...]:
    """The model under every friction law, LuGre first, each fitted to the same recordings from where it is."""
    fits = judge.fits
    rows = fits.rows_of(one.recordings)
    held = judge.balance.split
    fits.slopes(one)  # once, before the threads that start from them
    slowest_first = sorted(LAWS, key=lambda law: -LAWS[law].elements)
    found = dict(in_parallel(lambda law, _: under_law(fits, one, law), slowest_first, judge.balance.jobs))
    base = found[LUGRE]
    return tuple(
        LawTrial(law, found[law], compare(fits, base, found[law], rows), compare(fits, base, found[law], held))
        for law in LAWS
    )


def promised(judge: Judge, one: Fitted) -> float:
    """Share of the gap on the fitted rows that the best of the laws on which fits go on rather than on LuGre's closes
    beside a model, after a race from its likeliest start."""
    fits, rows = judge.fits, judge.fits.rows_of(one.recordings)
    fits.slopes(one)  # once, before the threads that start from them
    raced = in_parallel(lambda law, _: _raced(fits, one, law, 1), OF_THEIR_OWN[::-1], judge.balance.jobs)
    return max(compare(fits, one, best, rows).closed for _, best in raced)


@dataclass(frozen=True)
class LawChoice:
    """What recordings tell of the friction law.

    law: the one that they prefer; told: whether they refute all others; alike: laws that they do not tell from it;
    trials: all, LuGre first; chosen: the preferred one's; base: the law that fits go on with, which is LuGre where
    there is no presliding to be seen, as its own bristle then follows what smoothing makes of a stop.
    """

    law: str
    told: bool
    alike: tuple[str, ...]
    trials: tuple[LawTrial, ...]
    chosen: LawTrial
    base: str


def choose_law(judge: Judge, one: Fitted) -> LawChoice:
    """The friction law that the recordings prefer beside the effects of a fitted model.

    LuGre unless another is clearly better on fitted and on held-out rows, or a simpler one does as well and the
    recordings would show what it lacks.
    """
    return decide(judge, try_laws(judge, one), judge.fits.rows_of(one.recordings))


def decide(judge: Judge, trials: tuple[LawTrial, ...], rows: Flags) -> LawChoice:
    """The friction law that the evidence of all prefers, LuGre's first. rows: (n,), the fitted."""
    better = [t for t in trials if t.law != LUGRE and clearly_better(t.on_fitted) and clearly_better(t.on_held_out)]
    best = max(better, key=lambda t: t.on_fitted.gain + t.on_held_out.gain, default=trials[0])
    doubted = ""  # the law that recordings should show not to be true, and do not
    if best.law == LUGRE:
        lugre = trials[0].fitted
        if unresolved(judge, lugre):
            if shows_bristle(judge, lugre):
                stiff = next(t for t in trials if t.law == COULOMB)
                return LawChoice(COULOMB, True, (), trials, stiff, LUGRE)
            doubted = COULOMB
        dahl = next(t for t in trials if t.law == DAHL)
        if not doubted and as_good(dahl):
            shown = shows_breakaway(judge, lugre, dahl)
            best, doubted = (dahl, "") if shown else (best, DAHL)
    # What contains the simpler law is no rival of it.
    others = [t for t in trials if t is not best and not (t.law == LUGRE and LAWS[best.law].absent)]
    alike = tuple(t.law for t in others if t.law == doubted or not refuted(judge, best, t, rows))
    return LawChoice(best.law, not alike, alike, trials, best, best.law)


def clearly_better(evidence: Evidence) -> bool:
    """Whether a law is beyond doubt better than LuGre; the surer, the less it closes."""
    sure = evidence.certainty >= max(LEAST_CERTAINTY, CERTAINTY * (1.0 - evidence.closed))
    return sure and evidence.gain >= LEAST_GAIN and evidence.closed >= LEAST_CLOSED


def as_good(trial: LawTrial) -> bool:
    """Whether a law is no worse than LuGre, which holds it as a special case, than its fewer parameters explain."""
    held = trial.on_held_out
    worse = held.gain <= -LEAST_GAIN and held.certainty <= -REFUTED
    return trial.on_fitted.gain > -EQUAL and held.gain > -EQUAL and not worse


def refuted(judge: Judge, best: LawTrial, other: LawTrial, rows: Flags) -> bool:
    """Whether a law is clearly worse than the best one, on fitted or on held-out rows. rows: (n,), the fitted."""
    found = [compare(judge.fits, other.fitted, best.fitted, chosen) for chosen in (rows, judge.balance.split)]
    return any(e.gain >= LEAST_GAIN and e.certainty >= REFUTED for e in found) and all(e.gain > 0.0 for e in found)


def unresolved(judge: Judge, lugre: Fitted) -> bool:
    """Whether LuGre's best bristle swings faster than the rows resolve: then there is no presliding to be seen.

    What smoothing over the bump makes of a sudden stop looks like a bristle of about the bump's own length in time; a
    real presliding deflection of F_C/sigma_0 lasts longer than that.
    """
    return _frequency(lugre) > _fastest(judge, lugre)


def shows_bristle(judge: Judge, lugre: Fitted) -> bool:
    """Whether the recordings would show a bristle that they can resolve: LuGre with one is clearly worse. Without a
    stop in them they would not, and any stiffness does."""
    at_most = VISIBLE_BRISTLE * _fastest(judge, lugre)
    values = lugre.values
    slower = at_most / _frequency(lugre)
    # The same damping ratio.
    soft = {name: values[name] * slower**power for name, power in (("bristle_stiffness", 2), ("bristle_damping", 1))}
    return _worse(judge, lugre, soft, lugre)


def shows_breakaway(judge: Judge, lugre: Fitted, dahl: LawTrial) -> bool:
    """Whether the recordings would show a breakaway force above the Coulomb force, which Dahl's law has not: LuGre with
    a little of it is clearly worse."""
    return _worse(judge, lugre, {"static_force": VISIBLE_BREAKAWAY * lugre.values["coulomb_force"]}, dahl.fitted)


def _worse(judge: Judge, one: Fitted, changes: dict[str, float], better: Fitted) -> bool:
    """Whether a model with other values is clearly worse than another model on held-out rows."""
    residual = judge.balance.residual(one.model, one.model.vector({**one.values, **changes}))
    evidence = compare(judge.fits, replace(one, residual=residual), better, judge.balance.split)
    return evidence.gain >= LEAST_GAIN and evidence.certainty >= CERTAINTY


def _frequency(lugre: Fitted) -> float:
    """rad/s at which the mass swings on its bristle."""
    return math.sqrt(lugre.values["bristle_stiffness"] / lugre.values["mass"])


def _fastest(judge: Judge, lugre: Fitted) -> float:
    """rad/s of the fastest swing that the rows resolve: one period in the longest bump."""
    part = judge.balance.part(lugre.model)
    return (
        2.0
        * math.pi
        / max(2.0 * half * float(dt) for half, dt in zip(part.half_widths, part.simulator.inputs.dts, strict=True))
    )
