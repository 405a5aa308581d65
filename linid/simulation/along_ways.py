"""Directions beside a model along a measured motion: rows of what is carried of them, and bits of what they change."""

from __future__ import annotations

from linid.simulation.binding import inlined

# Rows of what is carried along, each of one number per direction: the bristle's deflection, its mean over an interval
# and that with a growing weight; what the interval before leaves for the next sample; the forces and the factor on the
# bristle at a sample, the level of friction between two, what is added before and the motor's force that adds to it;
# outer acceleration at the last sample and the one before; what is being written.
BRISTLE, MEAN, LATE, LEFT, FORCE, FACTOR, LEVEL, LOAD, PRESS, LAST, BEFORE_LAST, WRITTEN, ROWS = range(13)
# Bits of the ways of a direction: whether it changes the factor on the bristle, that on the level of friction, hidden
# states and the reading; whether all that it does to the forces but by own terms is told beforehand, but for the factor
# that hidden states make on the thrust; whether that is all that it changes of the forces; whether it is asked sample
# by sample; whether own terms hear of it by the motor's force; whether it changes what effects add to friction, the
# motor's force of which they make that, and what own terms add.
HOLDS, LEVELS, MOVES, READS, TOLD, DERATED, DERATES, ASKED, HEARD, LOADS, PRESSES, GRIPS = (1 << k for k in range(12))


@inlined
def some_have(ways, bits):
    """Whether one of the directions has one of these ways."""
    found = False
    for way in ways:
        found = found or way & bits != 0
    return found


@inlined
def some_lack(ways, bits):
    """Whether one of the directions has none of these ways."""
    found = False
    for way in ways:
        found = found or way & bits == 0
    return found
