"""Generalised Maxwell slip: springs side by side, each of which slips at its own share of the sliding force.

Its presliding curve has the memory of all earlier reversals, and no drift: a small loop inside a larger one closes.
"""

from __future__ import annotations

from numba import njit

from linid.physics.laws.law import Law
from linid.physics.parameter import Parameter

ELEMENTS = 4
_OWN = (
    Parameter("slip_stiffness_ratio", "r_k", "1", 0.1, 1.0, 0.5, meaning="stiffness of an element over the one before"),
    Parameter("slip_force_tilt", "r_F", "1", -0.9, 0.9, 0.0, meaning="how the sliding force grows over the elements"),
)


@njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False, forceinline=True)
def shape(k, own):
    """Shares of the sliding force and of the stiffness of element k, counted from 0; both sum to 1 over all."""
    ratio, tilt = own
    whole, mine, power = 0.0, 0.0, 1.0
    for j in range(ELEMENTS):
        if j == k:
            mine = power
        whole += power
        power *= ratio
    place = 2.0 * k / (ELEMENTS - 1) - 1.0
    return (1.0 + tilt * place) / ELEMENTS, mine / whole


LAW = Law(
    name="maxwell_slip",
    title="Maxwell slip",
    meaning=f"{ELEMENTS} springs side by side, each slipping at its own share of the force: memory of earlier reversals",
    source="Al-Bender, Lampaert and Swevers 2005, IEEE Trans. Autom. Control 50, 1883",
    own=_OWN,
    elements=ELEMENTS,
    shape=shape,
)
