"""The unknowns of joint fits: what moves alone where another one does, and how few steps a turned field takes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from linid.diagnosis.descent import QUICK, Descent
from linid.diagnosis.linear_problem import LinearProblem
from linid.identification.space.proportions import UNSHAPED
from linid.physics.model import Model
from tests.diagnosis.test_criterion import HELD, NAMES, fits_of

STANDS = [("sine", "stand_axis_sine.yaml"), ("theta", "stand_axis.yaml")]


def pushing_forwards(truth: dict[str, float], model: Model) -> dict[str, float]:
    """The same motor with a positive force constant."""
    if truth["force_constant"] > 0.0:
        return truth
    turned = truth["commutation_offset"] + math.pi / model.turns
    return {**truth, "force_constant": -truth["force_constant"], "commutation_offset": turned}


@pytest.mark.parametrize(("kind", "config"), STANDS)
def test_first_values_come_back_and_the_pole_pitch_leaves_thrust_and_phase_alone(kind: str, config: str) -> None:
    """The phase of the field in the middle of the motion, and the thrust of its first harmonic."""
    fits, truth = fits_of(kind, config)  # type: ignore[arg-type]
    model = Model(kind)  # type: ignore[arg-type]
    truth = pushing_forwards(truth, model)
    posed, x = fits._posed(model, truth, fits._held(model, {}), UNSHAPED)
    names = [c.name for c in posed.coordinates]
    vector = posed.vectors(x)[0]
    for name in (p.name for p in model.driven_by.parameters):
        assert vector[model.slot(name)] == pytest.approx(truth[name], rel=1e-9), name

    def moved(name: str, by: float) -> np.ndarray:
        step = np.zeros(x.size)
        step[names.index(name)] = by
        return np.asarray(posed.vectors(x + step)[0])

    def thrust_and_phase(vector: np.ndarray) -> tuple[float, float]:
        shape = {name: vector[model.slot(name)] for name, _ in model.driven_by.shape}
        thrust = model.driven_by.fundamental(vector[model.slot("force_constant")], shape)
        turned = vector[model.slot("commutation_offset")]
        return float(thrust), float(turned + fits.coordinates.middle * vector[model.slot("electrical_wavenumber")])

    thrust, phase = thrust_and_phase(vector)
    other = moved("electrical_wavenumber", 0.02)
    assert other[model.slot("electrical_wavenumber")] != pytest.approx(truth["electrical_wavenumber"], rel=1e-3)
    assert thrust_and_phase(other) == pytest.approx((thrust, phase), rel=1e-9)
    across = moved("thrust_across", 0.1 * x[names.index("force_constant")])
    turn = math.atan2(0.1, 1.0) / model.turns
    assert thrust_and_phase(across) == pytest.approx((math.hypot(1.0, 0.1) * thrust, phase + turn), rel=1e-9)


@pytest.mark.parametrize(("kind", "config"), STANDS)
@pytest.mark.parametrize(("apart", "pitch"), [(0.25, 1.0), (0.0, 1.02), (-0.2, 0.99)])
def test_a_quick_fit_finds_a_pitch_and_phases_that_are_off(kind: str, config: str, apart: float, pitch: float) -> None:
    """Where a pitch turns the field about position zero, the same steps end up to a level higher."""
    fits, truth = fits_of(kind, config)  # type: ignore[arg-type]
    model, places = Model(kind), tuple(range(len(NAMES)))  # type: ignore[arg-type]
    truth = pushing_forwards(truth, model)
    first = dict(truth)
    first["winding_displacement"] += apart / model.turns
    first["electrical_wavenumber"] *= pitch
    first["commutation_offset"] += fits.coordinates.middle * (1.0 - pitch) * truth["electrical_wavenumber"]
    held = fits._held(model, {name: truth[name] for name in HELD.get(kind, ())})
    begun, ended = [], []
    for values in (truth, first):
        descent = Descent(fits, *fits._posed(model, values, held, UNSHAPED), places, {}, False)
        begun.append(descent.place.level)
        descent.run(QUICK)
        ended.append(descent.place.level)
    assert begun[1] > begun[0] + 0.5
    assert ended[1] < ended[0] + 0.1


def test_the_damping_of_a_radius_is_the_least_that_keeps_to_it() -> None:
    """Steps of a problem with directions that differ by nine orders; reference: the steps themselves."""
    generator = np.random.default_rng(3)
    slopes = (
        np.diag(10.0 ** np.arange(0.0, -4.6, -0.5)) @ generator.normal(size=(10, 10)) @ generator.normal(size=(10, 400))
    )
    residual, ones = generator.normal(size=400), np.ones(400)
    problem = LinearProblem(slopes, residual, ones, ones, np.zeros(10))
    free = np.full(10, -np.inf), np.full(10, np.inf)

    def length(damping: float) -> float:
        return float(np.linalg.norm(problem.step(damping, free)[0] * problem.norms))

    assert problem.damping_within(math.inf, 1e-3) == 1e-3
    for share in (0.9, 0.5, 0.1, 1e-3):
        radius = share * length(1e-9)
        found = problem.damping_within(radius, 1e-3)
        assert problem.length(found) == pytest.approx(length(found), rel=1e-6)
        assert length(found) <= radius < length(found * 10.0**-0.25)
