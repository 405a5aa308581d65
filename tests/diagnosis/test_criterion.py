"""The criterion of joint fits: the slope by which a descent goes down is that of the criterion itself."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from linid.diagnosis.balance import Balance
from linid.diagnosis.base import numbered
from linid.diagnosis.descent import Descent
from linid.diagnosis.joint import JointFit
from linid.diagnosis.judge import judge_of
from linid.identification.result import ModelKind
from linid.identification.space.proportions import UNSHAPED
from linid.physics.model import Model
from tests.identification.stand import stand

NAMES = ("freewheel_1", "sine_current_1", "moves_1")
HELD = {"theta": ("nome", "winding_length")}


@cache
def fits_of(kind: ModelKind, config: str) -> tuple[JointFit, dict[str, float]]:
    """Joint fits of a stand, and the true values; the phase is searched with the thrust."""
    made = stand(config, only=NAMES)
    model = Model(kind)
    held = {name: made.truth[name] for name in HELD.get(kind, ())}
    judge = judge_of(Balance(model, numbered(made.recordings), 1, 1), model, made.truth, held, {}, 1)
    return judge.fits, {p.name: made.truth[p.name] for p in model.parameters}


@pytest.mark.parametrize(("kind", "config"), [("sine", "stand_axis_sine.yaml"), ("theta", "stand_axis.yaml")])
@pytest.mark.parametrize(
    ("thrust", "across", "softness"),
    [(0.7, 0.0, 1.0), (1.6, 0.0, 1.0), (0.7, 0.4, 1.0), (1.6, 0.4, 1.0), (1.6, 0.4, 100.0)],
)
def test_a_descent_has_the_slope_of_the_criterion(
    kind: ModelKind, config: str, thrust: float, across: float, softness: float
) -> None:
    """Also where the model has more noise than the base (thrust above it), which is taken off no further than to the
    base's floor, and where the phase has turned since the start. Reference: central differences of the criterion."""
    fits, truth = fits_of(kind, config)
    model, rows = Model(kind), fits.rows_of(range(len(NAMES)))
    first = {**truth, "coulomb_force": 1.02 * truth["coulomb_force"]}
    posed, x = fits._posed(model, first, fits._held(model, {}), UNSHAPED)
    names = [c.name for c in posed.coordinates]
    along = names.index("force_constant")
    x[along] *= thrust
    x[names.index("thrust_across")] = across * x[along]

    def level(at: np.ndarray) -> float:
        vector = posed.vectors(at)[0]
        residual = fits.residuals(posed, at[None])[0]
        return fits.level(residual, fits.floor_of(model, vector), rows, softness) * np.count_nonzero(rows)

    descent = Descent(fits, posed, x, tuple(range(len(NAMES))), {}, False)
    descent.slopes[:] = fits.differences(posed, x, descent.place.residual, range(x.size))
    found = descent.linear(softness).half_slope
    size = abs(found[along] * x[along])
    for name in ("force_constant", "thrust_across", "coulomb_force", "viscous_friction", "mass"):
        k = names.index(name)
        step = np.zeros(x.size)
        step[k] = 1e-5 * max(abs(x[k]), 0.01 * abs(x[along]))
        exact = (level(x + step) - level(x - step)) / (4.0 * step[k])
        assert found[k] == pytest.approx(exact, rel=0.01, abs=1e-3 * size / abs(x[along])), name
