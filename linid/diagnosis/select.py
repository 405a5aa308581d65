"""Selection: effects are confirmed together with the base and added one at a time while they pay."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from linid.diagnosis.alone import PER_RECORDING, acts_in
from linid.diagnosis.balance import Balance
from linid.diagnosis.confirm import Fitted, Judge, better_base, fit_together, rms_per_recording, rows_to_judge, settle
from linid.diagnosis.locate import recording_masses
from linid.diagnosis.screen import Screened, Screening, to_fit
from linid.diagnosis.side_by_side import side_by_side
from linid.identification.effect_guess import Trial
from linid.physics.effects.registry import find_effect

Array = NDArray[np.float64]

CONFIRMED = 5  # effects refitted per step
LARGEST = 3  # effects in one verdict
# An effect pays if its gain is many deviations of the bootstrap, or, where few blocks hold it (a mass shows only while
# the axis accelerates), large and without doubt; and never below a share of the floor, which for a single moment of one
# recording is small.
LEAST_SIGNIFICANCE = 4.0
LARGEST_DOUBT = 0.002
LARGE_GAIN = 0.1
LEAST_GAIN = 0.01
LEAST_GAIN_OF_A_MOMENT = 0.004
# A push must explain so many times as much as the best push at any other moment: residuals of other causes have many
# moments that a push can mimic.
LEAST_LEAD = 4.0
# Effects of single recordings must make these fit as well as the others, up to so many times their residual power; a
# push, which a strong one of a slightly different form leaves traces of, may also explain this share of its recording.
LIKE = 3.0
MOST_OF_ITS_RECORDING = 0.9
LEAST_CLOSURE = 0.7  # of the excess, to be named: true effects close 0.8 to 1, wrong ones at most 0.5
# One more effect must gain this share of what those before it did: real effects never have quite the library's form,
# and what is left of a strong one must not call in others. Either its gain is large beside the floor, of which nobody
# knows the last tenth, and it closes a share of what was left (below half of it: twice as much as any other effect
# would); or it closes most of that, without doubt. Effects of single recordings, which fit themselves to much, must do
# the first, and more of it; a payload, which no single moment vouches for, also without doubt.
SHARE_OF_FIRST = 0.01
WORTH = 0.3
MOST = 0.5
AHEAD = 2.0
SMALL_GAIN = 0.02
WORTH_ALONE = 0.7
# A rival falls behind by this closure, or by leaving so many times as much of the excess (and a share of the floor
# more): two that leave 0.3 % and 9 % are not alike, even where few blocks make the difference.
RIVAL = 0.1
TIMES_LEFT = 5.0
LEFT_ALIKE = 0.15
LONGEST_PUSH = 0.4  # of its recording
# A payload must be in a recording that shows a gap at all, this share of its floor.
LEAST_GAP = 0.3
# The recordings of a push or payload join the fit, which mends all other parameters too: the effect itself must account
# for this share of what was gained.
LEAST_OWN = 0.5
# Held-out excess over the floor (in floors) below which a campaign counts as explained: generated campaigns without
# any hidden effect stay below it.
LEAST_EXCESS = 0.3
# The first is the second with some parameters at zero.
NESTED = {
    ("constant_force", "cable_force"),
    ("current_offset", "cogging"),
}


@dataclass(frozen=True)
class Confirmed:
    """Effects fitted together with the base, judged on the rows that can tell.

    lead: of the last one's trial; 0 where the recordings of a push or payload still fit worse than others.
    """

    effects: tuple[str, ...]
    explained: float
    fitted: Fitted
    closure: float
    low: float
    high: float
    doubt: float
    significance: float
    gain: float
    lead: float = math.inf


@dataclass(frozen=True)
class Selection:
    """What the forward selection found.

    base: the model without effects, fitted again where a candidate showed that it was caught in a poor minimum;
    chosen: all effects that paid, together (None: none did); rivals: per chosen effect those that explain as much;
    singles: the first step's candidates; screened: effect and explained share in the first step, best first.
    """

    base: Fitted
    chosen: Confirmed | None
    rivals: tuple[tuple[Confirmed, ...], ...]
    singles: tuple[Confirmed, ...]
    screened: tuple[tuple[str, float], ...]

    @property
    def rival_names(self) -> tuple[tuple[str, ...], ...]:
        """Per chosen effect the names of its rivals."""
        return tuple(tuple(c.effects[-1] for c in group) for group in self.rivals)


def confirm(
    judge: Judge, screening: Screening, base: Fitted, reference: Fitted, screened: Sequence[Screened],
    watch: Callable[[int, int], None],
) -> tuple[Confirmed, ...]:  # fmt: skip
    """Refit the best screened effects, each together with `base`; the best closure first.

    reference: the model whose residual counts as `before` (the base without any effect).
    """

    fitted = partial(_with_effect, judge.balance, base, screening.known)
    out = []
    for item, found in side_by_side(fitted, screened, screening.jobs, screening.workers):
        _remember(judge.balance, found)
        out.append(judged(judge, reference, found, item.trial))
        watch(len(out), len(screened))
    return tuple(sorted(out, key=lambda c: -c.closure))


def _with_effect(balance: Balance, base: Fitted, known: dict[str, float], item: Screened, jobs: int) -> Fitted:
    """The base with one effect more. At the top of the module, since it also runs on workers; so does the next."""
    recordings = to_fit(balance.recordings, (item.name,))
    return fit_together(balance, base, [(item.name, item.trial)], known, recordings, jobs)


def _at_its_minimum(balance: Balance, known: dict[str, float], one: Confirmed, jobs: int) -> Fitted:
    return settle(balance, one.fitted, known, to_fit(balance.recordings, one.effects), jobs)


def _remember(balance: Balance, found: Fitted) -> None:
    """Keep what a worker has fitted, for a run that goes on later; fits of this process are kept already."""
    if found.key not in balance.memory:
        balance.memory[found.key] = found.genes.tolist()


def judged(judge: Judge, reference: Fitted, found: Fitted, trial: Trial | None = None) -> Confirmed:
    """Closure of a fitted model over the reference, by the effects that the reference lacks."""
    effects = tuple(name for name in found.model.effects if name not in reference.model.effects)
    chosen = rows_to_judge(judge.balance, effects, found.structural)
    closure, low, high, doubt, significance = judge.closure(reference.residual, found.residual, chosen)
    gain = float(np.sum(judge.power(reference.residual)[chosen] - judge.power(found.residual)[chosen]))
    gain /= max(judge.floor(chosen) * judge.balance.rows.recording.size, 1e-300)
    explained, lead = (math.nan, math.inf) if trial is None else (trial.explained, trial.lead)
    if not all(mends_its_recordings(judge, reference, found, name) for name in effects if name in PER_RECORDING):
        lead = 0.0
    return Confirmed(effects, explained, found, closure, low, high, doubt, significance, gain, lead)


def mends_its_recordings(judge: Judge, reference: Fitted, found: Fitted, name: str) -> bool:
    """Whether the recordings of a push or payload fit as well as those without, by its doing.

    One that only mends a part of what is wrong with a recording is not what is wrong with it.
    """
    balance = judge.balance
    # Residual power of each recording in floors.
    before, rest, bare = (
        (rms_per_recording(balance, residual) / judge.noise) ** 2
        for residual in (reference.residual, found.residual, _residual_without(balance, found, name))
    )
    marked = np.array([acts_in(name, found.structural, r) for r in balance.recordings])
    driven = np.array([r.kind != "free_wheel" for r in balance.recordings])
    if not _own(balance, found, name, (before, rest, bare), marked):
        return False
    rest = np.maximum(rest, 1.0)
    others = ~marked & driven if np.any(~marked & driven) else ~marked
    before = before[marked] - 1.0
    left = rest[marked] - 1.0
    mended = np.any(others) and float(np.max(left, initial=0.0)) + 1.0 <= LIKE * float(np.median(rest[others]))
    if name == "payload_change":
        most = float(np.sum(before - left)) >= MOST_OF_ITS_RECORDING * float(np.sum(before))
        return bool(mended or most) and float(np.max(before, initial=0.0)) >= LEAST_GAP
    if name == "external_disturbance" and not _is_a_moment(judge, found):
        return False
    return bool(mended or np.all(before - left >= MOST_OF_ITS_RECORDING * before))


def _own(
    balance: Balance, found: Fitted, name: str, powers: tuple[Array, Array, Array], marked: NDArray[np.bool_]
) -> bool:
    """Whether the effect itself, not what was fitted along with it, mends its recordings.

    powers: residual power (R,) of each recording before, with the effect, and with the effect taken out again. What it
    does is counted in forces, for a heavier axis also shrinks the accelerations of all that is still wrong.
    """
    masses = recording_masses(balance.recordings, found.values["mass"])
    payload = found.values["payload_mass"] if name == "payload_change" else 0.0
    before, rest, bare = (float(np.sum((power * masses**2)[marked])) for power in powers)
    rest_force = float(np.sum((powers[1] * (masses + payload) ** 2)[marked]))
    gained = 1.0 - rest / max(before, 1e-300)
    return 1.0 - rest_force / max(bare, 1e-300) > LEAST_OWN * max(gained, 0.0)


def _residual_without(balance: Balance, found: Fitted, name: str) -> Array:
    """The residual (n,) with an effect taken out and all other parameters left as they are."""
    vector = found.vector.copy()
    vector[[found.model.slot(amplitude) for amplitude in find_effect(name).amplitudes]] = 0.0
    return balance.residual(found.model, vector)


def _is_a_moment(judge: Judge, found: Fitted) -> bool:
    """Whether a push begins within its recording and passes: else the recording differs, but by no push."""
    start, length = found.values["disturbance_start_1"], found.values["disturbance_duration_1"]
    for recording in judge.balance.recordings:
        if acts_in("external_disturbance", found.structural, recording):
            return start >= float(recording.t[0]) and length <= LONGEST_PUSH * recording.duration
    return False


def pays(candidate: Confirmed) -> bool:
    """Whether an effect's held-out gain is significant and not negligible."""
    if candidate.lead < LEAST_LEAD:
        return False
    if candidate.effects[-1] == "payload_change" and candidate.closure < WORTH_ALONE:
        return False
    unique = math.isfinite(candidate.lead)  # at one moment: no other blocks can vouch for it
    clear = candidate.gain >= LARGE_GAIN and (unique or candidate.doubt <= LARGEST_DOUBT)
    least = LEAST_GAIN_OF_A_MOMENT if unique else LEAST_GAIN
    return (candidate.significance >= LEAST_SIGNIFICANCE or clear) and candidate.gain >= least


def worth_adding(candidate: Confirmed, others: Sequence[Confirmed], gained: float) -> bool:
    """Whether an effect judged against the step before deserves its place.

    others: all candidates of this step; gained: by the effects before it.
    """
    alone = candidate.effects[-1] in PER_RECORDING
    if candidate.gain < SHARE_OF_FIRST * gained:
        return False
    significant = candidate.significance >= LEAST_SIGNIFICANCE
    if alone and not (significant or math.isfinite(candidate.lead)):
        return False
    if candidate.gain >= LARGE_GAIN and candidate.closure >= (WORTH_ALONE if alone else WORTH):
        next_best = max((other.closure for other in others if other is not candidate), default=0.0)
        return candidate.closure >= min(MOST, AHEAD * next_best)
    return significant and candidate.gain >= SMALL_GAIN and not alone and candidate.closure >= MOST


def _lead(judge: Judge, best: Confirmed, other: Confirmed) -> float:
    """By how many deviations the best one's residual is the smaller, over the rows that can tell either."""
    chosen = rows_to_judge(judge.balance, other.effects, other.fitted.structural)
    chosen |= rows_to_judge(judge.balance, best.effects, best.fitted.structural)
    difference = judge.power(other.fitted.residual)[chosen] - judge.power(best.fitted.residual)[chosen]
    blocks = np.unique(judge.balance.rows.block[chosen], return_inverse=True)[1]
    sums = np.bincount(blocks, difference)
    return float(sums.sum()) / max(float(np.sqrt(np.sum(sums**2))), 1e-300)


def _fuller_is_better(judge: Judge, simple: Confirmed, fuller: Confirmed) -> bool:
    """Whether the parameters that an effect has beyond a simpler one are worth having."""
    least = max(SMALL_GAIN, SHARE_OF_FIRST * fuller.gain)
    return fuller.gain - simple.gain >= least and _lead(judge, fuller, simple) >= 2.0


def _simplest(judge: Judge, best: Confirmed, others: Sequence[Confirmed]) -> Confirmed:
    """The best candidate, or one that is the best with some parameters at zero and as good."""
    for other in others:
        if (other.effects[-1], best.effects[-1]) in NESTED and not _fuller_is_better(judge, other, best):
            return other
    return best


def rivals(judge: Judge, best: Confirmed, others: Sequence[Confirmed]) -> tuple[Confirmed, ...]:
    """Effects that explain as much as the best one's last effect, as far as these rows can tell."""
    name = best.effects[-1]
    out = []
    for other in others:
        rival = other.effects[-1]
        if rival == name or not pays(other):
            continue
        if (name, rival) in NESTED and not _fuller_is_better(judge, best, other):
            continue  # the simpler one will do
        if _lead(judge, best, other) < 3.0 and _leaves_as_little(judge, best, other):
            out.append(other)
    return tuple(out)


def _leaves_as_little(judge: Judge, best: Confirmed, other: Confirmed) -> bool:
    """Whether two candidates leave about the same of the excess over the held-out rows."""
    if other.closure <= best.closure - RIVAL:
        return False
    least = max(judge.excess(best.fitted.residual), 0.0)
    return judge.excess(other.fitted.residual) <= TIMES_LEFT * least + LEFT_ALIKE


def scales_between(judge: Judge, step: Fitted) -> Array:
    """Scales (R,) m/s^2 between noise and gap: recordings with the gap must count, those without it must still hold
    the base."""
    rms = rms_per_recording(judge.balance, step.residual)
    return np.asarray(np.sqrt(judge.scale * np.maximum(rms, judge.scale)))


def screen_and_confirm(
    judge: Judge, screening: Screening, base: Fitted, reference: Fitted, watch: Callable[[str, int, int], None]
) -> tuple[tuple[Screened, ...], tuple[Confirmed, ...]]:  # fmt: skip
    """One step of the forward selection: every effect screened, the best confirmed.

    A push that other moments could mimic need not be fitted to be refused.
    """
    screened = screening.screen(
        base, scales_between(judge, base), judge.scale, lambda done, total: watch("screen", done, total)
    )
    able = [item for item in screened if item.trial.lead >= LEAST_LEAD]
    # A push lives in one recording of many: however clear, it explains little of the whole.
    best = [item for k, item in enumerate(able) if k < CONFIRMED or math.isfinite(item.trial.lead)]
    found = confirm(judge, screening, base, reference, best, lambda done, total: watch("confirm", done, total))
    return screened, found


def fit_effects(judge: Judge, screening: Screening, base: Fitted, effects: Sequence[str]) -> Fitted | None:
    """The base with exactly these effects; None if one makes no sense here.

    One after the other, each started where it explains most of what the others have left, the strongest first: beside
    a strong one, a weak one's own first values cannot be seen.
    """
    step = base
    while missing := [name for name in effects if name not in step.model.effects]:
        found = screening.screen(step, scales_between(judge, step), judge.scale, only=missing)
        if {s.name for s in found} != set(missing):
            return None
        recordings = screening.to_fit((found[0].name, *step.model.effects))
        added = fit_together(
            judge.balance, step, [(found[0].name, found[0].trial)], screening.known, recordings, screening.jobs
        )
        step = settle(judge.balance, added, screening.known, recordings, screening.jobs)
    return step


def _at_their_minima(
    judge: Judge, screening: Screening, step: Fitted, contest: Sequence[Confirmed], trials: dict[str, Trial]
) -> tuple[Confirmed, tuple[Confirmed, ...]]:
    """The best of candidates that explain as much as each other, when all are fitted to the end, and its rivals then.

    step: the model that they were added to; trials: by effect.
    """

    found = _settled(judge, screening, step, contest, trials)
    best = _simplest(judge, found[0], found)
    return best, rivals(judge, best, found)


def _settled(
    judge: Judge, screening: Screening, step: Fitted, candidates: Sequence[Confirmed], trials: dict[str, Trial]
) -> list[Confirmed]:
    """Candidates fitted to the end, the best closure over `step` first."""
    settled = partial(_at_its_minimum, judge.balance, screening.known)
    found = []
    for one, fitted in side_by_side(settled, candidates, screening.jobs, screening.workers):
        _remember(judge.balance, fitted)
        found.append(judged(judge, step, fitted, trials[one.effects[-1]]))
    return sorted(found, key=lambda c: -c.closure)


def _contested(
    judge: Judge, screening: Screening, base: Fitted, chosen: Confirmed, groups: dict[str, tuple[str, ...]]
) -> tuple[Confirmed, dict[str, tuple[Confirmed, ...]]]:
    """The chosen effects with each of them called in question again, now that the others are there.

    What a step chose also had to make up for what later steps explained: it may be needless now, a simpler form may do,
    and rivals may have lost. groups: rivals by effect. Returns the effects, and for each the rivals that are left.
    """
    standing: dict[str, tuple[Confirmed, ...]] = {}
    for name in chosen.effects[:-1]:  # the last one has just been weighed against the others
        fewer = fit_effects(judge, screening, base, tuple(one for one in chosen.effects if one != name))
        if fewer is not None and not pays(judged(judge, fewer, chosen.fitted)):
            chosen = judged(judge, base, fewer)
    for name in chosen.effects:
        left: list[Confirmed] = []
        simpler = tuple(a for a, b in NESTED if b == name)
        for other in dict.fromkeys((*simpler, *groups.get(name, ()))):
            if other in chosen.effects:
                continue
            effects = tuple(other if one == name else one for one in chosen.effects)
            found = fit_effects(judge, screening, base, effects)
            if found is None:
                continue
            instead = judged(judge, base, found)
            if other in simpler and not _fuller_is_better(judge, instead, chosen):
                chosen, left = instead, []
                name = other
                break
            alike = _lead(judge, chosen, instead) < 3.0 and _leaves_as_little(judge, chosen, instead)
            if alike and other in groups.get(name, ()):
                left.append(replace(instead, effects=(*(e for e in instead.effects if e != other), other)))
        standing[name] = tuple(left)
    return chosen, standing


def forward_selection(
    judge: Judge, screening: Screening, base: Fitted, watch: Callable[[str, int, int], None]
) -> Selection:
    """Effects added to `base` one at a time, the best first, while they pay."""
    chosen: Confirmed | None = None
    groups: list[tuple[Confirmed, ...]] = []
    singles: tuple[Confirmed, ...] = ()
    shares: tuple[tuple[str, float], ...] = ()
    step = base
    for number in range(LARGEST):

        def told(stage: str, done: int, total: int, number: int = number) -> None:
            watch(f"{stage} effect {number + 1}", done, total)

        screened, found = screen_and_confirm(judge, screening, step, base, told)
        if number == 0:
            mended = better_base(
                judge.balance, base, [c.fitted for c in found], screening.to_fit(()), screening.known, screening.jobs
            )
            if mended is not base:
                base = step = mended
                screened, found = screen_and_confirm(judge, screening, step, base, told)
            singles, shares = found, tuple((s.name, s.trial.explained) for s in screened)
        # What counts is what a candidate adds to the step before.
        trials = {item.name: item.trial for item in screened}
        over = sorted((judged(judge, step, c.fitted, trials[c.effects[-1]]) for c in found), key=lambda c: -c.closure)
        better = [c for c in over if pays(c)]
        if chosen is None and not better and judge.excess(base.residual) >= LEAST_EXCESS:
            # Before the gap is called unknown: a quick fit that has not arrived is no refutation.
            over = _settled(judge, screening, step, found, trials)
            better = [c for c in over if pays(c)]
        if chosen is not None:
            better = [c for c in better if worth_adding(c, over, chosen.gain)]
        if not better:
            break
        best = _simplest(judge, better[0], over)
        best, group = _at_their_minima(judge, screening, step, (best, *rivals(judge, best, better)), trials)
        groups.append(group)
        step = best.fitted
        chosen = judged(judge, base, step)
    if chosen is not None and len(groups) > 1:
        names = {name: tuple(c.effects[-1] for c in group) for name, group in zip(chosen.effects, groups, strict=True)}
        chosen, standing = _contested(judge, screening, base, chosen, names)
        groups = [standing.get(name, ()) for name in chosen.effects]
    return Selection(base, chosen, tuple(groups), singles, shares)
