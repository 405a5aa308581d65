"""What the named effects cost in following error, and what a feed-forward saves, simulated in the drive's loops."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.compensation_data import Compensation, EffectCost, Following, FollowingCourse, Ranged
from linid.diagnosis.drive_courses import courses_of, drive_words, usual_drive
from linid.diagnosis.parameter_draws import draws_of
from linid.errors import LinidError
from linid.identification.result import FitResult
from linid.parallel_tasks import in_parallel
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.closed_loop import Loops, command_of
from linid.simulation.controller import Controller

_SETTLED = 0.25  # s after which the loops have forgotten how the axis began
_LONG = 1.0  # s, of references from which that may be cut
_LOST = "in the loops of this drive the axis does not follow (--controller: other gains, or a larger current limit)"
_MOST_POINTS = 4000  # of a course that is kept


@dataclass(frozen=True)
class FeedForward:
    """How a model becomes a feed-forward. along(result, y, v, a) -> input (n,) in A along a command in m, m/s and
    m/s^2; held(result) -> effects that it has parts for. Both may raise LinidError."""

    along: Callable[[FitResult, Array, Array, Array], Array]
    held: Callable[[FitResult], tuple[str, ...]]


@dataclass(frozen=True)
class _Axis:
    """The axis under its drive. model: with all effects; values: SI, one for each draw; courses: commanded; inputs:
    feed-forwards by name, for every course (cycles,) A; effects: named ones; substeps: per cycle."""

    model: Model
    controller: Controller
    courses: list[Recording]
    inputs: dict[str, list[Array]]
    effects: tuple[str, ...]
    substeps: int

    def loops(self) -> list[Loops]:
        """The drive along all courses, for one axis at a time."""
        return [Loops.along(course, self.controller) for course in self.courses]

    def errors(self, loops: list[Loops], values: dict[str, float], ahead: str = "", absent: str = "") -> list[Array]:
        """Following errors of all courses under a feed-forward ("": none), by an axis without an effect."""
        model = self.model.with_effects(e for e in self.model.effects if e != absent)
        out = []
        for k, (one, course) in enumerate(zip(loops, self.courses, strict=True)):
            given = self.inputs[ahead][k] if ahead else None
            v = float(np.diff(course.y[:2])[0]) / course.period
            out.append(one.run(model, values, (None, v), self.substeps, ahead=given).following_error)
        return out

    def figures(self, values: dict[str, float]) -> dict[str, tuple[float, float]] | None:
        """RMS and largest error in m, by case; None where the axis does not follow in one of them."""
        loops = self.loops()
        reach = max(float(np.ptp(course.y)) for course in self.courses)
        cases = {name: (name, "") for name in ("", "base", "full")}
        for effect in self.effects:
            cases[f"axis without {effect}"] = "", effect
            if f"without {effect}" in self.inputs:
                cases[f"without {effect}"] = f"without {effect}", ""
        out = {}
        for name, (ahead, absent) in cases.items():
            out[name] = _figures(self.courses, self.errors(loops, values, ahead, absent))
            if not out[name][1] < reach:  # nan too
                return None
        return out


def compensation(
    before: FitResult,
    after: FitResult,
    recordings: Sequence[Recording],
    feed_forward: FeedForward,
    controller: Controller | None = None,
    *,
    seed: int = 1,
    jobs: int = 1,
) -> Compensation:
    """Following errors of the model after without a feed-forward, with that of the model before, and with its own.

    recordings: whose references, or travel and speeds, are commanded; controller: None for linid's default, suited to
    the axis; seed: of the draws; jobs: threads. The axis is drawn from the covariance of the model after, while
    the feed-forward stays what the estimates say, so the intervals hold what is not known of the parameters, but not
    what no effect explains. Where there is no figure, the result says why.
    """
    model = Model(after.model, after.effects, law=after.law)
    refused = _refusal(model, after, controller)
    if refused:
        return Compensation(refused=refused)
    values = {e.name: e.value for e in after.estimates}
    courses, words = courses_of(recordings, model, values)
    if not courses:
        return Compensation(refused="no driven recording tells which motions and speeds occur")
    drive = usual_drive(model, values) if controller is None else controller
    effects = tuple(e for e in after.effects if e not in before.effects)
    try:
        inputs, held = _feed_forwards(before, after, effects, courses, (drive, feed_forward))
    except LinidError as error:
        return Compensation(refused=str(error))
    cycles = command_of(courses[0], drive).cycles
    axis = _Axis(model, drive, courses, inputs, effects, max(1, round(after.substeps / cycles)))
    middle = float(np.mean([np.mean(r.y) for r in recordings if r.measured]))
    drawn = draws_of(after, model, middle, seed) or [values]
    figures = []
    for _, found in in_parallel(lambda one, threads: axis.figures(one), drawn, jobs):
        if found is None:
            return Compensation(refused=_LOST)
        figures.append(found)
    told = Compensation(
        drive=drive_words(drive, controller is not None, after.axis, after.input_unit),
        reference=words,
        controller=drive.model_dump(),
        without=_following(figures, ""),
        base=_following(figures, "base"),
        full=_following(figures, "full"),
        effects=tuple(_cost(figures, e, e in held) for e in effects),
        draws=len(drawn) if len(drawn) > 1 else 0,
        seed=seed,
    )
    usual = int(np.argsort([row["full"][0] for row in figures])[len(figures) // 2])
    return replace(told, courses=_kept_courses(axis, drawn[usual]))


def _refusal(model: Model, after: FitResult, controller: Controller | None) -> str:
    """Why there can be no figure, or nothing."""
    if not model.driven_by.inputs:
        return "a friction model has no motor that a drive could push with"
    if controller is not None and after.input_unit != "A":
        return f"the motor's input is in {after.input_unit}, the controller's gains are in A"
    return ""


def _feed_forwards(
    before: FitResult,
    after: FitResult,
    effects: tuple[str, ...],
    courses: list[Recording],
    means: tuple[Controller, FeedForward],
) -> tuple[dict[str, list[Array]], tuple[str, ...]]:
    """Inputs along all courses by case: base, full, full without the part of each effect; and effects with parts."""
    drive, maker = means
    commands = [command_of(course, drive) for course in courses]

    def along(result: FitResult) -> list[Array]:
        return [maker.along(result, one.y, one.v, one.a) for one in commands]

    held = maker.held(after)
    inputs = {"base": along(before), "full": along(after)}
    for effect in effects:
        if effect in held:
            others = tuple(e for e in after.effects if e != effect)
            inputs[f"without {effect}"] = along(replace(after, effects=others))
    return inputs, held


def _figures(courses: Iterable[Recording], errors: Iterable[Array]) -> tuple[float, float]:
    """RMS and largest of following errors (n,) in m over all courses, once the loops have settled."""
    parts = []
    for course, error in zip(courses, errors, strict=True):
        skipped = round(_SETTLED / course.period) if course.duration > _LONG else 0
        parts.append(error[skipped:])
    whole = np.concatenate(parts)
    return float(np.sqrt(np.mean(whole**2))), float(np.max(np.abs(whole)))


def _ranged(numbers: Sequence[float]) -> Ranged:
    """The median of draws, between the least and the largest."""
    if len(numbers) == 1:
        return Ranged(numbers[0])
    return Ranged(float(np.median(numbers)), min(numbers), max(numbers))


def _following(figures: Sequence[dict[str, tuple[float, float]]], case: str) -> Following:
    return Following(_ranged([row[case][0] for row in figures]), _ranged([row[case][1] for row in figures]))


def _cost(figures: Sequence[dict[str, tuple[float, float]]], effect: str, held: bool) -> EffectCost:
    cost = _ranged([row[""][0] - row[f"axis without {effect}"][0] for row in figures])
    if not held:
        return EffectCost(effect, cost, Ranged(), False, why_not(effect))
    saved = _ranged([row[f"without {effect}"][0] - row["full"][0] for row in figures])
    return EffectCost(effect, cost, saved, True)


def why_not(effect: str) -> str:
    """Why a static feed-forward cannot compensate an effect, in a few words. effect: its name."""
    one = find_effect(effect)
    if one.per_recording:
        return "acts in single recordings, which no feed-forward foresees"
    if one.sensor is not None and one.force is None:
        return "an error of the reading: the axis follows it, and no force mends that"
    if one.delay is not None:
        return "a lag of the drive, to be met by commanding earlier, not by a force"
    if "backlash" in one.name:
        return "play: which side it is on hangs on the past, not on the command"
    if one.drive is not None or one.field is not None:
        return "changes what the drive makes of the current; the exported feed-forward has no part for it"
    if one.advance is not None:
        return "hangs on the past of the motion, which a static feed-forward does not know"
    return "the exported feed-forward has no part for it"


def _kept_courses(axis: _Axis, values: dict[str, float]) -> tuple[FollowingCourse, ...]:
    """Errors over time of one axis, with no more points than can be shown."""
    loops = axis.loops()
    rows = [axis.errors(loops, values, name) for name in ("", "base", "full")]
    out = []
    for k, course in enumerate(axis.courses):
        step = -(-course.t.size // _MOST_POINTS)
        lines = [row[k][::step] for row in rows]
        out.append(FollowingCourse(course.name, course.t[::step], course.y[::step], lines[0], lines[1], lines[2]))
    return tuple(out)
