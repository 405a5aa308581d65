"""Evidence on the paper's remarks by the way: known slopes and directions are found, coils push back."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from linid.diagnosis.gap import Trace
from linid.physics.field.geometry import load_geometry
from linid.physics.field.winding import Winding
from linid.reproduction.further_claims import further_claims
from linid.reproduction.further_evidence import Further, coil_forces, further_evidence, shut_k
from linid.reproduction.printed import TABLE_1, meant
from tests.workflow.small import ROOT

COULOMB = 2.0
GEOMETRY = ROOT / "configs" / "motor_geometry.yaml"
USUAL = Further((1e-4, 1e-4), (1e-4, 1e-4), (7e-3, 7e-3), {"square_current_1": 0.03}, {0.25: 0.45, 1.0: 0.56}, 1.0, 0.0)


def wheel(start: float, sign: float, *, slope: float = 0.0, backward: float = 0.0, seed: int = 0) -> Trace:
    """A free wheel from `start`; friction changes by `slope` N/m and by `backward` N at negative speed; it springs back
    at 5 mm/s, in the simulation at 4 mm/s."""
    t = np.linspace(0.0, 1.0, 500)
    v = sign * np.where(t < 0.8, 0.6 * (0.8 - t), -5e-3 * np.exp(-((t - 0.85) ** 2) / 1e-4))
    y = start + np.cumsum(v) * (t[1] - t[0])
    missing = slope * y + (backward if sign < 0.0 else 0.0)
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(t.size)
    return Trace(
        recording=f"freewheel_{seed}",
        kind="free_wheel",
        split="fit",
        axis="linear",
        added_mass=0.0,
        t=t,
        y_measured=y,
        y_simulated=y,
        velocity_measured=v,
        velocity_simulated=np.where(t < 0.8, v, 0.8 * v),
        force_t=t,
        force_residual=sign * missing + noise,
    )


def wheels(**change: float) -> list[Trace]:
    places = ((0.1, 1.0), (0.5, -1.0), (0.3, 1.0), (0.7, -1.0), (0.45, 1.0), (0.4, -1.0))
    return [wheel(start, sign, seed=k, **change) for k, (start, sign) in enumerate(places)]


def square(drift: float) -> Trace:
    t = np.linspace(0.0, 2.0, 1000, endpoint=False)
    y = drift * t / 2.0 + 0.01 * np.cos(2.0 * np.pi * 4.0 * t)
    return replace(wheel(0.0, 1.0), recording="square_current_1", t=t, y_measured=y)


def found(**change: float) -> Further:
    return further_evidence(wheels(**change), [square(-0.03)], COULOMB, load_geometry(GEOMETRY))


def test_a_slope_along_the_guideway_is_found() -> None:
    even, uneven = found(), found(slope=1.0)
    assert abs(even.along[0]) < 3.0 * even.along[1] and even.along[1] < 1e-3
    reach = max(np.ptp(np.concatenate([t.y_measured[np.abs(t.velocity_measured) > 0.1] for t in wheels()])), 0.1)
    assert uneven.along[0] == pytest.approx(reach / COULOMB, rel=0.02)
    verdicts = [next(c for c in further_claims(one) if "homogeneous" in c.claim).verdict for one in (even, uneven)]
    assert verdicts == ["holds", "does not hold"]


def test_another_friction_backwards_is_found() -> None:
    even, uneven = found(), found(backward=-0.2)
    assert abs(even.directions[0]) < 3.0 * even.directions[1]
    assert uneven.directions[0] == pytest.approx(0.1, rel=0.02)
    verdicts = [next(c for c in further_claims(one) if "square waves" in c.claim).verdict for one in (even, uneven)]
    assert verdicts == ["cannot be told", "holds in part"]
    assert even.square_drift["square_current_1"] == pytest.approx(-0.03, rel=0.05)


def test_the_recoil_of_a_free_wheel() -> None:
    assert found().recoil == pytest.approx((5e-3, 4e-3), rel=0.01)
    unlike = replace(USUAL, recoil=(7e-3, 1e-3))
    verdicts = [next(c for c in further_claims(one) if "overshoot" in c.claim).verdict for one in (USUAL, unlike)]
    assert verdicts == ["does not hold", "cannot be told"]
    first = meant(TABLE_1)
    stiffness, damping = first["bristle_stiffness"], first["bristle_damping"] + first["viscous_friction"]
    assert math.sqrt(stiffness / first["mass"]) / (2.0 * math.pi) == pytest.approx(22.0, abs=0.5)
    ratios = [damping / (2.0 * math.sqrt(stiffness * (first["mass"] + added))) for added in (0.0, 1.0)]
    assert ratios == pytest.approx([0.57, 0.35], abs=0.005)


def test_coils_push_each_other_as_their_mutual_inductance_changes() -> None:
    """Against dM/dy of Neumann's double integral, summed over pieces of its own."""
    winding, spacing, layer = Winding(0.06, 0.0124, 20), 0.0094, 2e-3

    def pieces(shift: float, height: float) -> tuple[np.ndarray, np.ndarray]:
        x, y = 0.03, 0.0062
        corners = np.array([[x, -y], [x, y], [-x, y], [-x, -y], [x, -y]]) + np.array([0.0, shift])
        nodes = np.concatenate([a + np.linspace(0, 1, 301)[:-1, None] * (b - a) for a, b in pairwise(corners)])
        nodes = np.vstack([nodes, nodes[:1]])
        middle = np.column_stack([0.5 * (nodes[1:] + nodes[:-1]), np.full(len(nodes) - 1, height)])
        return middle, np.diff(nodes, axis=0)

    def neumann(shift: float) -> float:
        (a, da), (b, db) = pieces(0.0, 0.0), pieces(shift, layer)
        apart = np.linalg.norm(a[:, None] - b[None], axis=2)
        return 20**2 * 1e-7 * float(np.sum((da @ db.T) / apart))

    step = 1e-5
    slope = (neumann(spacing + step) - neumann(spacing - step)) / (2.0 * step)
    forward, backward = coil_forces(winding, spacing)
    assert forward == pytest.approx(slope, rel=1e-3)
    assert forward + backward == pytest.approx(0.0, abs=1e-9 * abs(forward))


def test_magnets_without_space_are_wider_the_wider_the_gap() -> None:
    geometry = load_geometry(GEOMETRY)
    ratios = [shut_k(geometry.pair, geometry.pole_pitch, gap) for gap in (0.25, 0.5, 1.0)]
    assert ratios == sorted(ratios) and ratios[0] < 0.5 < ratios[-1]
    shut = replace(USUAL, shut_k={0.25: 0.6, 1.0: 0.7})
    verdicts = [next(c for c in further_claims(one) if "k = 0.5" in c.claim).verdict for one in (USUAL, shut)]
    assert verdicts == ["holds in part", "does not hold"]
