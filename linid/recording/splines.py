"""Cubic splines of sampled signals: coefficients for the simulation, and resampling on a regular grid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.errors import DataError
from linid.recording.recording import Recording
from linid.recording.timebase import FEWEST_OF_SPLINE, GAP, ROUNDING, jitter

_JITTER = 0.01  # of a period: less is taken for regular
_LONGEST_GAP = 10.5  # periods; a spline across more than that invents motion
_LATE = 0.5  # of a period: so short a step follows a stamp that came late
_SAME_RATE = 1e-3  # by which the mean step may differ from the usual one if no sample is missing
_UNEVEN = 3.0  # times the usual step, or its third: beside it a spline overshoots
_BESIDE = 9  # steps, centred on it


def cubic_spline_coefficients(dt: float, samples: Array) -> Array:
    """Not-a-knot cubic splines through samples on a regular grid.

    dt: period in s; samples: (c, n) finite channels, n >= 2. Returns (c, n - 1, 4): value at t_k + s is sum_p
    coefficients[c, k, p] s^p with s in s. Raises DataError for fewer than two samples. Source: de Boor 1978, A
    Practical Guide to Splines, ch. IV; scipy.interpolate has it too, but takes longer to load than most fits.
    """
    samples = np.atleast_2d(np.asarray(samples, dtype=np.float64))
    count = samples.shape[1]
    if count < 2:
        raise DataError("cubic spline", f"found {count} samples, expected at least 2", "Use a longer recording.")
    out = np.empty((samples.shape[0], count - 1, 4))
    if count >= FEWEST_OF_SPLINE:
        from linid.recording.spline_kernel import fill_not_a_knot  # late: it loads the compiler

        fill_not_a_knot(float(dt), np.ascontiguousarray(samples), out)
        return out
    chord = np.diff(samples, axis=1) / dt  # a line, or a parabola
    bend = np.diff(chord, axis=1).sum(axis=1, keepdims=True) / 2.0
    out[:, :, 0], out[:, :, 1] = samples[:, :-1], chord - bend
    out[:, :, 2], out[:, :, 3] = bend / dt, 0.0
    return out


def to_uniform(recording: Recording) -> Recording:
    """The recording on a regular grid: unchanged when jitter is below 1 % and no sample is missing.

    Otherwise resampled by cubic spline with a note. At a gap of more than ten periods the recording is cut there and
    its longest gap-free part kept, with a note: a spline across it would invent motion. Raises DataError where fewer
    than four samples are left.
    """
    t = recording.t
    if len(t) < FEWEST_OF_SPLINE:
        raise DataError(
            str(recording.source or recording.name), f"found {len(t)} samples, expected at least 4", "Record longer."
        )
    notes: list[str] = []
    step = np.diff(t)
    period = float(np.median(step))
    cuts = np.flatnonzero(step > _LONGEST_GAP * period)
    part = slice(0, len(t))
    if len(cuts):
        edges = np.concatenate(([0], cuts + 1, [len(t)]))
        k = int(np.argmax(np.diff(edges)))
        part = slice(int(edges[k]), int(edges[k + 1]))
        kept = part.stop - part.start
        if kept < FEWEST_OF_SPLINE:
            raise DataError(
                str(recording.source or recording.name),
                "no gap-free part of at least 4 samples",
                "The time stamps are broken: give `period:` in the mapping, or record again.",
            )
        s = "s" * (len(cuts) > 1)
        notes.append(
            f"{len(cuts)} gap{s} of more than 10 periods: only the longest gap-free part is used "
            f"({t[part.start]:.6g} to {t[part.stop - 1]:.6g} s, {kept} of {len(t)} samples; "
            "choose another by `window:`)"
        )
        recording = _sliced(recording, part)
        recording = _read(recording, cut=len(t) - kept)
        t = recording.t
        period = float(np.median(np.diff(t)))
    irregular = jitter(t)
    if irregular <= _JITTER and float(np.diff(t).max()) < GAP * period:
        return replace(recording, notes=(*recording.notes, *notes)) if notes else recording
    n = int(np.floor((t[-1] - t[0]) / period + 1e-9)) + 1
    grid = t[0] + period * np.arange(n)
    grid[-1] = min(grid[-1], t[-1])
    note = f"resampled to a regular {period:.6g} s by cubic spline (jitter {100 * irregular:.2g} % of the period)"
    mean = float(t[-1] - t[0]) / (len(t) - 1)
    if float(np.diff(t).min()) < _LATE * period and abs(mean / period - 1.0) < _SAME_RATE:
        note += (
            "; as many samples as a regular clock would give: if the drive sampled regularly and only the stamps came "
            f"late, set `period: {period:.6g}`"
        )
    notes.append(note)
    return _read(_resampled(recording, grid, tuple(notes)), resampled=True)


def _read(recording: Recording, cut: int = 0, resampled: bool = False) -> Recording:
    """The recording with what was done to it added to the facts of its reading."""
    facts = recording.reading
    if facts is None:
        return recording
    return replace(recording, reading=replace(facts, cut=facts.cut + cut, resampled=facts.resampled or resampled))


def trim(recording: Recording, t0: float, t1: float) -> Recording:
    """The samples with t0 <= t <= t1 (s); the cut is noted, time keeps its origin. Raises DataError where fewer than
    two are left.
    """
    keep = np.flatnonzero((recording.t >= t0 - ROUNDING) & (recording.t <= t1 + ROUNDING))
    if len(keep) < 2:
        raise DataError(
            str(recording.source or recording.name),
            f"found {len(keep)} samples between {t0:g} and {t1:g} s",
            f"Choose times inside [{recording.t[0]:g}, {recording.t[-1]:g}] s.",
        )
    if len(keep) == len(recording.t):
        return recording
    cut = _sliced(recording, slice(int(keep[0]), int(keep[-1]) + 1))
    note = f"trimmed to {cut.t[0]:.6g} to {cut.t[-1]:.6g} s ({len(keep)} of {len(recording.t)} samples)"
    return replace(cut, notes=(*cut.notes, note))


def _sliced(recording: Recording, part: slice) -> Recording:
    def cut(x: Array | None) -> Array | None:
        return None if x is None else x[..., part].copy()

    return replace(
        recording,
        t=recording.t[part].copy(),
        y=recording.y[part].copy(),
        v=cut(recording.v),
        reference=cut(recording.reference),
        simulated=cut(recording.simulated),
        phase_currents=cut(recording.phase_currents),
        phase_voltages=cut(recording.phase_voltages),
        drive_input=cut(recording.drive_input),
    )


def _resampled(recording: Recording, grid: Array, notes: tuple[str, ...]) -> Recording:
    from scipy.interpolate import CubicSpline, PchipInterpolator

    t = recording.t
    # Beside very uneven steps (late time stamps, missing samples) a spline overshoots: shape-preserving there.
    step = np.diff(t)
    usual = np.median(step)
    uneven = (step > _UNEVEN * usual) | (step < usual / _UNEVEN)
    near = np.convolve(uneven, np.ones(_BESIDE), mode="same") > 0
    rough = near[np.clip(np.searchsorted(t, grid, side="right") - 1, 0, len(step) - 1)]

    def at_grid(x: Array | None) -> Array | None:
        if x is None or np.isnan(x).all():  # of an unmeasured position
            return None if x is None else np.full(grid.size, np.nan)
        smooth = CubicSpline(t, x, axis=-1)(grid)
        careful = PchipInterpolator(t, x, axis=-1)(grid) if rough.any() else smooth
        return np.asarray(np.where(rough, careful, smooth), dtype=np.float64)

    y = at_grid(recording.y)
    assert y is not None
    return replace(
        recording,
        t=grid,
        y=y,
        v=at_grid(recording.v),
        reference=at_grid(recording.reference),
        simulated=at_grid(recording.simulated),
        phase_currents=at_grid(recording.phase_currents),
        phase_voltages=at_grid(recording.phase_voltages),
        drive_input=at_grid(recording.drive_input),
        notes=(*recording.notes, *notes),
    )
