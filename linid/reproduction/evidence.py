"""What the fits of the stand say to the paper's claims: times, searches, gaps, drifts, signs. Numbers, no words."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from linid.arrays import Array
from linid.diagnosis.gap import RecordingGap, Trace
from linid.diagnosis.measures import model_of
from linid.identification.result import FitResult
from linid.kernel_cache import kept
from linid.physics.motors.harmonics import phase_force, phase_steps
from linid.physics.motors.motor import MAX_HARMONICS, PHASE_PARAMETERS
from linid.physics.theta import big_theta_0
from linid.recording.recording import Recording
from linid.reproduction.printed import TABLE_2, meant
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings

_REPEATS = 15  # of each timing; sine and theta take turns
_CANDIDATES = 8  # simulated at once, so that calling costs nothing
_FORCES = 20_000
_NEAR = 1.01  # of the final cost: when a search has as good as arrived


@dataclass(frozen=True)
class Measured:
    """A motor model on a recording: its gap, and how far its free run has drifted at the end (m, signed)."""

    gap: RecordingGap
    drift: float


@dataclass(frozen=True)
class Fitted:
    """A fitted motor model: its result and what it makes of recordings, by name."""

    result: FitResult
    measured: Mapping[str, Measured]


@dataclass(frozen=True)
class Times:
    """Seconds of one simulation of `recording` by sine and theta (medians, taken in turns), and two ratios.

    ratio: theta over sine; term_by_term: theta's force with every series summed as printed in (45), over sine's.
    """

    recording: str
    sine: float
    theta: float
    ratio: float
    term_by_term: float


@dataclass(frozen=True)
class Search:
    """generations: until the cost was within 1 % of the search's last; all: run; evaluations: with the least
    squares."""

    generations: int
    all: int
    evaluations: int


@dataclass(frozen=True)
class Signs:
    """Relative RMS differences of thrust for random currents that sum to zero.

    negated: K_f turned negative and the shift moved by half a turn; exchanged: currents 1 and 3 exchanged and
    alpha_p turned negative; exchanged_negated: currents exchanged, K_f turned negative, the shift free.
    """

    negated: float
    exchanged: float
    exchanged_negated: float


def measured_of(gaps: Sequence[RecordingGap], traces: Sequence[Trace]) -> dict[str, Measured]:
    """Gaps with the drift of their free runs, by recording."""
    drift = {trace.recording: float(trace.y_simulated[-1] - trace.y_measured[-1]) for trace in traces}
    return {gap.recording: Measured(gap, drift[gap.recording]) for gap in gaps}


def search_of(result: FitResult) -> Search:
    """How long the global search of a fit took; zeros for a model that no search made."""
    if not result.history:
        return Search(0, 0, 0)
    stages = [list(lines) for _, lines in groupby(result.history, key=lambda line: line.stage)]
    first = stages[0]
    arrived = next(line.generation for line in first if line.best <= _NEAR * first[-1].best)
    return Search(arrived, first[-1].generation, result.evaluations)


def simulation_times(sine: FitResult, theta: FitResult, recording: Recording) -> Times:
    """Time of one simulation by each of two fitted motors on the same recording, and the cost of (45) as printed."""
    inputs = pack_inputs((recording,))
    segments = whole_recordings(inputs)
    start = np.array([[[recording.y[0], 0.0, 0.0]]]).repeat(_CANDIDATES, axis=0)

    def run(result: FitResult) -> Callable[[], object]:
        model, vector = model_of(result)
        simulator = Simulator(model, inputs, max(sine.substeps, theta.substeps), 1)
        vectors = np.repeat(vector, _CANDIDATES, axis=0)
        return lambda: simulator.run(vectors, segments, start)

    one, other = _in_turns(run(sine), run(theta))
    forces = _in_turns(_force_loop(sine, printed=False), _force_loop(theta, printed=True))
    ratio = statistics.median(b / a for a, b in zip(one, other, strict=True))
    each = [statistics.median(times) / _CANDIDATES for times in (one, other)]
    written = statistics.median(b / a for a, b in zip(*forces, strict=True))
    return Times(recording.name, each[0], each[1], ratio, written)


def _in_turns(first: Callable[[], object], second: Callable[[], object]) -> tuple[list[float], list[float]]:
    first(), second()  # compile
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(_REPEATS):
        for task, taken in zip((first, second), times, strict=True):
            began = time.process_time()
            task()
            taken.append(time.process_time() - began)
    return times


def _force_loop(result: FitResult, *, printed: bool) -> Callable[[], float]:
    """Evaluates the motor's force over and over. printed: theta by its six series per force (45), not by harmonics."""
    values = {e.name: e.value for e in result.estimates}
    place = np.array([values[name] for name in PHASE_PARAMETERS])
    if printed:
        length, nome = values["winding_length"], values["nome"]
        return lambda: float(_forces_as_printed(_FORCES, place, length, nome))
    table = np.zeros((3, MAX_HARMONICS))
    table[0, 0] = 1.0
    phase_steps(table, 1, place[0], 1.0, place[2])
    return lambda: float(_forces_by_table(_FORCES, place, table))


@kept()
def _forces_as_printed(number: int, place: Array, length: float, nome: float) -> float:
    total = 0.0
    constant, wavenumber, step, offset = place[0], place[1], place[2], place[3]
    for k in range(number):
        z = wavenumber * 1e-5 * k + offset
        total += constant * (
            big_theta_0(z - step, length, nome) * 0.3
            + big_theta_0(z, length, nome) * 0.5
            - big_theta_0(z + step, length, nome) * 0.8
        )
    return total


@kept()
def _forces_by_table(number: int, place: Array, table: Array) -> float:
    total = 0.0
    for k in range(number):
        total += phase_force(1e-5 * k, 0.3, 0.5, -0.8, place[1], place[3], table, 1)
    return total


def sine_thrust(values: Mapping[str, float], y: Array, currents: Array) -> Array:
    """Thrust (n,) N of a sine motor at positions y (n,) m under phase currents (3, n) A (44)."""
    angle = values["electrical_wavenumber"] * y + values["commutation_offset"]
    spaced = np.multiply.outer((-1.0, 0.0, 1.0), np.full(y.size, values["winding_displacement"]))
    return np.asarray(values["force_constant"] * np.sum(np.sin(angle + spaced) * currents, axis=0))


def signs_of(values: Mapping[str, float], seed: int) -> Signs:
    """What a negative force constant and an inverted phase order do to the thrust of a sine motor (SI values)."""
    random = np.random.default_rng(seed)
    y = random.uniform(0.0, 20.0 * math.pi / values["electrical_wavenumber"], 2000)
    currents = random.normal(size=(3, y.size))
    currents -= currents.mean(axis=0)
    true = sine_thrust(values, y, currents)

    def differs(changed: Mapping[str, float], fed: Array) -> float:
        return float(np.linalg.norm(sine_thrust(changed, y, fed) - true) / np.linalg.norm(true))

    negated = {**values, "force_constant": -values["force_constant"]}
    turned = {**negated, "commutation_offset": values["commutation_offset"] + math.pi}
    mirrored = {**values, "winding_displacement": -values["winding_displacement"]}
    exchanged = currents[::-1]
    shifts = np.linspace(0.0, 2.0 * math.pi, 721)
    least = min(differs({**negated, "commutation_offset": float(shift)}, exchanged) for shift in shifts)
    return Signs(differs(turned, currents), differs(mirrored, exchanged), least)


def thrust_range(values: Mapping[str, float]) -> tuple[float, float]:
    """Least and largest thrust over position in N that 1 A (peak) of three-phase currents can give a sine motor."""
    place = np.linspace(0.0, 2.0 * math.pi / values["electrical_wavenumber"], 721)
    best = np.zeros(place.size)
    for turn in np.linspace(0.0, 2.0 * math.pi, 720, endpoint=False):
        currents = np.cos(turn - 2.0 * math.pi / 3.0 * np.array([-1.0, 0.0, 1.0]))
        best = np.maximum(best, np.abs(sine_thrust(values, place, np.repeat(currents[:, None], place.size, axis=1))))
    return float(best.min()), float(best.max())


def table_2_thrust() -> tuple[float, float]:
    """The range of `thrust_range` of the motor in the paper's table 2."""
    return thrust_range(meant(TABLE_2))
