"""What a model says along a measured motion, and where predictions start that begin on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linid.arrays import Array, Integers
from linid.simulation.inputs import Inputs


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

    def starts(self, samples: Integers, y: Array, v: Array, inputs: Inputs) -> Array:
        """Start states (C, S, 3 + states) of predictions from measured samples (S,), for `Simulator.run`.

        y, v: (samples,) measured motion of all recordings in m and m/s; inputs: these, packed. The starts are freed of
        the reading error.
        """
        out = np.empty((self.bristle.shape[0], samples.size, 3 + self.states.shape[2]))
        out[:, :, 0], out[:, :, 1] = y[samples], v[samples]
        out[:, :, 2] = self.bristle[:, samples]
        out[:, :, 3:] = self.states[:, samples] if self.states.shape[2] else 0.0
        if self.reading_error is not None:
            error = self.reading_error
            out[:, :, 0] -= error[:, samples]
            owner = np.searchsorted(inputs.sample_offsets, samples, side="right") - 1
            first, last = inputs.sample_offsets[owner], inputs.sample_offsets[owner + 1] - 1
            before, after = np.maximum(samples - 1, first), np.minimum(samples + 1, last)
            out[:, :, 1] -= (error[:, after] - error[:, before]) / ((after - before) * inputs.dts[owner])
        return out
