"""Which shape of the theta motor's field the search begins with: a look over nome and winding length.

Currents that sum to zero cancel the third harmonic of the thrust, and below a nome of about 0.8 nothing is left of the
fifth: all shapes push alike there, and a local search that begins on this plain never learns of the narrow magnets
beyond its edge.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from scipy.ndimage import convolve1d

from linid.arrays import Array
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import levenberg_marquardt
from linid.identification.settings import Ending
from linid.identification.space.search_space import SearchSpace
from linid.physics.field.winding import theta_harmonic

# Magnets of like width have one valley of the misfit; below the first all shapes push alike.
_NOMES = ((0.75, 0.82, 0.86, 0.89), (0.92, 0.95, 0.97))
_LENGTHS = tuple(np.linspace(0.1, 0.25 * math.pi, 15))  # a coil longer than the pole pitch pushes like a shorter one
_TURNS = (-0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15)  # of the shift
_ORDERS = (1, 3, 5, 7, 9, 11)


def field_shapes(space: SearchSpace, balance: Acceleration, values: dict[str, float]) -> list[dict[str, float]]:
    """Values with the shapes of field, one for each kind of magnets, that leave least of the force balance.

    balance: force balance along the measured motion of driven recordings; values: SI, refined on it. The first
    harmonic of the thrust is kept while the shapes are looked at; the field's phase is not, for commutated currents
    tell it badly and its error counts five times in the fifth harmonic. None where the shape is known or has no part.
    """
    if not {"force_constant", "nome", "winding_length", "commutation_offset"} <= set(space.names):
        return []
    problem = Problem(space, (balance,))
    cost = Cost(problem)
    waves = _thrust_waves(balance, values)
    before = problem.residuals(space.encode(values)[None, :], np.zeros((1, 0)))[0][0]
    own = _amplitudes(values["nome"], values["winding_length"])
    without = before - values["force_constant"] * own @ waves[_TURNS.index(0.0)]
    first = values["force_constant"] * own[0]
    found = []
    for nomes in _NOMES:
        shapes = list(product(_TURNS, nomes, _LENGTHS))
        rows = np.array(
            [without + first * _relative(nome, length) @ waves[_TURNS.index(turn)] for turn, nome, length in shapes]
        )
        turn, nome, length = shapes[int(np.argmin(cost.of_residuals([rows])))]
        constant = first / float(_amplitudes(nome, length)[0])
        best = {
            "nome": nome,
            "winding_length": length,
            "force_constant": constant,
            "commutation_offset": values["commutation_offset"] + turn,
        }
        solution = levenberg_marquardt(
            problem, cost, space.encode({**values, **best}), ending=Ending(40, 0.1, 0.4), final=False, bend=False
        )
        vector = space.vectors(solution.point)[0]
        found.append({p.name: float(vector[space.model.slot(p.name)]) for p in space.model.parameters})
    return found


def _amplitudes(nome: float, length: float) -> Array:
    """Harmonics of the thrust over the theta force constant, by `_ORDERS` (37)."""
    return np.array([theta_harmonic(n, nome, length) for n in _ORDERS])


def _relative(nome: float, length: float) -> Array:
    amplitudes = _amplitudes(nome, length)
    return np.asarray(amplitudes / amplitudes[0])


def _thrust_waves(balance: Acceleration, values: dict[str, float]) -> Array:
    """Acceleration by one newton per ampere in each harmonic, for each turn of the shift, as the balance sees it.

    (turns, orders, N) m/s^2.
    """
    recordings, y = balance.recordings, balance.motion.y
    mass = np.concatenate([np.full(r.t.size, values["mass"] + r.added_mass) for r in recordings])
    currents = np.concatenate([r.phase_currents for r in recordings if r.phase_currents is not None], axis=1)
    out = np.empty((len(_TURNS), len(_ORDERS), balance.rows.size))
    for (t, turn), (h, order) in product(enumerate(_TURNS), enumerate(_ORDERS)):
        z = values["electrical_wavenumber"] * y + values["commutation_offset"] + turn
        spaced = np.multiply.outer((-1.0, 0.0, 1.0), np.full(y.size, values["winding_displacement"]))
        thrust = np.sum(np.sin(2.0 * order * (z + spaced)) * currents, axis=0) / mass
        at = 0
        for recording, kernel in zip(recordings, balance.kernels, strict=True):
            part = slice(at, at + recording.t.size)
            thrust[part] = convolve1d(thrust[part], kernel)
            at += recording.t.size
        out[t, h] = thrust[balance.rows]
    return out
