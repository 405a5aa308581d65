"""What a proposed term says, in an engineer's words, and the recording that would test it."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from linid.diagnosis.proposed.arguments import RATE, arguments_of
from linid.diagnosis.proposed.basis import support
from linid.diagnosis.proposed.curve import period_of
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.propose import KEPT, Proposal
from linid.diagnosis.proposed.quantities import quantity
from linid.diagnosis.proposed.regression import Regression
from linid.physics.effects.effect import ARGUMENTS

MOSTLY = 0.5  # of what is left: a term that closes less says nothing of what the rest depends on
CLEARLY = 0.7  # of the term's gain: an argument whose families all gain less is not what it depends on
_SAID = 3  # arguments that a sentence rules out
_ORDER = ("position", "velocity", "motor_force", "acceleration", "time", "campaign_time", "travel", "rest_time")
_MOST_PARTS = 2  # recordings that are asked for at once


def listed(words: Sequence[str], last: str = "and") -> str:
    """`a`, `a and b`, `a, b and c`."""
    return " ".join([", ".join(words[:-1]), last, words[-1]]) if len(words) > 1 else "".join(words)


def term_labels(problem: Problem, names: Sequence[str]) -> tuple[str, ...]:
    """Labels of arguments, for people; a rotary axis has torques."""
    labels = [ARGUMENTS[name] for name in names]
    return tuple(label.replace("force", "torque") if problem.rotary else label for label in labels)


def not_on(problem: Problem, proposal: Proposal, judged: Sequence[Regression]) -> tuple[str, ...]:
    """Names of arguments that were tried and that the term does not depend on: families with them, which lack one of
    the term's own, gain clearly less, and with the term's own hardly more.

    judged: the best families, that with the largest gain first. Empty where the term closes too little to tell.
    """
    if proposal.closed < MOSTLY:
        return ()
    mine = set(proposal.arguments)
    tried = {argument.name for argument in arguments_of(problem).values()} - mine
    unknown = judged[-1].best[1] if len(judged) >= KEPT else 0.0  # what families that were not kept may have gained
    out = []
    for name in _ORDER:
        if name not in tried:
            continue
        having = [one for one in judged if name in one.family.arguments]
        alone = [one.best[1] for one in having if not mine <= set(one.family.arguments)]
        beside = [one.best[1] for one in having if mine <= set(one.family.arguments)]
        if max([unknown, *alone]) < CLEARLY * proposal.gain and max(beside, default=0.0) * CLEARLY < proposal.gain:
            out.append(name)
    return tuple(out)


def sentence(problem: Problem, proposal: Proposal, without: Sequence[str], low: float, high: float) -> str:
    """On what the missing force depends, how surely, and how much of it a term closes.

    without: names of arguments that it does not depend on; low, high: 95 % interval of the share that it closes.
    """
    ruled = [name for name in without if name != "acceleration"][:_SAID]
    other = f", not on {listed(term_labels(problem, ruled), 'or')}" if ruled else ""
    chance = "p ≤ 0.01" if proposal.p_value <= 0.01 else f"p = {proposal.p_value:.2g}"
    closes = f"closes {_percent(proposal.closed)} % [{_percent(low)}, {_percent(high)}] of it"
    names = tuple(name for name in proposal.arguments if name != "recording")
    if not names:
        kind = "torque" if problem.rotary else "force"
        each = ", another one in each recording" if proposal.arguments else ""
        return f"What is left is a constant {kind}{each} ({chance}); it {closes}."
    labels = term_labels(problem, names)
    how = _manners(proposal)
    told = listed(
        [f"{label} ({how[name]})" if name in how else label for name, label in zip(names, labels, strict=True)]
    )
    each = ", with another size in each recording" if "recording" in proposal.arguments else ""
    term = f"a term of {labels[0]} alone" if len(names) == 1 else "a term of these"
    return f"What is left depends on {told}{each}{other} ({chance}); {term} {closes}."


def _manners(proposal: Proposal) -> dict[str, str]:
    """How it depends on some of its arguments, where a few words say it."""
    family = proposal.family
    if "recording" in family.arguments:
        return {}
    out = {family.factor: "not in proportion to it"} if family.bends else {}
    if family.local:
        out["time"] = "another phase in each recording"
        wave = re.match(r"waves of ([\d.]+) per s\b", family.form)
        if wave:
            out["time"] = f"{quantity(float(wave[1]), 'Hz')}, {out['time']}"
    for side in family.sides:
        period = period_of(side)
        if side.argument.said == RATE:
            out[side.argument.name] = "how fast it changes"
        if period and side.argument.unit == "s":
            out[side.argument.name] = quantity(1.0 / period, "Hz")
        elif period:
            out[side.argument.name] = f"period {quantity(period, side.argument.unit)}"
    return out


def _percent(share: float) -> str:
    return f"{100.0 * min(max(share, 0.0), 1.0):.0f}"


def next_experiment(problem: Problem, proposal: Proposal) -> str:
    """The recording that would test a term, by its arguments."""
    names = [name for name in proposal.arguments if name != "recording"]
    if len(names) > 1:
        names = [name for name in names if name != "direction"]
    asked = [_RECORDINGS[name](problem) for name in names[:_MOST_PARTS] if name in _RECORDINGS]
    if "recording" in proposal.arguments or not asked:
        asked.insert(0, "the same recording twice in a row, with nothing changed between them")
    return f"To test it, record {'; and '.join(asked[:_MOST_PARTS])}."


def _lengths(problem: Problem) -> tuple[str, str, float, float, float]:
    """Units of length and speed, stroke, largest speed and longest recording, SI."""
    rows = problem.rows
    low, high = support(rows.y)
    unit, speed = ("rad", "rad/s") if problem.rotary else ("m", "m/s")
    return unit, speed, high - low, float(np.quantile(np.abs(rows.v), 0.99)), float(rows.t.max())


def _neat(value: float) -> float:
    """Rounded down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(max(value, 1e-12)))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9))


def _over_positions(problem: Problem) -> str:
    unit, speed, stroke, top, _ = _lengths(problem)
    slow, quick = quantity(_neat(top / 20.0), speed), quantity(_neat(top / 4.0), speed)
    return f"a slow move to and fro over the whole stroke of {quantity(stroke, unit, 2)}, at {slow} and at {quick}"


def _over_velocities(problem: Problem) -> str:
    unit, speed, stroke, top, _ = _lengths(problem)
    some = [quantity(share * _neat(top), speed) for share in (0.1, 0.25, 0.5, 1.0)]
    return f"moves to and fro over {quantity(stroke, unit, 2)} at constant speeds of {listed(some)}"


def _both_ways(problem: Problem) -> str:
    _, speed, _, top, _ = _lengths(problem)
    return f"the same move forth and back at {quantity(_neat(top / 4.0), speed)}"


def _over_forces(problem: Problem) -> str:
    if problem.rotary:
        return "the same move with an added inertia of about half the moving one"
    return f"the same move with an added mass of about {quantity(_neat(float(np.min(problem.mass)) / 2.0), 'kg')}"


def _over_accelerations(problem: Problem) -> str:
    top = float(np.quantile(np.abs(problem.rows.a), 0.98))
    unit = "rad/s²" if problem.rotary else "m/s²"
    some = [quantity(share * _neat(top), unit) for share in (0.2, 0.5, 1.0)]
    return f"the same move with accelerations of {listed(some)}"


def _over_travels(problem: Problem) -> str:
    unit, _, stroke, _, _ = _lengths(problem)
    ends = quantity(_neat(stroke / 500.0), unit), quantity(_neat(stroke / 8.0), unit)
    return f"small moves to and fro of growing amplitude, from {ends[0]} to {ends[1]}"


def _over_times_moved(problem: Problem) -> str:
    _, speed, _, top, _ = _lengths(problem)
    return f"moves to and fro at {quantity(_neat(top / 10.0), speed)} and at {quantity(_neat(top), speed)}"


def _over_rests(problem: Problem) -> str:
    return "starts after rests of 0.1, 1, 10 and 30 s"


def _over_time(problem: Problem) -> str:
    _, speed, _, top, longest = _lengths(problem)
    lasting = quantity(5.0 * math.ceil(3.0 * longest / 5.0), "s")
    quick = quantity(_neat(top / 4.0), speed)
    return f"{lasting} at rest and {lasting} of moves to and fro at {quick}, each begun at some other moment"


def _over_campaign(problem: Problem) -> str:
    return "the same recording again after half an hour"


_RECORDINGS = {
    "position": _over_positions,
    "velocity": _over_velocities,
    "direction": _both_ways,
    "motor_force": _over_forces,
    "acceleration": _over_accelerations,
    "travel": _over_travels,
    "since_reversal": _over_times_moved,
    "rest_time": _over_rests,
    "time": _over_time,
    "campaign_time": _over_campaign,
}
