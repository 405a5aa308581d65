"""Inputs and positions between the samples, from the splines' coefficients."""

from __future__ import annotations

from linid.simulation.binding import inlined


@inlined
def spline_at(c, k, row, x):
    """A cubic spline x seconds after sample k; c: (n - 1, 4, 4) coefficients, of which the `row`.

    Not by a view of the row: views are counted, which costs more than the spline.
    """
    return ((c[k, row, 3] * x + c[k, row, 2]) * x + c[k, row, 1]) * x + c[k, row, 0]


@inlined
def inputs_at(c, k, x):
    """The three inputs x seconds after sample k; c: (n - 1, 4, 4) spline coefficients."""
    return spline_at(c, k, 0, x), spline_at(c, k, 1, x), spline_at(c, k, 2, x)


@inlined
def late_inputs(c, dt, x):
    """The three inputs x seconds after the first sample, held at the recording's ends."""
    last = c.shape[0]
    x = min(max(x, 0.0), last * dt)
    k = min(int(x / dt), last - 1)
    return inputs_at(c, k, x - k * dt)
