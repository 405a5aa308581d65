"""The problems that every peer is given: recordings, start states, bounds and one cost.

friction: LuGre and the mass from whole free wheels. sine, theta: a motor with known friction, from pieces of 0.1 s of
driven recordings. The cost is the RMS of simulated minus measured position over all samples, in m.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from linid.identification.guess.first_values import first_values
from linid.identification.optimise.time_step import choose_substeps
from linid.identification.settings import FitSettings
from linid.identification.signals.motion import measure_motion
from linid.identification.space.bounds import build_space
from linid.identification.space.search_space import SearchSpace
from linid.physics import friction
from linid.physics.model import Model
from linid.recording.campaign import read_campaign
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings

Array = NDArray[np.float64]
Simulation = Callable[[dict[str, float]], Array]

STAND = Path(__file__).parents[3] / "data" / "stand"
NAMES = ("friction", "sine", "theta")
DRIVEN = ("sine_current_2", "sine_position_1", "moves_1")  # one of each kind of motion
PIECE = 0.1  # s, after which a driven simulation starts anew from the measured state
EVERY = 2  # of the pieces that is used: with fewer the shape of the field is not determined
LOST = 1.0  # m, the cost of a simulation that failed


@dataclass(frozen=True)
class Problem:
    """sources: recordings as measured; recordings: what is simulated (pieces of them for motors); states: (R, 3)
    start y in m, v in m/s, bristle w in m (nan: that of steady sliding); space: what is searched, with its bounds;
    first: linid's first guess; densities: its candidates of the electrical wavenumber; substeps: linid's internal
    steps."""

    name: str
    sources: tuple[Recording, ...]
    recordings: tuple[Recording, ...]
    states: Array
    space: SearchSpace
    first: dict[str, float]
    densities: tuple[float, ...]
    substeps: int

    @property
    def measured(self) -> Array:
        """Measured positions of all recordings in one row (N,), m."""
        return np.concatenate([r.y for r in self.recordings])

    @property
    def dimension(self) -> int:
        """Number of searched parameters."""
        return len(self.space.parameters)

    def values(self, x: Array) -> dict[str, float]:
        """A point of the unit cube (p,) -> SI values of all parameters; logarithmic where linid searches so."""
        vector = self.space.vectors(np.clip(np.asarray(x, dtype=float), 0.0, 1.0))[0]
        return {p.name: float(vector[self.space.model.slot(p.name)]) for p in self.space.model.parameters}

    def starts(self, values: dict[str, float]) -> Array:
        """Start states (R, 3) of a candidate."""
        out = self.states.copy()
        sliding = np.isnan(out[:, 2])
        for row in np.flatnonzero(sliding):
            out[row, 2] = steady_bristle(values, out[row, 1])
        return out

    def errors(self, simulate: Simulation, x: Array) -> Array:
        """Simulated minus measured position (N,) in m at a point of the unit cube; LOST where it failed."""
        return np.nan_to_num(
            np.clip(simulate(self.values(x)) - self.measured, -LOST, LOST), nan=LOST, posinf=LOST, neginf=LOST
        )

    def cost(self, simulate: Simulation, x: Array) -> float:
        """RMS position error in m."""
        return rms(self.errors(simulate, x))


def rms(errors: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(errors**2)))


def steady_bristle(values: dict[str, float], v: float) -> float:
    """Bristle deflection in m of steady sliding at v in m/s."""
    decay = math.exp(-(abs(v / values["stribeck_velocity"]) ** values["stribeck_exponent"]))
    level = values["coulomb_force"] + (values["static_force"] - values["coulomb_force"]) * decay
    return math.copysign(level / values["bristle_stiffness"], v) if v else 0.0


def truth() -> dict[str, float]:
    """SI values with which the stand was generated."""
    return {k: float(v) for k, v in yaml.safe_load((STAND / "truth.yaml").read_text())["parameters"].items()}


@cache
def make_problem(name: str) -> Problem:
    """One of NAMES, from the recordings in data/stand; takes a few seconds for motors."""
    campaign = read_campaign(STAND / "campaign.yaml")
    fitted = [r for r in campaign.recordings if r.split == "fit"]
    if name == "friction":
        sources = tuple(r for r in fitted if r.kind == "free_wheel")
        return _assemble(name, sources, sources, _first_samples(sources), {})
    sources = tuple(r for r in fitted if r.name in DRIVEN)
    known = {p.name: truth()[p.name] for p in friction.PARAMETERS}
    recordings, states = _pieces(sources, known)
    return _assemble(name, sources, recordings, states, known)


def linid_simulation(problem: Problem, substeps: int | None = None) -> Callable[[Array], Array]:
    """Flat parameter vectors (C, VECTOR_SIZE) -> positions (C, N) in m by linid."""
    simulator = Simulator(problem.space.model, pack_inputs(problem.recordings), substeps or problem.substeps)
    segments = whole_recordings(simulator.inputs)

    def simulate(vectors: Array) -> Array:
        starts = np.tile(problem.states, (vectors.shape[0], 1, 1))
        return simulator.run(vectors, segments, starts)[0]

    return simulate


def judge(problem: Problem) -> Callable[[Array], float]:
    """The one cost by which all results are compared: linid's simulation with an eighth of its usual step."""
    fine = linid_simulation(problem, 8 * problem.substeps)

    def cost(x: Array) -> float:
        return problem.cost(lambda values: fine(problem.space.model.vector(values)[None, :])[0], x)

    return cost


def _assemble(
    name: str, sources: tuple[Recording, ...], recordings: tuple[Recording, ...], states: Array, known: dict[str, float]
) -> Problem:
    model = Model(name)
    first, densities = first_values(model, sources, known, None)
    settings = FitSettings()
    space = build_space(model, sources, first, known, settings.bounds, settings.free_exponent, densities)
    substeps = choose_substeps(model, sources, first)
    if name == "friction":
        substeps = max(substeps, 4)  # as linid's own objective of free runs takes
    return Problem(name, sources, recordings, states, space, first, densities, substeps)


def _first_samples(recordings: tuple[Recording, ...]) -> Array:
    rows = []
    for recording in recordings:
        motion = measure_motion([recording])
        rows.append([motion.y[0], motion.v[0], math.nan])
    return np.array(rows)


def _pieces(sources: tuple[Recording, ...], known: dict[str, float]) -> tuple[tuple[Recording, ...], Array]:
    """Recordings of PIECE seconds with their measured start states; the bristle follows the measured speed."""
    model = Model("friction")
    pieces, states = [], []
    for source in sources:
        motion = measure_motion([source])
        simulator = Simulator(model, pack_inputs([replace(source, phase_currents=None)]))
        along = simulator.along(
            model.vector(known)[None, :], motion.y, motion.v, motion.standstill, np.full((1, 1), math.nan)
        )
        length = round(PIECE / source.period)
        for begin in range(0, source.t.size - length, EVERY * length):
            part = slice(begin, begin + length + 1)
            assert source.phase_currents is not None
            pieces.append(
                replace(
                    source,
                    name=f"{source.name}_{begin}",
                    t=source.t[part].copy(),
                    y=source.y[part].copy(),
                    v=None,
                    phase_currents=source.phase_currents[:, part].copy(),
                    drive_input=None,
                )
            )
            states.append([motion.y[begin], motion.v[begin], along.bristle[0, begin]])
    return tuple(pieces), np.array(states)
