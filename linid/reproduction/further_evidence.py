"""What the free wheels, the square waves, the magnets and the coils say to the paper's remarks. Numbers, no words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from linid.arrays import Array
from linid.diagnosis.gap import Trace
from linid.physics.field.geometry import MotorGeometry
from linid.physics.field.magnet_pair import MagnetPair, fit_gaussian
from linid.physics.field.winding import Winding

_FAST = 0.1  # m/s: above it a free wheel slides, and its friction is F_C and a part per speed
_GAPS = (0.25, 0.5, 1.0)  # air gaps in pole pitches, of magnets that leave no space between them
_PIECES = 400  # per side of a coil, of the sum over its wires
_LAYER = 2e-3  # m between the planes of neighbouring coils
_MU_0 = 4e-7 * math.pi


@dataclass(frozen=True)
class Further:
    """along: change of the friction over the stroke that the free wheels cover, directions: difference of the friction
    between the two directions, both as ratios to F_C and each with its standard deviation; recoil: largest speed in m/s
    against the motion at the end of a free wheel, measured and simulated; square_drift: drift of the measured position
    over each recording of square waves, m; shut_k: ratio k (17) of magnets without space between them by the air gap
    in pole pitches; coil_force: what a coil exerts on its neighbour, N per squared ampere; coil_sum: that and what the
    neighbour exerts on it, as a ratio to it."""

    along: tuple[float, float]
    directions: tuple[float, float]
    recoil: tuple[float, float]
    square_drift: Mapping[str, float]
    shut_k: Mapping[float, float]
    coil_force: float
    coil_sum: float


def further_evidence(
    wheels: Sequence[Trace], squares: Sequence[Trace], coulomb: float, geometry: MotorGeometry
) -> Further:
    """Evidence from free wheels and square waves of a friction model with F_C = coulomb (N), and from dimensions."""
    forward, backward = coil_forces(geometry.winding, geometry.phase_spacing)
    recoils = [_recoil(trace) for trace in wheels]
    return Further(
        along=_along(wheels, coulomb),
        directions=_directions(wheels, coulomb),
        recoil=(max(one for one, _ in recoils), max(other for _, other in recoils)),
        square_drift={trace.recording: _drift(trace) for trace in squares},
        shut_k={gap: shut_k(geometry.pair, geometry.pole_pitch, gap) for gap in _GAPS},
        coil_force=forward,
        coil_sum=abs(forward + backward) / abs(forward),
    )


def _sliding(trace: Trace) -> tuple[Array, Array, float]:
    """Position in m, force in N that the friction model misses against the motion, and direction, of a free wheel's
    sliding part."""
    v = np.interp(trace.force_t, trace.t, trace.velocity_measured)
    y = np.interp(trace.force_t, trace.t, trace.y_measured)
    fast = np.abs(v) > _FAST
    sign = float(np.sign(np.mean(v[fast])))
    return y[fast], sign * trace.force_residual[fast], sign


def _along(wheels: Sequence[Trace], coulomb: float) -> tuple[float, float]:
    """Slope of what is missing over position times the covered stroke, over F_C; deviation by leaving wheels out."""
    parts = [_sliding(trace)[:2] for trace in wheels]
    places = np.concatenate([y for y, _ in parts])
    reach = float(np.ptp(places)) / coulomb

    def slope(chosen: Sequence[tuple[Array, Array]]) -> float:
        y, rest = (np.concatenate(rows) for rows in zip(*chosen, strict=True))
        return float(np.polyfit(y, rest, 1)[0])

    count = len(parts)
    left_out = np.array([slope(parts[:k] + parts[k + 1 :]) for k in range(count)])
    deviation = math.sqrt((count - 1) / count * float(np.sum((left_out - left_out.mean()) ** 2)))
    return reach * slope(parts), reach * deviation


def _directions(wheels: Sequence[Trace], coulomb: float) -> tuple[float, float]:
    """Mean of what is missing forwards minus that backwards, over F_C; deviation from the wheels' scatter."""
    means: dict[float, list[float]] = {1.0: [], -1.0: []}
    for trace in wheels:
        _, rest, sign = _sliding(trace)
        means[sign].append(float(np.mean(rest)) / coulomb)
    if min(map(len, means.values())) < 2:
        return math.nan, math.nan
    variance = sum(float(np.var(one, ddof=1)) / len(one) for one in means.values())
    return float(np.mean(means[1.0]) - np.mean(means[-1.0])), math.sqrt(variance)


def _recoil(trace: Trace) -> tuple[float, float]:
    """Largest speed against the motion, measured (position differentiated) and simulated, m/s."""
    sign = math.copysign(1.0, float(trace.y_measured[-1] - trace.y_measured[0]))
    return max(0.0, -float(np.min(sign * trace.velocity_measured))), max(
        0.0, -float(np.min(sign * trace.velocity_simulated))
    )


def _drift(trace: Trace) -> float:
    """Straight line through the measured position, end minus beginning, m."""
    return float(np.polyfit(trace.t, trace.y_measured, 1)[0] * np.ptp(trace.t))


def shut_k(pair: MagnetPair, pole_pitch: float, gap: float) -> float:
    """The ratio k (17) of the Gaussian next to a pair of magnets as long as the pole pitch (m), at an air gap of `gap`
    pole pitches: neighbours touch."""
    magnet = replace(pair.magnet, size_y=pole_pitch)
    return fit_gaussian(MagnetPair(magnet, gap * pole_pitch)).sigma_y / pole_pitch


def coil_forces(winding: Winding, spacing: float) -> tuple[float, float]:
    """Force along the guideway of a coil on its neighbour `spacing` m away and of that on the coil, N per squared
    ampere: Biot and Savart's field of each along the other's wires."""
    own, other = (_wires(winding, shift) for shift in ((0.0, 0.0), (spacing, _LAYER)))
    scale = winding.turns**2 * _MU_0 / (4.0 * math.pi)
    return scale * _force(own, other), scale * _force(other, own)


def _wires(winding: Winding, shift: tuple[float, float]) -> tuple[Array, Array]:
    """Middles and vectors (4 n, 3) m of the pieces of a rectangular turn, moved along y and z."""
    x, y = 0.5 * winding.length_x, 0.5 * winding.length_y
    corners = np.array([[x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0], [-x, -y, 0.0], [x, -y, 0.0]])
    corners += np.array([0.0, *shift])
    share = np.linspace(0.0, 1.0, _PIECES + 1)[:, None]
    sides = [a + share * (b - a) for a, b in pairwise(corners)]
    return np.concatenate([0.5 * (s[1:] + s[:-1]) for s in sides]), np.concatenate([np.diff(s, axis=0) for s in sides])


def _force(source: tuple[Array, Array], target: tuple[Array, Array]) -> float:
    """y component of sum dl x (dl' x r) / r^3 over the wires of target and source, dimensionless."""
    field = np.zeros_like(target[0])
    for middle, piece in zip(*source, strict=True):
        apart = target[0] - middle
        field += np.cross(piece, apart) / np.linalg.norm(apart, axis=1)[:, None] ** 3
    return float(np.sum(np.cross(target[1], field)[:, 1]))
