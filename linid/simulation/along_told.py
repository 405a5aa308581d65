"""What a model says along a measured motion, and where predictions start that begin on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linid.arrays import Array, Integers


@dataclass(frozen=True)
class AlongMotion:
    """What the model says along a measured motion, for C candidates.

    acceleration: (C, samples) m/s^2; bristle: (C, samples) deflection in m; states: (C, samples, hidden) hidden states
    of the active effects; reading_error: (C, samples) reading minus position in m, or None where no effect has one.
    """

    acceleration: Array
    bristle: Array
    states: Array
    reading_error: Array | None

    def starts(self, samples: Integers, y: Array, v: Array, dts: Array) -> Array:
        """Start states (C, S, 3 + states) of predictions from measured samples (S,), for `Simulator.run`.

        y, v: (samples,) measured motion of all recordings in m and m/s; dts: (S,) sampling period in s. The starts are
        freed of the reading error.
        """
        out = np.empty((self.bristle.shape[0], samples.size, 3 + self.states.shape[2]))
        out[:, :, 0], out[:, :, 1] = y[samples], v[samples]
        out[:, :, 2] = self.bristle[:, samples]
        out[:, :, 3:] = self.states[:, samples] if self.states.shape[2] else 0.0
        if self.reading_error is not None:
            error = self.reading_error
            out[:, :, 0] -= error[:, samples]
            before, after = np.maximum(samples - 1, 0), np.minimum(samples + 1, error.shape[1] - 1)
            out[:, :, 1] -= (error[:, after] - error[:, before]) / ((after - before) * dts)
        return out
