"""The voltages at the windings of an exact motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from linid.arrays import Array
from linid.stand.plant import commutation_angles, phase_constants

if TYPE_CHECKING:
    from linid.stand.description import Winding
    from linid.stand.plant import PlantParameters, PlantRun


def phase_voltages(winding: Winding, parameters: PlantParameters, run: PlantRun) -> Array:
    """Phase voltages (3, n) in V at the logged instants: U_j = R I_j + sum_k L_jk dI_k/dt + e_j(y) v.

    e_j in V s/m is the thrust per current of phase j in N/A, so that the electrical power e_j I_j v is the
    mechanical power of the phase. Separate windings: across each winding. Star: from each terminal to the mean of
    the three, as an artificial neutral of three equal resistors gives it, since the motor's own is not brought out:
    less the mean of e_j v, which drives no current there. Without current the voltages are the back-EMF.
    winding: R, L, M and connection; parameters: of the motor; run: the exact motion.
    """
    rates = phase_current_rates(parameters, run)
    mutual = winding.mutual_inductance_h
    voltages: Array = (
        winding.resistance_ohm * run.phase_currents
        + (winding.inductance_h - mutual) * rates
        + mutual * rates.sum(axis=0)
        + phase_constants(run.y, parameters) * run.v
    )
    if winding.connection == "star":
        voltages -= voltages.mean(axis=0)
    return voltages


def phase_current_rates(parameters: PlantParameters, run: PlantRun) -> Array:
    """dI_j/dt (3, n) in A/s of the phase currents: the q-current changes, and the field passes by."""
    angles = commutation_angles(parameters, run.y)
    passing = parameters.density * run.v * run.q_current * np.cos(angles)
    return np.asarray(parameters.polarity * (run.q_current_rate * np.sin(angles) + passing))
