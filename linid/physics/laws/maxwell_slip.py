"""Generalised Maxwell slip: springs side by side, each of which slips at its own share of the sliding force.

Its presliding curve has the memory of all earlier reversals, and no drift: a small loop inside a larger one closes.

Source: Al-Bender, Lampaert and Swevers 2005.
"""

from __future__ import annotations

from linid.physics.laws.law import Law, Own
from linid.physics.parameter import Parameter
from linid.physics.term import term

ELEMENTS = 4
_LEAST = 0.05  # of an even share of the force: an element with less would be none
_OWN = (
    Parameter("slip_stiffness_ratio", "r_k", "1", 0.1, 1.0, 0.5, meaning="stiffness of an element over the one before"),
    Parameter("slip_force_tilt", "r_1", "1", -0.9, 0.9, 0.0, meaning="how the sliding force grows over the elements"),
    Parameter("slip_force_bend", "r_2", "1", -0.6, 0.6, 0.0, meaning="share of the outer elements over the inner ones"),
    Parameter("slip_force_twist", "r_3", "1", -0.6, 0.6, 0.0, meaning="what tilt and bend leave of the four shares"),
)


@term
def shape(k: int, own: Own) -> tuple[float, float]:
    """Shares of the sliding force and of the stiffness of element k, counted from 0; both sum to 1 over all."""
    ratio, tilt, bend, twist = own
    whole = stiff = forces = force = 0.0
    power = 1.0
    for j in range(ELEMENTS):
        # The three orthogonal polynomials on four places.
        place = (j - 1.5) / 1.5
        outer = 1.0 if j == 0 or j == 3 else -1.0
        odd = place / 3.0 if j == 0 or j == 3 else -3.0 * place
        share = max(1.0 + tilt * place + bend * outer + twist * odd, _LEAST)
        if j == k:
            stiff, force = power, share
        whole += power
        forces += share
        power *= ratio
    return force / forces, stiff / whole


LAW = Law(
    name="maxwell_slip",
    title="Maxwell slip",
    meaning=f"{ELEMENTS} springs side by side, each slips at its own share of the force: memory of earlier reversals",
    source="Al-Bender, Lampaert and Swevers 2005, IEEE Trans. Autom. Control 50, 1883",
    own=_OWN,
    elements=ELEMENTS,
    shape=shape,
)
