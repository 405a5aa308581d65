"""How the readings along a measured motion answer directions beside a model, by differences."""

from __future__ import annotations

import numpy as np

from linid.simulation.along_effects import write_readings_over
from linid.simulation.along_load import currents_beside
from linid.simulation.along_ways import READS
from linid.simulation.binding import allocating, compiled
from linid.simulation.forces import reading_error
from linid.simulation.slope_effects import FORCE_STEP


@allocating
def tell_readings(terms, axis, samples, found, room):
    """Put in how the readings at all samples answer, where they hang on no hidden state."""
    known, other = np.empty(samples.y.size), np.empty(samples.y.size)
    write_readings_over(terms, axis.on, samples, axis.p, known)
    for c in range(room.lag.size):
        if room.ways[c] & READS:
            write_readings_over(terms, axis.on, samples, room.params[c], other)
            for k in range(known.size):
                found.reading[c, k] = (other[k] - known[k]) / FORCE_STEP


@compiled
def write_readings(terms, axis, course, here, found, room):
    """Put in how the reading at sample k answers (`write_hidden`)."""
    k, t, y, v, currents = here[:5]
    on = axis.on
    error = reading_error(terms, on, t, y, v, currents, axis.p)
    reading = reading_error(terms, on, t, y - error, v, currents, axis.p)
    for c in range(room.lag.size):
        if room.ways[c] & READS:
            p = room.params[c]
            given = currents_beside(terms, axis, course, (k, currents), c, room)
            error = reading_error(terms, on, t, y, v, given, p)
            found.reading[c, k] = (reading_error(terms, on, t, y - error, v, given, p) - reading) / FORCE_STEP
