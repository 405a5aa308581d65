"""The periodogram of a residual over position: which periods of a reading error could explain it.

An error e(y) of the reading shows as its second difference in time, smoothed like the measured acceleration. Its
moment with a residual is that of e itself with the residual sent back through the same steps, so that one fast
Fourier transform over position gives the moments of all periods at once (a periodogram by least squares: Lomb 1976,
Astrophys. Space Sci. 39, 447).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from linid.arrays import Array
from linid.identification.objectives.acceleration import Acceleration, bump

_PER_PERIOD = 12  # bins of position per shortest period
_MOST_BINS = 1 << 22
_PER_PEAK = 8  # wavenumbers per width of a peak, at least: a second harmonic is off its peak by an eighth at most
_SPEEDS = 64  # classes of speed in which the columns' lengths are summed
_LENGTHS = 400  # wavenumbers at which they are


def likely_periods(
    part: Acceleration, rest: Array, weights: Array, longest: float, shortest: float, count: int
) -> tuple[float, ...]:
    """The `count` periods in m (rotary: rad) whose sines in the reading explain most, the likeliest first.

    A second harmonic counts no more than its fundamental: twice a period has the same wave as its own second harmonic,
    and would explain no less by chance.
    part: the rows of the balance; rest, weights: (N,) weighted residual and the weights in it; longest, shortest: of
    the periods, m.
    """
    y = part.motion.y
    low, stroke = float(np.min(y)), max(float(np.ptp(y)), 1e-12)
    width = max(shortest / _PER_PERIOD, _PER_PEAK * stroke / _MOST_BINS)
    bins = ((y - low) / width).astype(np.int64)
    size = 1 << int(np.ceil(np.log2(_PER_PEAK * (int(bins.max()) + 1))))
    spectrum = np.abs(np.fft.rfft(np.bincount(bins, part.stencils.sent_back(rest * weights, y.size)), size)) ** 2
    wavenumbers = 2.0 * np.pi * np.arange(spectrum.size) / (size * width)
    wanted = np.flatnonzero((wavenumbers >= 2.0 * np.pi / longest) & (wavenumbers <= 2.0 * np.pi / shortest))
    wavenumbers, spectrum = wavenumbers[wanted], spectrum[wanted]
    if wavenumbers.size < 3:
        return ()
    coarse = np.geomspace(wavenumbers[0], wavenumbers[-1], _LENGTHS)
    lengths = np.exp(np.interp(np.log(wavenumbers), np.log(coarse), np.log(_lengths(part, weights, coarse))))
    power = spectrum / lengths
    second = 2 * wanted[: np.count_nonzero(2 * wanted <= wanted[-1])] - wanted[0]  # places of the second harmonics
    power[: second.size] += np.minimum(power[: second.size], power[second])
    peaks = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] > power[2:])) + 1
    best = peaks[np.argsort(-power[peaks])][:count]
    return tuple((2.0 * np.pi / wavenumbers[best]).tolist())


@lru_cache(maxsize=64)  # a diagnosis asks for those of the same recordings at each step
def _answers(half: int, dt: float, fastest: float, wavenumbers: tuple[float, ...]) -> tuple[Array, Array]:
    """How a bump and second differences answer unit sines of wavenumbers (k) in rad/m, by classes of speed up to
    the fastest, (k, s) each, squared. half: width of the bump in samples; dt: s."""
    edges = np.linspace(0.0, fastest, _SPEEDS + 1)
    phase = np.array(wavenumbers)[:, None] * (0.5 * (edges[1:] + edges[:-1]) * dt)
    kernel = bump(half)
    gain = kernel[half] + 2.0 * sum(kernel[half + n] * np.cos(n * phase) for n in range(1, half + 1))
    bend = (2.0 - 2.0 * np.cos(phase)) / dt**2
    return np.asarray(gain**2), np.asarray(bend**2)


def _lengths(part: Acceleration, weights: Array, wavenumbers: Array) -> Array:
    """Squared lengths (k,) of the columns of unit sines, as if the axis ran evenly within each kernel."""
    speed = np.abs(part.motion.v[part.rows])
    acceleration = part.target**2
    out = np.full(wavenumbers.size, 1e-300)
    for index, half in enumerate(part.half_widths):
        mine = part.classes == index
        dt = float(part.simulator.inputs.dts[index])
        edges = np.linspace(0.0, float(np.max(speed[mine], initial=1e-9)) * (1.0 + 1e-9), _SPEEDS + 1)
        place = np.digitize(speed[mine], edges) - 1
        gain, bend = _answers(half, dt, float(edges[-1]), tuple(wavenumbers.tolist()))
        squares = weights[mine] ** 2
        count = np.bincount(place, squares, _SPEEDS)[:_SPEEDS]
        turning = np.bincount(place, squares * acceleration[mine], _SPEEDS)[:_SPEEDS]
        out += 0.5 * np.sum(gain * (bend * count + wavenumbers[:, None] ** 2 * turning), axis=1)
    return out
