"""Where the time of the compiled simulation goes: `python -m tests.benchmarks.kernel [--json FILE] [--quick]`.

Times are the least processor time of many runs, so that others disturb little; nothing here passes or fails. Cycles
are times by the measured clock. Operations and the longest dependency chain come from the kernel's own source, run in
plain Python (operations.py), instructions from single steps of a traced process where the system allows it.
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
from numba import njit
from scipy.stats import spearmanr

from linid.identification.optimise.time_step import choose_substeps
from linid.physics.model import Model
from linid.physics.motors.harmonics import sine_cosine
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import REVERSAL_TOLERANCE, Segments, Simulator, whole_recordings
from tests.benchmarks.__main__ import as_sine, exact_recording
from tests.benchmarks.instructions import addresses, available
from tests.benchmarks.operations import KINDS, count, in_float32
from tests.identification.stand import FREE_WHEELS, stand

DRIVEN = ("sine_position_1", "sine_position_2", "sine_position_3", "sine_current_2")
LONGEST = 100  # samples of a window
FEW = 12  # windows of which the operations are counted
SHORT = 400  # samples of the comparison of float32 with float64
STEPS = 500
CHAINS = 10  # independent ones, enough to keep every unit busy
REPEATED = 20_000
GROUPS = {"divisions": ("divide",), "exp": ("exp",), "sin and cos": ("sin", "cos"), "square roots": ("sqrt",)}


@dataclass(frozen=True)
class Case:
    """Windows of one kind of motion: name, simulator, (VECTOR_SIZE,) parameters, S windows, (1, S, 3) their starts."""

    name: str
    simulator: Simulator
    vector: Any
    segments: Segments
    starts: Any

    def call(self) -> Callable[[], int]:
        """The call of the compiled kernel that simulates all windows and returns the internal steps."""
        caught: list[Any] = []

        class Catcher(Simulator):
            def _goes_in_lanes(self, guided: bool) -> bool:
                return False

            def _kernel(self) -> Any:
                return SimpleNamespace(simulate_tasks=lambda *arguments: caught.append(arguments) or 0)

        catcher = Catcher(self.simulator.model, self.simulator.inputs, self.simulator.substeps)
        catcher.run(self.vector[None], self.segments, self.starts)
        kernel: Any = self.simulator._kernel()
        return lambda: kernel.simulate_tasks(*caught[0])

    def part(self, windows: int, samples: int) -> Case:
        """The case with its first windows only, of at most so many samples."""
        s = self.segments
        segments = Segments(s.recording[:windows], s.first[:windows], np.minimum(s.count[:windows], samples))
        return replace(self, segments=segments, starts=self.starts[:, :windows])

    @property
    def samples(self) -> int:
        return int((self.segments.count - 1).sum())

    def separate(self) -> list[dict[str, Any]]:
        """What the kernel takes for each window by itself."""
        inputs = self.simulator.inputs
        out = []
        for s, r in enumerate(self.segments.recording):
            a = inputs.offsets[r] + self.segments.first[s]
            out.append(
                {
                    "params": self.vector,
                    "motor": self.simulator.model.motor,
                    "powered": bool(inputs.powered[r]),
                    "coefficients": inputs.coefficients[a : a + self.segments.count[s] - 1],
                    "zero": 0.0,
                    "dt": float(inputs.dts[r]),
                    "added_mass": float(inputs.added_mass[r]),
                    "start": self.starts[0, s],
                    "substeps": self.simulator.substeps,
                    "tolerance": REVERSAL_TOLERANCE / self.simulator.substeps**2,
                }
            )
        return out


def least(function: Callable[[], object], seconds: float) -> float:
    """Least processor time in s of calls that are repeated for `seconds`, at least thrice."""
    best, calls, end = math.inf, 0, time.perf_counter() + seconds
    while calls < 3 or time.perf_counter() < end:
        begin = time.thread_time()
        function()
        best = min(best, time.thread_time() - begin)
        calls += 1
    return best


def windows(mask: Any) -> list[tuple[int, int]]:
    """First sample and number of samples of every stretch of at least two samples where mask (n,) holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return [(a, min(b - a, LONGEST)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1]


def cases(kind: str) -> list[Case]:
    """Windows of the free run of whole recordings: all of it, fast sliding, and speeds at which the bristle moves."""
    campaign = stand()
    values = as_sine(campaign.truth) if kind == "sine" else campaign.truth
    wheels = [r for r in campaign.recordings if r.name in FREE_WHEELS]
    recordings = wheels if kind == "friction" else [exact_recording(name) for name in DRIVEN]
    model = Model(kind)
    simulator = Simulator(model, pack_inputs(recordings), choose_substeps(model, recordings, values))
    vector, whole = model.vector(values), whole_recordings(simulator.inputs)
    starts = np.array([[[r.y[0], campaign.exact[r.name].v[0], math.nan] for r in recordings]])
    y, v, _ = simulator.run(vector[None], whole, starts, velocity=True)
    fast = values["stribeck_velocity"] * 40.0**0.5  # the kernel's border between sliding and following
    out = [Case("whole", simulator, vector, whole, starts)]
    for name, lower, upper in (("sliding", 1.5 * fast, math.inf), ("followed", 1e-6, fast)):
        found, begins = [], []
        for r, offset in enumerate(whole.out_offsets[:-1]):
            speed = v[0, offset : offset + whole.count[r]]
            for first, size in windows((np.abs(speed) > lower) & (np.abs(speed) < upper)):
                found.append((r, first, size))
                begins.append([y[0, offset + first], speed[first], math.nan])
        segments = Segments(*np.array(found, dtype=np.int64).T.copy())
        out.append(Case(name, simulator, vector, segments, np.array([begins])))
    return out


@njit(error_model="numpy")
def _mixed(n: int, x: Any) -> Any:
    for _ in range(n):  # no compiler shortens this chain: three dependent operations of one cycle
        x = (x ^ (x >> np.uint64(7))) + np.uint64(0x9E3779B97F4A7C15)
    return x


def clock(seconds: float) -> float:
    """Cycles per second at which this process runs."""
    begin = np.uint64(1)
    _mixed(1, begin)
    return 3.0 * 20_000 / least(lambda: _mixed(20_000, begin), seconds)


def _chains(expression: str, number: int) -> Any:
    """A compiled function that repeats `expression` of x and c in `number` independent chains."""
    names = [f"x_{k}" for k in range(number)]
    body = "".join(f"        {x} = " + re.sub(r"\bx\b", x, expression) + "\n" for x in names)
    starts = "".join(f"    {x} = x + {k}.0\n" for k, x in enumerate(names))
    text = f"def repeated(n, x, c):\n{starts}    for _ in range(n):\n{body}    return {' + '.join(names)}\n"
    made: dict[str, Any] = {"math": math}
    exec(text, made)
    return njit(error_model="numpy")(made["repeated"])


def operation_costs(cycles_per_second: float, seconds: float) -> dict[str, dict[str, float]]:
    """Latency and reciprocal throughput in cycles of each operation, in loops of their own."""
    expressions = {
        "add": ("x + c", 1e-3, 0),
        "multiply": ("x * c", 1.0 - 1e-9, 0),
        "divide": ("c / x", 7.0, 0),
        "sqrt": ("math.sqrt(x + c)", 1.0, 1),
        "exp": ("math.exp(c - x)", 0.5, 1),
        "sin": ("math.sin(x + c)", 50.0, 1),
        "cos": ("math.cos(x + c)", 50.0, 1),
    }
    out = {}
    for name, (expression, c, additions) in expressions.items():
        both = []
        for number in (1, CHAINS):
            function = _chains(expression, number)
            function(1, 1.0, c)
            taken = least(lambda f=function, c=c: f(REPEATED, 1.0, c), seconds)
            both.append(taken * cycles_per_second / (REPEATED * number))
        if additions:
            both = [cost - out["add"][key] for cost, key in zip(both, ("latency", "throughput"), strict=True)]
        out[name] = {"latency": both[0], "throughput": both[1]}
    return out


def copy_bandwidth(seconds: float) -> float:
    """Bytes per second that a copy of 64 MB reads and writes together."""
    source = np.zeros(8_000_000)
    target = np.ones_like(source)
    return 2.0 * source.nbytes / least(lambda: np.copyto(target, source), seconds)


def profile(case: Case, costs: dict[str, dict[str, float]], seconds: float, frequency: float) -> dict[str, Any]:
    """Times of one case; for windows of one kind, operations per step and what they allow at least, in cycles."""
    call, empty = case.call(), case.part(len(case.segments.count), 1).call()
    steps = call()
    empty()
    taken = least(call, seconds) - least(empty, 0.3 * seconds)
    row: dict[str, Any] = {
        "samples": case.samples,
        "steps": steps,
        "ns per sample": taken / case.samples * 1e9,
        "ns per step": taken / steps * 1e9,
        "cycles per step": taken / steps * frequency,
    }
    if case.name == "whole":
        return row
    latency = {kind: costs[kind]["latency"] if kind in costs else 1.0 for kind in KINDS}
    few = case.part(FEW, LONGEST)
    counted = count(few.separate(), latency)
    steps = few.call()()
    assert counted["steps"] == steps
    operations = {kind: number / steps for kind, number in counted["operations"].items()}
    row |= {name: counted[name] / steps for name in ("followed", "rejected", "predictors")}
    row |= {"operations": operations, "chain": counted["chain"] / steps, "arithmetic": arithmetic(operations, costs)}
    row["measured / limit"] = row["cycles per step"] / max(row["chain"], row["arithmetic"])
    for name, kinds in GROUPS.items():
        if any(operations[kind] for kind in kinds):
            without = count(few.separate(), {**latency, **dict.fromkeys(kinds, 0.0)})["chain"] / steps
            spent = sum(operations[kind] * costs[kind]["throughput"] for kind in kinds)
            row[f"of {name}"] = {"in the chain": row["chain"] - without, "in throughput": spent}
    return row


def arithmetic(operations: dict[str, float], costs: dict[str, dict[str, float]]) -> float:
    """Cycles that the operations keep the busiest unit: the divider, or what calculates everything else."""
    spent = {kind: operations[kind] * costs[kind]["throughput"] for kind in costs}
    functions = spent["exp"] + spent["sin"] + spent["cos"]
    return max(spent["divide"] + spent["sqrt"], functions + max(spent["add"], spent["multiply"]))


def instructions(case: Case) -> float | None:
    """Instructions per step, from two runs of different length; None where they cannot be counted."""
    if not available():
        return None
    windows, samples = (1, (4, 24)) if case.name == "sliding" else (2, (1, LONGEST))
    short, long = case.part(windows, samples[0]).call(), case.part(windows, samples[1]).call()
    steps = long() - short()
    counted = [addresses(call) for call in (short, long)]
    if counted[0] is None or counted[1] is None:
        return None
    return (len(counted[1]) - len(counted[0])) / steps


@njit(error_model="numpy")
def _lanes(n: int, y: Any, v: Any, force: Any, p: Any, current: float, sine: Any, cosine: Any) -> None:
    """n sliding steps of several independent axes, the inner loop without branches, so that it can become vectors."""
    mass, viscous, coulomb, constant, wavenumber, h = p[0], p[1], p[2], p[3], p[4], p[5]
    z = -viscous * h / mass
    third = 1.0 / 6.0 + z * (1.0 / 24.0 + z * (1.0 / 120.0 + z / 720.0))
    second = 0.5 + z * third
    first = 1.0 + z * second
    for _ in range(n):
        for j in range(y.size):
            v_mid = v[j] + 0.5 * h * (force[j] - coulomb - viscous * v[j]) / mass
            y_mid = y[j] + 0.25 * h * (v[j] + v_mid)
            y_end = y[j] + h * v_mid
            sine[j], cosine[j] = sine_cosine(wavenumber * y_mid)
            force_mid = constant * (sine[j] * current + cosine[j] * current)
            sine[j], cosine[j] = sine_cosine(wavenumber * y_end)
            force_end = constant * (sine[j] * current + cosine[j] * current)
            rise = force_end - force[j]
            mean = (force[j] + 4.0 * force_mid + force_end) / 6.0
            v_rate = (mean - coulomb - 0.5 * rise - viscous * v[j]) / mass
            jerk = rise / mass
            y[j] += h * (v[j] + h * (second * v_rate + third * jerk))
            v[j] += h * (first * v_rate + second * jerk)
            force[j] = force_end


def lanes(seconds: float) -> dict[str, float]:
    """ns per sliding step and axis of a bare sine motor, by the number of independent axes carried side by side."""
    out = {}
    p = np.array([0.588, 2.517, 1.72, 30.0, 222.0, 5e-4])
    for number in (1, 2, 4, 8, 16, 32):

        def call(number: int = number) -> None:
            y, v, force, sine, cosine = (np.full(number, value) for value in (0.1, 0.4, 0.0, 0.0, 0.0))
            _lanes(STEPS, y, v, force, p, 0.1, sine, cosine)

        call()
        out[str(number)] = least(call, seconds) / STEPS / number * 1e9
    return out


def float32_ranking(number: int) -> dict[str, float]:
    """How the costs (RMS position errors) of candidates rank in float32 against float64, near and far from the best."""
    campaign = stand()
    recording = exact_recording("sine_position_1")
    recording = replace(
        recording, t=recording.t[:SHORT], y=recording.y[:SHORT], phase_currents=recording.phase_currents[:, :SHORT]
    )
    model = Model("theta")
    simulator = Simulator(model, pack_inputs([recording]), 2)
    random = np.random.default_rng(1)
    out = {}
    for spread in (0.1, 1e-3, 1e-5):
        truth = model.vector(campaign.truth)
        vectors = truth * (1.0 + spread * random.standard_normal((number, truth.size)))
        start = np.array([[[recording.y[0], campaign.exact[recording.name].v[0], math.nan]]])
        costs = []
        for vector in vectors:
            case = Case("one", simulator, vector, whole_recordings(simulator.inputs), start)
            y = simulator.run(vector[None], case.segments, start)[0][0]
            single = in_float32(case.separate()[0])
            costs.append([float(np.sqrt(np.mean((run - recording.y) ** 2))) for run in (y, single.astype(float))])
        double, single = np.nan_to_num(np.array(costs).T, nan=1e9)
        out[f"spread {spread:g}: rank correlation"] = float(spearmanr(double, single).statistic)
        out[f"spread {spread:g}: median cost, um"] = float(np.median(double)) * 1e6
        out[f"spread {spread:g}: median cost difference, um"] = float(np.median(np.abs(single - double))) * 1e6
    return out


def tables(quick: bool) -> dict[str, Any]:
    """All figures. quick: short measurements, free wheels and few candidates only, no instructions."""
    seconds = 0.02 if quick else 1.0
    frequency = clock(seconds)
    costs = operation_costs(frequency, seconds)
    bandwidth = copy_bandwidth(seconds)
    out: dict[str, Any] = {
        "machine": {
            "processor": processor(),
            "python": platform.python_version(),
            "numba": numba.__version__,
            "GHz": frequency / 1e9,
            "copy bandwidth, GB/s": bandwidth / 1e9,
        },
        "operations, cycles": costs,
    }
    for kind in ("friction",) if quick else ("theta", "sine", "friction"):
        for case in cases(kind):
            row = profile(case, costs, seconds, frequency)
            if not quick and case.name != "whole" and (number := instructions(case)) is not None:
                row["instructions per step"] = number
            # The splines of three inputs and of the position share cache lines; a free wheel reads none of them.
            read = 0 if kind == "friction" else case.simulator.inputs.coefficients[0].nbytes
            row |= {"bytes read per sample": read, "bytes written per sample": 8}
            row["share of bandwidth"] = (read + 8) / row["ns per sample"] * 1e9 / bandwidth
            out[f"{kind}, {case.name}"] = row
    out["independent axes side by side, ns per step and axis"] = lanes(seconds)
    out["float32"] = float32_ranking(4 if quick else 30)
    return out


def processor() -> str:
    """The processor's model, as far as the system tells it."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor()
    fields = dict(re.findall(r"^(model name|cpu family|model)\s*: (.*)$", text, re.M))
    return f"{fields.get('model name')}, family {fields.get('cpu family')}, model {fields.get('model')}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="also write the figures to this file")
    parser.add_argument("--quick", action="store_true", help="free wheels only, briefly, without instructions")
    options = parser.parse_args()
    found = tables(options.quick)
    for title, rows in found.items():
        print(title)
        for name, value in rows.items():
            print(f"  {name:<45} {shown(value)}")
    if options.quick or not available():
        print("Left out: instructions per step.")
    if options.json:
        options.json.write_text(json.dumps(found, indent=1), encoding="utf-8")


def shown(value: Any) -> str:
    """A figure or a row of figures as text."""
    if isinstance(value, dict):
        return "(" + ", ".join(f"{k} {shown(v)}" for k, v in value.items()) + ")"
    return value if isinstance(value, str) else f"{value:.4g}"


if __name__ == "__main__":
    main()
