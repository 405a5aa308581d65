"""Feasible recordings: motions within the stroke and speed of a campaign, with the inputs that the model asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.acceleration import Acceleration
from linid.physics.model import Model
from linid.recording.recording import Recording

_MARGIN = 0.08  # of the stroke, kept free at both ends
_LONGEST = 8.0  # s, of a planned recording
_REPEATED = 30.0  # s, of a run that warms the axis


@dataclass(frozen=True)
class Range:
    """What a campaign has shown to be feasible. low, high: m; speed: m/s; acceleration: m/s^2; period: s; pitch: pole
    pitch in m or None."""

    low: float
    high: float
    speed: float
    acceleration: float
    period: float
    pitch: float | None


@dataclass(frozen=True)
class Experiment:
    """A recording that could be made: what to do, in words, and the recording as the model foresees it."""

    words: str
    recording: Recording


def range_of(recordings: Sequence[Recording], v: Array, a: Array, field_wavenumber: float | None) -> Range:
    """The range of recordings whose measured speeds v (n,) m/s and accelerations a (n,) m/s^2 are given."""
    low = min(float(np.min(r.y)) for r in recordings)
    high = max(float(np.max(r.y)) for r in recordings)
    return Range(
        low + _MARGIN * (high - low),
        high - _MARGIN * (high - low),
        float(np.quantile(np.abs(v), 0.99)),
        float(np.quantile(np.abs(a), 0.98)),
        float(np.median([r.period for r in recordings])),
        None if field_wavenumber is None else np.pi / field_wavenumber,
    )


def experiments(model: Model, vector: Array, span: Range, like: Recording) -> tuple[Experiment, ...]:
    """Recordings that this axis can make, with inputs by the inverse of `model` (no effects) at vector (VECTOR_SIZE,).

    like: a driven recording of the campaign, for its axis and inputs; a free wheel where nothing drives the axis.
    """
    out = []
    for words, y in _motions(span, like):
        n = y.size
        bare = replace(
            like,
            name=words,
            t=span.period * np.arange(n, dtype=np.float64),
            y=y,
            v=None,
            split="held_out",
            added_mass=0.0,
            number=0,
            elapsed=0.0,
            repeat_of="",
            phase_currents=None if like.phase_currents is None else np.zeros((3, n)),
            drive_input=None if like.drive_input is None else np.zeros(n),
        )
        out.append(Experiment(words, _driven(model, vector, bare)))
    return tuple(out)


def _motions(span: Range, like: Recording) -> list[tuple[str, Array]]:
    """Motions in words and as positions (n,) in m."""
    unit, factor = ("rad", 1.0) if like.axis == "rotary" else ("mm", 1e3)
    stroke, middle = span.high - span.low, 0.5 * (span.low + span.high)
    top = min(span.speed, np.sqrt(0.5 * span.acceleration * stroke))
    slow = max(2.0 * stroke / _LONGEST, 0.01 * top)
    out = [
        (
            f"one slow move to and fro over the whole stroke at {factor * slow:.2g} {unit}/s",
            _moves(span, [span.low, span.high, span.low], slow),
        ),
        (
            f"moves over the whole stroke at {factor * top:.2g} {unit}/s with rests between",
            _moves(span, [span.low, span.high] * 3, top),
        ),
        (
            f"moves to and fro at {factor * 0.3 * top:.2g} {unit}/s over the middle of the stroke",
            _moves(span, [middle - 0.2 * stroke, middle + 0.2 * stroke] * 3, 0.3 * top),
        ),
        (
            f"short quick moves of {factor * 0.05 * stroke:.2g} {unit} at many places",
            _moves(span, _stairs(span, 0.05 * stroke), top),
        ),
    ]
    creep = 0.2 * span.pitch if span.pitch is not None else 0.01 * stroke
    out.append(
        (
            f"slow reversals: a sine of {factor * creep:.2g} {unit} at 1 Hz in the middle of the stroke",
            _sine(span, middle, creep, 1.0, 6.0),
        )
    )
    swing = min(0.1 * stroke, span.speed / (2.0 * np.pi * 5.0))
    out.append(
        (
            f"quick reversals: a sine of {factor * swing:.2g} {unit} at 5 Hz in the middle of the stroke",
            _sine(span, middle, swing, 5.0, 4.0),
        )
    )
    rounds = max(2, int(_REPEATED / max(_moves(span, [span.low, span.high], top).size * span.period, 0.1)))
    out.append(
        (
            f"the same moves over the whole stroke for {_REPEATED:.0f} s without a pause, from cold",
            _moves(span, [span.low, span.high] * min(rounds, 40), top),
        )
    )
    return out


def _stairs(span: Range, step: float) -> list[float]:
    places = np.arange(span.low, span.high, step)
    return [*places.tolist(), *places[::-1].tolist()]


def _moves(span: Range, places: Sequence[float], speed: float) -> Array:
    """Positions of point-to-point moves (quintic, at most `speed` and the range's acceleration) with short rests."""
    pieces = []
    for start, end in pairwise(places):
        length = abs(end - start)
        # A quintic's largest speed is 1.875 length/duration, its largest acceleration 5.77 length/duration^2.
        duration = max(1.875 * length / speed, np.sqrt(5.77 * length / span.acceleration), 10.0 * span.period)
        tau = np.arange(round(duration / span.period)) * span.period / duration
        pieces.append(start + (end - start) * tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2))
        pieces.append(np.full(max(round(0.1 / span.period), 10), end))
    return np.concatenate(pieces)


def _sine(span: Range, middle: float, amplitude: float, frequency: float, duration: float) -> Array:
    t = span.period * np.arange(round(duration / span.period))
    return np.asarray(middle + amplitude * np.sin(2.0 * np.pi * frequency * t))


def _driven(model: Model, vector: Array, bare: Recording) -> Recording:
    """The recording with the smallest inputs under which the model would move like that."""
    base = Acceleration(model, (bare,), 1)
    dt = bare.duration / (bare.y.size - 1)
    wanted = np.gradient(np.gradient(bare.y, dt), dt)

    def along(recording: Recording) -> Array:
        part = Acceleration(model, (recording,), 1, half_widths=base.half_widths)
        start_w = np.full((1, 1), np.nan)
        motion = part.motion
        return np.asarray(
            part.simulator.along(vector[None, :], motion.y, motion.v, motion.standstill, start_w).acceleration[0]
        )

    if bare.phase_currents is None and bare.drive_input is None:
        return bare
    plain = along(bare)
    if bare.phase_currents is not None:
        unit = np.eye(3)[:, :, None] * np.ones(bare.y.size)
        gains = np.array([along(replace(bare, phase_currents=one)) - plain for one in unit])
        gains -= gains.mean(axis=0)  # currents that sum to zero
        return replace(bare, phase_currents=gains * ((wanted - plain) / np.maximum(np.sum(gains**2, axis=0), 1e-300)))
    gain = along(replace(bare, drive_input=np.ones(bare.y.size))) - plain
    return replace(bare, drive_input=(wanted - plain) / np.where(np.abs(gain) > 1e-12, gain, np.inf))
