"""The criterion of all fits of a diagnosis: the log power per bin of `BIN` seconds.

L = sum over bins of n log((sum p + sum f)/(2 sum f)), with p the squared residual and f the noise in it: what a fit
lessens, a judgement weighs. A bin that no model here can follow has its say once, however large its residual is; one
at the floor asks for nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from linid.arrays import Array, Flags, Integers
from linid.diagnosis.balance import Balance, Noise, Places, gain_of
from linid.diagnosis.binned import squares_by_bin
from linid.diagnosis.unknowns import ACROSS, Coordinate, FieldPhase, vectors_of
from linid.physics.model import Model

_STEP = 1e-4  # of a parameter's own scale, for differences
_SMALL = 0.1  # of that, for the slopes of the parameters by what is searched
_LEAST_NOISE = 1e-4  # of the scale's square: recordings without noise count no more than that
_LEAST_LEFT = 0.1  # of a bin's squares, whatever noise is taken off


@dataclass(frozen=True)
class Posed:
    """What a fit searches: coordinates (p) of a model, with SI values that are held, the field's first phase, and
    parameters that keep a ratio to another."""

    model: Model
    coordinates: tuple[Coordinate, ...]
    held: Mapping[str, float]
    phase: FieldPhase
    ties: Mapping[str, tuple[str, float]]

    def vectors(self, x: Array) -> Array:
        """Flat parameter vectors (C, VECTOR_SIZE), SI, of unknowns x, (p,) or (C, p)."""
        return vectors_of(self.coordinates, self.model, self.held, x, self.phase, self.ties)


class Criterion:
    """How well residuals of the rows of a balance are explained.

    scale: (R,) m/s^2 in which residuals are counted; noise: in them.
    """

    def __init__(self, balance: Balance, scale: Array, noise: Noise) -> None:
        self.balance = balance
        self.scale = scale
        self.noise = noise
        rows = balance.rows
        self.inverse = 1.0 / scale[rows.recording]
        self.bins = int(rows.bin.max(initial=-1)) + 1
        self.squared = np.zeros(self.bins)
        self.squared[rows.bin] = self.inverse**2
        self._block = np.zeros(self.bins, dtype=np.int64)
        self._block[rows.bin] = rows.block
        self.reference = np.maximum(noise.power(noise.gain) * self.squared, _LEAST_NOISE)

    def rows_of(self, recordings: Iterable[int]) -> Flags:
        """Rows (n,) that belong to recordings given by their places."""
        return self.balance.rows_of(recordings)

    def floor_of(self, model: Model, vector: Array) -> Array:
        """Mean squares (B,) in the fit's scale that the noise gives the residuals of each bin under a model.
        vector: (VECTOR_SIZE,), SI.
        """
        return np.asarray(np.maximum(self.noise.power(gain_of(model, vector)) * self.squared, _LEAST_NOISE))

    def bin_powers(
        self, residual: Array, floor: Array, rows: Flags, softness: float = 1.0
    ) -> tuple[Array, Array, Array]:
        """Per bin (B,): sum of the squared residuals, of the base's floor, and the number of rows, over the chosen
        rows.

        residual: (n,) m/s^2; rows: (n,) chosen; floor: (B,) under the residual's own model; what it has more noise than
        the base is taken off the squares (corrected least squares: Fuller 1987), or a fit would do best with inputs
        that push less than they do. softness: floors that count as one.
        """
        power, counts = self._squares(residual, rows)
        corrected = np.maximum(power - counts * (floor - self.reference), self._least(power, counts))
        return corrected, softness * self.reference * counts, counts

    def _squares(self, residual: Array, rows: Flags) -> tuple[Array, Array]:
        """Per bin (B,): the sum of the squared residuals, and the number of rows, over the chosen rows."""
        power, counts = np.zeros(self.bins), np.zeros(self.bins)
        squares_by_bin(residual, self.inverse, rows, self.balance.rows.bin, power, counts)
        return power, counts

    def _least(self, power: Array, counts: Array) -> Array:
        """What is left of the bins' squares (B,) at least, whatever noise is taken off."""
        # No further than to the base's floor, or thrust that an effect takes away again would pay.
        return np.minimum(power, np.maximum(counts * self.reference, _LEAST_LEFT * power))

    def answers(self, residual: Array, floor: Array, rows: Flags) -> tuple[Array, Array]:
        """How the corrected squares of `bin_powers` answer those of the residuals, and the noise that is taken off,
        (B,) each.

        Arguments as in `bin_powers`.
        """
        power, counts = self._squares(residual, rows)
        left = counts * self.reference
        whole = power - counts * (floor - self.reference) >= self._least(power, counts)
        at_the_least = np.where(power <= left, 1.0, np.where(left >= _LEAST_LEFT * power, 0.0, _LEAST_LEFT))
        return np.asarray(np.where(whole, 1.0, at_the_least)), np.asarray(whole, dtype=np.float64)

    def level(self, residual: Array, floor: Array, rows: Flags, softness: float = 1.0) -> float:
        """The criterion per row: mean log of power and floor over twice the floor, 0 at the floor.

        Arguments as in `bin_powers`.
        """
        power, noise, counts = self.bin_powers(residual, floor, rows, softness)
        known = counts > 0
        return float(counts[known] @ np.log((power + noise)[known] / (2.0 * noise[known]))) / float(counts.sum())

    def blocks_of(self, known: Flags) -> Integers:
        """The blocks (k,) of those of the bins (B,) that are known, numbered from 0 without gaps."""
        return np.unique(self._block[known], return_inverse=True)[1]

    def weights(self, residual: Array, floor: Array, rows: Flags, softness: float = 1.0) -> Array:
        """Square roots of the weights (n,) in s^2/m of a step of the fit; zero outside the chosen rows.

        Arguments as in `bin_powers`.
        """
        power, noise, counts = self.bin_powers(residual, floor, rows, softness)
        per_bin = np.sqrt(counts / np.maximum(power + noise, 1e-300))
        return np.asarray(np.where(rows, per_bin[self.balance.rows.bin] * self.inverse, 0.0))

    def pull(self, posed: Posed, residual: Array, vector: Array, rows: Flags, softness: float) -> Array:
        """Half the slopes (p,) of the criterion (times rows) that the floor alone has: by thrust and mass.
        vector: (VECTOR_SIZE,), SI; all else as in `bin_powers`.
        """
        if self.noise.gain == 0.0:
            return np.zeros(len(posed.coordinates))
        gain = gain_of(posed.model, vector)
        floor = self.floor_of(posed.model, vector)
        power, noise, counts = self.bin_powers(residual, floor, rows, softness)
        inputs = counts * self.noise.inputs * self.squared * (gain / self.noise.gain) ** 2
        inputs *= self.answers(residual, floor, rows)[1]
        known = counts > 0
        # d/d log gain of n log(p + f), halved
        slope = -float(np.sum((counts * inputs)[known] / (power + noise)[known]))
        return slope * _of_the_gain(posed, vector, gain)

    def residuals(self, posed: Posed, x: Array, places: Places | None = None) -> Array:
        """Residuals (C, n) in m/s^2 of unknowns x (C, p); places: of the recordings that are asked for (None: all)."""
        return self.balance.residuals(posed.model, posed.vectors(x), places)

    def residual_at(self, posed: Posed, x: Array, vector: Array, places: Places) -> Array:
        """`residuals` (n,) of one set of unknowns x (p,), of which the vector (VECTOR_SIZE,), SI, is known."""
        del x
        return np.asarray(self.balance.residuals(posed.model, vector[None, :], places)[0])

    def differences(
        self, posed: Posed, x: Array, residual: Array, wanted: Iterable[int], places: Places | None = None
    ) -> Array:
        """d residual / d unknown (k, n) of the wanted unknowns at x (p,), where the residual is (n,); places: as in
        `residuals`."""
        wanted = list(wanted)
        if not wanted:
            return np.empty((0, residual.size))
        steps = []
        for k in wanted:
            c = posed.coordinates[k]
            step = _STEP * (c.scale if c.log else max(0.1 * c.scale, min(abs(x[k]), c.scale)))
            steps.append(-step if x[k] + step > c.upper else step)
        size = np.array(steps)[:, None]
        moved = np.zeros((len(wanted), x.size))
        moved[np.arange(len(wanted)), wanted] = steps
        if self.balance.has_slopes(posed.model):
            # In units of the steps, in which all directions change what the model does by a similar share.
            tangents = posed.vectors(x + _SMALL * moved) - posed.vectors(x - _SMALL * moved)
            tangents /= 2.0 * _SMALL * _STEP
            return np.asarray(self.balance.slopes(posed.model, posed.vectors(x)[0], tangents, places) * (_STEP / size))
        return np.asarray((self.residuals(posed, x + moved, places) - residual) / size)


class Straight(Criterion):
    """A criterion whose residual is straight in all unknowns, so that it takes no simulation.

    x: (p,) where the residual is (n,) m/s^2; slopes: (p, n) d residual / d unknown.
    """

    def __init__(self, criterion: Criterion, x: Array, residual: Array, slopes: Array) -> None:
        super().__init__(criterion.balance, criterion.scale, criterion.noise)
        self._x, self._residual, self._slopes = x, residual, slopes

    def residuals(self, posed: Posed, x: Array, places: Places | None = None) -> Array:
        """Residuals (C, n) in m/s^2 of unknowns x (C, p), of all recordings."""
        del posed, places
        return np.asarray(self._residual + (x - self._x) @ self._slopes)

    def residual_at(self, posed: Posed, x: Array, vector: Array, places: Places) -> Array:
        """`residuals` (n,) of one set of unknowns x (p,); vector: (VECTOR_SIZE,), SI."""
        del vector
        return np.asarray(self.residuals(posed, x[None, :], places)[0])


def certainty_of(gains: Array, blocks: Integers) -> float:
    """What all bins gain over its deviation from block to block. gains: (k,) of bins; blocks: (k,) to which they
    belong."""
    by_block = np.bincount(blocks, gains)
    deviation = math.sqrt(by_block.size) * float(np.std(by_block))
    return float(gains.sum()) / max(deviation, 1e-300)


def _of_the_gain(posed: Posed, vector: Array, gain: float) -> Array:
    """Slopes (p,) of the logarithm of the acceleration per input. vector: (VECTOR_SIZE,), SI; gain: m/s^2 per A."""
    model = posed.model
    mass = float(vector[model.slot("mass")])
    searched = {c.name: c for c in posed.coordinates}
    turn = 0.0
    if ACROSS in searched:
        turned = float(vector[model.slot("commutation_offset")]) - posed.phase.value
        turn = model.turns * (turned + posed.phase.y * float(vector[model.slot("electrical_wavenumber")]))
    parts = {"force_constant": math.cos(turn), ACROSS: math.sin(turn)}
    out = np.zeros(len(posed.coordinates))
    for k, (name, one) in enumerate(searched.items()):
        if name in parts:
            out[k] = parts[name] / (gain * (one.for_mass or mass))
        elif name == "mass" and not ("force_constant" in searched and searched["force_constant"].for_mass):
            out[k] = -1.0
    return out
