"""What the checks of recordings amount to: sentences with their number and a remedy, and who differs from all "
"others."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from linid.recording.check_field import Commutation
from linid.recording.check_input import Coherence, Delay, Saturation
from linid.recording.check_position import Angle, EndStop, Resolution
from linid.recording.recording import Axis, Kind, Reading, Split

Level = Literal["note", "warning"]

FOLLOWS = 0.7  # coherence; below, what the input does not explain is worth half of what it does
_OPPOSITE = -0.3  # correlation of input and acceleration: resonances alone reach 0.4, a wrong sign -0.4 and less
_LATE = 1.0  # samples; less is within a sampling interval
_CERTAIN = 3.0  # deviations
_CLIPPED, _RAMPED = 0.005, 0.02  # of the time; constant rates are common demands
_JITTER, _WILD = 0.01, 0.2  # of the period: resampled, and no longer worth resampling
_MISSING, _CUT = 0.01, 0.1  # of the samples
_SLOW, _HIDDEN, _HELD = 0.5, 0.3, 0.1  # shares, see `Resolution`
_SPEED = {"linear": 20.0, "rotary": 3000.0}  # m/s, rad/s (29 000 per minute)
_STROKE = {"linear": 50.0, "rotary": math.inf}  # m
_POLES = 0.02  # by which a number of pole pairs may miss a whole one
_OTHERS = 3  # recordings, to speak of all others
_MAJORITY = 2.0 / 3.0


@dataclass(frozen=True)
class Finding:
    """One thing to know about a recording ('' for the campaign): which check, how grave, a sentence with its remedy."""

    recording: str
    check: str
    level: Level
    text: str


@dataclass(frozen=True)
class RecordingChecks:
    """All checks of one recording in plain numbers, SI units, nan where not to be had.

    samples; period, duration: s; phased: whether its input is phase currents, whose sign is open.
    """

    name: str
    axis: Axis
    kind: Kind
    split: Split
    samples: int
    period: float
    duration: float
    phased: bool
    reading: Reading
    coherence: Coherence
    delay: Delay
    saturation: Saturation
    resolution: Resolution
    angle: Angle
    commutation: Commutation
    end_stop: EndStop
    findings: tuple[Finding, ...] = ()


def findings_of(checks: RecordingChecks) -> tuple[Finding, ...]:
    """What is worth saying about one recording by itself."""
    parts = (_clock, _follows, _late, _saturated, _resolved, _unit, _stopped)
    return tuple(
        Finding(checks.name, check, level, text) for part in parts for check, level, text in part(checks) if text
    )


Said = list[tuple[str, Level, str]]


def _clock(c: RecordingChecks) -> Said:
    return clock_findings(c.samples, c.reading)


def clock_findings(samples: int, r: Reading) -> Said:
    """(check, level, text) of what reading a file left out, filled or made regular; samples: that are left."""
    said = Said()
    total = max(samples + r.cut, 1)
    if r.jitter > _JITTER and r.resampled:
        said.append(
            (
                "clock",
                "warning" if r.jitter > _WILD else "note",
                f"its time stamps scatter by {100 * r.jitter:.2g} % of the period and were put on a regular grid; if "
                "the drive "
                "samples regularly, give its `period:`",
            )
        )
    if r.gaps:
        share = r.missing / total
        said.append(
            (
                "gaps",
                "warning" if share > _MISSING else "note",
                f"{r.missing} samples ({100 * share:.2g} %) are missing in {r.gaps} gap{'s' * (r.gaps > 1)}, the "
                "longest of "
                f"{r.longest_gap:.3g} s; record to the drive's memory, or choose a `window:` without them",
            )
        )
    if r.cut:
        said.append(
            (
                "cut",
                "warning" if r.cut > _CUT * total else "note",
                f"{r.cut} of {total} samples were cut off (long gaps, or channels that end early); choose a `window:`",
            )
        )
    if r.filled or r.left_out:
        said.append(
            (
                "repaired",
                "note",
                f"{r.filled} unreadable cells were interpolated and {r.left_out} rows with a bad time stamp left "
                "out; repair "
                "the export if that is more than you expect",
            )
        )
    return said


def _follows(c: RecordingChecks) -> Said:
    k = c.coherence
    if not k.judged:
        return []
    band = f"between {k.low:.3g} and {k.high:.3g} Hz"
    if k.value < FOLLOWS:
        return [
            (
                "coherence",
                "warning",
                f"only {k.value:.2f} of the acceleration's power {band} follows the input: something else "
                "than the input "
                "moves this axis (gravity, another drive, a hand), or the channels do not belong together; log what "
                "acts, or "
                "leave this recording out",
            )
        ]
    if not c.phased and k.correlation < _OPPOSITE and k.work < 0.0:
        return [
            (
                "sign",
                "warning",
                f"acceleration and input are opposed {band} (correlation {k.correlation:.2f}): give one of "
                "them the other "
                "sign by `scale: -1` in `channels:`",
            )
        ]
    return []


def _late(c: RecordingChecks) -> Said:
    d = c.delay
    if not d.sharp or abs(d.seconds) < max(_LATE * c.period, _CERTAIN * d.deviation):
        return []
    size = f"{1e3 * abs(d.seconds):.3g} +- {1e3 * d.deviation:.1g} ms ({abs(d.seconds) / c.period:.2g} samples)"
    if d.seconds > 0.0:
        return [("shift", "note", f"the acceleration comes {size} after the input; try the effect input_delay")]
    return [
        (
            "shift",
            "warning",
            f"the acceleration comes {size} before the input: here the input answers the motion (a "
            "controller that fights "
            "cogging, say), or the channels have different clocks; add a recording in which the input moves the axis",
        )
    ]


def _saturated(c: RecordingChecks) -> Said:
    s, said = c.saturation, Said()
    if s.share > _CLIPPED:
        said.append(
            (
                "saturation",
                "note",
                f"the input rests at its extreme ({s.level:.3g}) for {100 * s.share:.2g} % of the time: if that is a "
                "limit and not the demand, move more gently",
            )
        )
    if s.rate_share > _RAMPED:
        said.append(
            (
                "rate",
                "note",
                f"the input changes at its highest rate ({s.rate:.3g} per s) for {100 * s.rate_share:.2g} % of the "
                "time: a limit if no ramp was asked for",
            )
        )
    return said


def _resolved(c: RecordingChecks) -> Said:
    r, said = c.resolution, Said()
    unit = "rad" if c.axis == "rotary" else "m"
    if r.floor > _HIDDEN * r.acceleration:
        said.append(
            (
                "resolution",
                "note",
                f"the encoder's noise ({r.noise:.2g} {unit}, its step {r.step:.2g}) leaves {r.floor:.2g} "
                f"{unit}/s^2 of the "
                f"{r.acceleration:.2g} that the acceleration shows: only slower or stronger motion tells more",
            )
        )
    elif r.slow > _SLOW:
        said.append(
            (
                "resolution",
                "note",
                f"for {100 * r.slow:.0f} % of the moving time it moves less than a step ({r.step:.2g} "
                f"{unit}) per sample: "
                f"accelerations below {r.floor:.2g} {unit}/s^2 cannot be seen; log more slowly, or move faster",
            )
        )
    if r.held > _HELD:
        said.append(
            (
                "held",
                "warning",
                f"{100 * r.held:.0f} % of the samples in clear motion repeat the position before: it is updated more "
                "slowly than it is logged; log at the encoder's rate",
            )
        )
    return said


def _unit(c: RecordingChecks) -> Said:
    a, said = c.angle, Said()
    unit = "rad" if c.axis == "rotary" else "m"
    if a.jumps:
        wrap = a.equal and a.jumps > 1
        what = "all alike: a wrap is left in it" if wrap else "a set position, a wrap, or lost counts?"
        turn = f" ({a.jump / (2.0 * math.pi):.3g} turns)" if c.axis == "rotary" else ""
        said.append(
            (
                "jumps",
                "warning",
                f"the position jumps {a.jumps} time{'s' * (a.jumps > 1)} by about {a.jump:.4g} {unit}{turn}, {what}; "
                "export the "
                "unwrapped position, or cut with `window:`",
            )
        )
    if c.reading.wraps:
        said.append(
            (
                "wraps",
                "note",
                f"the position wrapped {c.reading.wraps} times at {c.reading.wrap:.4g} {unit} and was made "
                "continuous; check that "
                "it is the mechanical position and not the electrical angle",
            )
        )
    if a.whole or a.speed > _SPEED[c.axis] or a.stroke > _STROKE[c.axis]:
        why = f"all positions are whole numbers of {unit}" if a.whole else f"a speed of {a.speed:.3g} {unit}/s"
        if a.stroke > _STROKE[c.axis] and not a.whole:
            why = f"a stroke of {a.stroke:.3g} {unit}"
        said.append(("unit", "warning", f"{why}: counts or another unit? Check `unit:` and `scale:` of the position"))
    pairs = c.commutation.wavenumber
    if c.axis == "rotary" and math.isfinite(pairs):
        whole = round(pairs)
        if abs(pairs - whole) > _POLES * max(whole, 1):
            said.append(
                (
                    "pole pairs",
                    "warning",
                    f"the currents turn {pairs:.4g} times per turn of the position, and a motor has a whole "
                    "number of pole "
                    "pairs: check unit and gear of the position",
                )
            )
        elif whole == 1:
            said.append(
                (
                    "pole pairs",
                    "note",
                    "the currents turn once per turn of the position: the electrical angle, unless the motor has one "
                    "pole pair",
                )
            )
    return said


def _stopped(c: RecordingChecks) -> Said:
    if not c.end_stop.side:
        return []
    side = "largest" if c.end_stop.side > 0 else "smallest"
    return [
        (
            "end stop",
            "warning",
            f"it stands at its {side} position for {c.end_stop.seconds:.2g} s while the input pushes it further: an "
            "end stop? "
            "Cut it off with `window:`",
        )
    ]


def compared(all_checks: Sequence[RecordingChecks]) -> tuple[Finding, ...]:
    """Recordings that differ from nearly all others of the campaign, in what should be one axis and one drive."""
    found: list[Finding] = []
    found += _odd(all_checks, "period", "note", lambda c: c.period, 0.1, "sampled every {} s, the others every {} s")
    found += _odd(
        all_checks,
        "resolution",
        "note",
        lambda c: c.resolution.step or math.nan,
        0.5,
        "its position is resolved to {}, the others' to {}: the same encoder and unit?",
    )
    found += _odd(
        all_checks,
        "field",
        "warning",
        lambda c: c.commutation.wavenumber * c.commutation.sense,
        0.01,
        "its currents turn by {} rad per unit of position, the others' by {}: other unit, sign or order of phases?",
    )
    signs = [c for c in all_checks if not c.phased and c.coherence.judged and abs(c.coherence.correlation) > -_OPPOSITE]
    signs = [c for c in signs if c.coherence.value > FOLLOWS]
    found += _odd(
        signs,
        "sign",
        "warning",
        lambda c: math.copysign(1.0, c.coherence.correlation),
        0.01,
        "input and acceleration go together with the sign {}, in the others with {}: another sign of one channel?",
    )
    judged = sorted((c for c in all_checks if c.coherence.judged), key=lambda c: c.coherence.value)
    for place, c in enumerate(judged):
        others = [o.coherence.value for k, o in enumerate(judged) if k != place]
        if len(others) < _OTHERS - 1 or min(others[place:], default=0.0) < FOLLOWS or place > len(judged) / 3.0:
            continue
        if c.coherence.value < FOLLOWS:
            found.append(
                Finding(
                    c.name,
                    "coherence",
                    "warning",
                    f"{c.coherence.value:.2f} of its acceleration follows the input, in the others "
                    f"{min(others[place:]):.2f} and "
                    "more: leave it out, or log what else acts there",
                )
            )
    return tuple(found)


def _odd(
    all_checks: Sequence[RecordingChecks],
    check: str,
    level: Level,
    value: Callable[[RecordingChecks], float],
    apart: float,
    text: str,
) -> list[Finding]:
    """Findings on those whose value is `apart` (as a share) from the one that two thirds or more have."""
    known = [(c, value(c)) for c in all_checks if math.isfinite(value(c))]
    if len(known) < _OTHERS:
        return []

    def like(x: float, usual: float) -> bool:
        return abs(x - usual) <= apart * abs(usual)

    usual = max((x for _, x in known), key=lambda x: sum(like(other, x) for _, other in known))
    odd = [(c, x) for c, x in known if not like(x, usual)]
    if len(odd) > (1.0 - _MAJORITY) * len(known):
        return []
    return [Finding(c.name, check, level, text.format(f"{x:.4g}", f"{usual:.4g}")) for c, x in odd]
