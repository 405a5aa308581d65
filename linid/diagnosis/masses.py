"""The size of mass and all forces, which only recordings with different added masses tell."""

from __future__ import annotations

from linid.diagnosis.descent import SETTLING
from linid.diagnosis.joint import Fitted, JointFit
from linid.identification.guess.effect_values import scaled_to_masses


def at_the_masses(fits: JointFit, found: Fitted) -> Fitted:
    """A model where mass and all forces are of the size that recordings with different added masses tell.

    Only free wheels tell it, a few of all rows: a fit that starts far off counts them as bursts, and leaves them so.
    """
    recordings = [r for r in fits.balance.recordings if r.split == "fit"]
    values = scaled_to_masses(found.model, recordings, found.values, found.held, fits.balance.jobs)
    if values == found.values:
        return found
    other = fits.fit(found.model, values, found.preset, found.recordings, SETTLING, shape=found.shape)
    return other if other.level < found.level else found
