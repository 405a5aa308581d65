"""What noise of the logged phase currents does to predictions from the measured state, and the residuals freed of it.

The machine moved by the true currents, the model by the logged ones. White noise in these pushes the model by dF/di
along the motion; the axis adds that up to an error of its position that grows along each window. Residuals whose
covariance this is are whitened: each then tells as much as it knows. What the noise still adds to their sum of squares
hangs on the parameters and is known, too (errors in variables: Fuller 1987, Measurement Error Models).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linid.arrays import Array
from linid.identification.objectives.ahead import Ahead
from linid.identification.objectives.noisy import under_noise
from linid.identification.objectives.objective import Directions
from linid.identification.signals.error_dynamics import bristle_along, position_answers
from linid.identification.signals.motion import current_noise, with_inputs_moved
from linid.identification.space.search_space import SearchSpace
from linid.physics.model import MASS
from linid.recording.noise import white_level
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator

_MOST_ROWS = 128  # of a window: at higher sampling rates means of neighbours tell all
_CHUNK = 200  # windows whose answers are held at once
_PAIRS = 3  # of opposite draws of the noise
_LINEAR = 1.1  # times its expected deviation a window may have from nonlinear answers
_FEWEST = 1000  # residuals that tell a variance to a twentieth
_OFF = 1.25  # factor by which the noise may differ from what the currents' own differences say
_STEP = 1e-5  # of a search coordinate
_LEAST = 1e-9  # of the largest variance of a window: what arithmetic leaves of it


@dataclass(frozen=True)
class Whitening:
    """filters: by window length n, (W, r, n): from residuals in m to such of unit variance; powers: as long, (W, n):
    sum of squares that an acceleration of 1 m/s^2 at one sample leaves in them; linear: (windows,) of all, which the
    noise moves as linear dynamics tell."""

    filters: dict[int, Array]
    powers: dict[int, Array]
    linear: NDArray[np.bool_]


@dataclass
class WhitenedAhead(Ahead):
    """Predictions ahead whose residuals are in standard deviations of what noise of encoder and currents explains.

    white: of the same windows.
    """

    white: Whitening | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        assert self.white is not None
        rows = {n: filters.shape[1] for n, filters in self.white.filters.items()}
        sizes = np.array([rows[int(n)] for n in self.segments.count])
        first = self.segments.out_offsets[:-1]
        self.classes = np.repeat(self.classes[first], sizes)
        self.groups = np.repeat(np.arange(sizes.size, dtype=np.int64), sizes)
        self.edges = np.concatenate([[0], np.cumsum(sizes)])
        same = self.segments.count.size == sum(len(filters) for filters in self.white.filters.values())
        self.signal = self.whiten(self.signal[None])[0] if same else np.ones(self.classes.size)
        self.floor = 1e-9

    def residuals(self, params: Array, offsets: Array) -> Array:
        """(C, N) whitened prediction errors, dimensionless. params: (C, VECTOR_SIZE); offsets: (C, 0)."""
        return self.whiten(super().residuals(params, offsets))

    def slopes(self, params: Array, offsets: Array, directions: Directions) -> tuple[Array, Array]:
        """Whitened residuals (N,) and derivatives (N, K), dimensionless. params: (VECTOR_SIZE,); offsets: (0,)."""
        errors, slopes = super().slopes(params, offsets, directions)
        return self.whiten(errors[None])[0], self.whiten(slopes.T).T

    def whiten(self, errors: Array) -> Array:
        """Errors (C, samples) in m of all windows, whitened (C, N)."""
        assert self.white is not None
        out = np.empty((errors.shape[0], int(self.edges[-1])))
        for n, filters in self.white.filters.items():
            windows = np.flatnonzero(self.segments.count == n)
            source = self.segments.out_offsets[windows][:, None] + np.arange(n)
            target = self.edges[windows][:, None] + np.arange(filters.shape[1])
            for row, into in zip(errors, out, strict=True):
                into[target] = np.einsum("wrn,wn->wr", filters, row[source])
        return out


class CurrentPush:
    """Acceleration in m/s^2 along the measured motion by one standard deviation of noise in each phase current."""

    def __init__(self, part: Ahead) -> None:
        self.part = part
        self.levels = [current_noise(r) for r in part.recordings]
        moved = [part.recordings]
        for phase in range(3):
            kick = np.eye(3)[phase]
            moved.append(
                tuple(
                    with_inputs_moved(r, np.outer(kick * level, np.ones(r.y.size)))
                    for r, level in zip(part.recordings, self.levels, strict=True)
                )
            )
        self.simulators = [Simulator(part.model, pack_inputs(rs), 1, part.jobs) for rs in moved]

    def __call__(self, params: Array) -> Array:
        """(C, 3, samples) of all recordings; params: (C, VECTOR_SIZE)."""
        motion = self.part.motion
        start_w = np.full((params.shape[0], len(self.part.recordings)), np.nan)
        moving = np.zeros_like(motion.standstill)  # where the axis rests, its bristle would take the push up
        plain, *moved = (
            simulator.along(params, motion.y, motion.v, moving, start_w).acceleration for simulator in self.simulators
        )
        return np.stack([one - plain for one in moved], axis=1)


def whitening(part: Ahead, vector: Array, push: Array) -> Whitening:
    """The whitening of a part's windows. vector: (VECTOR_SIZE,) near the truth; push: (3, samples) m/s^2, of
    `CurrentPush` there."""
    motion, segments = part.motion, part.segments
    start_w = np.full((1, len(part.recordings)), np.nan)
    along = part.simulator.along(vector[None], motion.y, motion.v, motion.standstill, start_w, without="acceleration")
    masses = vector[MASS] + np.array([r.added_mass for r in part.recordings])
    variance = np.sum(push**2, axis=0)
    filters, powers = {}, {}
    for n in np.unique(segments.count):
        windows = np.flatnonzero(segments.count == n)
        pieces = [
            _of_windows(part, vector, windows[a : a + _CHUNK], variance, along.bristle[0], masses)
            for a in range(0, windows.size, _CHUNK)
        ]
        filters[int(n)] = np.concatenate([piece[0] for piece in pieces])
        powers[int(n)] = np.concatenate([piece[1] for piece in pieces])
    return Whitening(filters, powers, np.ones(segments.count.size, dtype=np.bool_))


def _of_windows(
    part: Ahead, vector: Array, windows: NDArray[np.int64], variance: Array, w: Array, masses: Array
) -> tuple[Array, Array]:
    """Filters (W, r, n) and powers (W, n) of some windows of equal length."""
    n = int(part.segments.count[windows[0]])
    owner = part.segments.recording[windows]
    bins = -(-n // _MOST_ROWS)
    size = n // bins
    samples = part.flat_first[windows][:, None] + np.arange(size * bins)
    means = samples.reshape(windows.size, size, bins)
    mass, dt = masses[owner], part.simulator.inputs.dts[owner[0]]
    bristle = bristle_along(vector, part.motion.v[means].mean(axis=2), w[means].mean(axis=2), mass)
    answers = position_answers(bristle, dt * bins)
    projected = _without_line(size)
    answers = projected @ answers
    pushed = variance[means].mean(axis=2) / bins
    covariance = (answers * pushed[:, None, :]) @ answers.transpose(0, 2, 1)
    noise = np.array([white_level(r.y) for r in part.recordings])[owner] ** 2 / bins
    covariance += noise[:, None, None] * np.eye(size - 2)
    largest = np.einsum("wii->w", covariance)
    covariance += (_LEAST * largest)[:, None, None] * np.eye(size - 2)
    inverse = np.linalg.inv(np.linalg.cholesky(covariance))
    powers = np.sum((inverse @ answers) ** 2, axis=1)
    filters = np.zeros((windows.size, size - 2, n))
    filters[:, :, : size * bins] = np.repeat(inverse @ projected, bins, axis=2) / bins
    full = np.zeros((windows.size, n))
    full[:, : size * bins] = np.repeat(powers, bins, axis=1) / bins**2
    return filters, full


def _without_line(n: int) -> Array:
    """Orthonormal rows (n - 2, n) that no straight line has a part in."""
    line = np.column_stack([np.ones(n), np.arange(n, dtype=np.float64)])
    return np.asarray(np.linalg.qr(line, mode="complete")[0][:, 2:].T)


def whitened(part: Ahead, vector: Array, push: Array, generator: np.random.Generator) -> WhitenedAhead:
    """The part with its residuals whitened as they are near the truth; arguments as of `whitening`.

    Where an axis sticks or reverses, noise makes it creep, which no linear dynamics tells: draws of the noise and their
    opposites do not cancel there. Such a window counts the less the more that shows.
    """
    white = whitening(part, vector, push)
    plain = WhitenedAhead(**_settings_of(part), white=white)
    none = np.zeros((1, 0))
    before = plain.residuals(vector[None], none)[0]
    sizes = np.bincount(plain.groups)
    power, even = np.zeros(sizes.size), np.zeros(sizes.size)
    for _ in range(_PAIRS):
        noise = {r.name: current_noise(r)[:, None] * generator.standard_normal((3, r.y.size)) for r in part.recordings}
        pair = [
            under_noise(part, [with_inputs_moved(r, sign * noise[r.name]) for r in part.recordings])
            for sign in (1.0, -1.0)
        ]
        up, down = (plain.whiten(one.residuals(vector[None], none))[0] - before for one in pair)
        power += np.bincount(plain.groups, 0.5 * (up**2 + down**2)) / sizes
        even += np.bincount(plain.groups, (0.5 * (up + down)) ** 2)
    scale = np.sqrt(np.maximum(power / _PAIRS, 1.0)) * (1.0 + even / _PAIRS)
    filters, powers = {}, {}
    for n, own in white.filters.items():
        mine = scale[plain.segments.count == n]
        filters[n] = own / mine[:, None, None]
        powers[n] = white.powers[n] / mine[:, None] ** 2
    return WhitenedAhead(**_settings_of(part), white=Whitening(filters, powers, scale < _LINEAR))


def _settings_of(part: Ahead) -> dict[str, Any]:
    return {f.name: getattr(part, f.name) for f in fields(Ahead)}


@dataclass(frozen=True)
class Feigned:
    """What noise of the currents adds on average: excess (G, p) to half the gradient of each window's weighted square,
    information (p, p) to J'J, in search coordinates."""

    excess: Array
    information: Array


def realised(part: WhitenedAhead, residuals: Array) -> Array:
    """Mean squares (R,) of whitened residuals (N,) by recording, in windows with linear dynamics: how much of the noise
    that was expected there was. Close to 1, or errors of the model are taken for noise."""
    assert part.white is not None
    rows = part.white.linear[part.groups]
    owner = part.group_recording[part.groups[rows]]
    count = np.bincount(owner, minlength=len(part.recordings))
    square = np.bincount(owner, residuals[rows] ** 2, minlength=len(part.recordings))
    found = np.where(count > _FEWEST, square / np.maximum(count, 1), 1.0)
    return np.asarray(np.clip(found, 1.0 / _OFF, _OFF))


def feigned(
    part: WhitenedAhead, push: CurrentPush, space: SearchSpace, point: Array, weights: Array, residuals: Array
) -> Feigned:
    """What noise of the currents adds to a whitened part. point: (p,) search coordinates; weights: (N,) of its
    residuals (N,)."""
    p = point.size
    steps = _STEP * np.eye(p)
    moved = push(space.vectors(np.clip(np.vstack([point, point + steps, point - steps]), 0.0, 1.0)))
    at, slopes = moved[0], (moved[1 : 1 + p] - moved[1 + p :]) / (2.0 * _STEP)
    assert part.white is not None
    excess = np.zeros((part.segments.count.size, p))
    information = np.zeros((p, p))
    window_weights = weights[part.edges[:-1]] ** 2 * realised(part, residuals)[part.segments.recording]
    for n, powers in part.white.powers.items():
        windows = np.flatnonzero(part.segments.count == n)
        samples = part.flat_first[windows][:, None] + np.arange(n)
        power = powers * window_weights[windows][:, None]
        for phase in range(3):
            by_point = slopes[:, phase][:, samples]
            excess[windows] += np.einsum("wn,wn,pwn->wp", power, at[phase][samples], by_point)
        total = np.bincount(samples.ravel(), power.ravel(), minlength=at.shape[1])
        information += np.einsum("n,pjn,qjn->pq", total, slopes, slopes)
    return Feigned(excess, information)
