"""EMPS in open loop, as a range: `python -m tests.benchmarks.emps [--draws N]` writes docs/emps.md.

One figure for an axis without a spring says little: its position is an integral of forces, so the score hangs on
parameters within their uncertainty, on the start, and on how friction stood on that day. Nothing passes or fails here.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from linid.identification.fit import fit
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.identification.signals.motion import measure_motion
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.simulation.inputs import pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from tests.identification.test_real_axes import DRIVE_GAIN, emps

Array = NDArray[np.float64]

PAGE = Path(__file__).parents[2] / "docs" / "emps.md"
EFFECTS = ("asymmetric_friction",)
SKIPPED = 20  # samples at the start that the benchmark's protocol does not score
WINDOW = 4.0  # s, of the output error and of the parts that are scored one by one
SEED = 1
_NUDGE = 0.05  # of the friction level, about what is asked for
SHOWN = ("mass", "coulomb_force", "viscous_friction", "friction_asymmetry", "viscous_asymmetry")
OBJECTIVES = {
    "force balance": FitSettings(objective="acceleration", search=SearchSettings(generations=30)),
    f"windows of {WINDOW:g} s": FitSettings(objective="ahead", horizon=WINDOW, search=SearchSettings(generations=5)),
}


@dataclass(frozen=True)
class Scores:
    """Open-loop scores in mm (1000 RMSE in m) of one fit under one start.

    best: with the fitted parameters; drawn: (draws,) with parameters from their covariance; parts: of the fitted
    parameters' run, in consecutive parts of `WINDOW`.
    """

    objective: str
    start: str
    best: float
    drawn: Array
    parts: Array

    @property
    def span(self) -> tuple[float, float]:
        """5th and 95th percentile over the draws, mm."""
        low, high = np.percentile(self.drawn, [5.0, 95.0])
        return float(low), float(high)


def fit_on(recording: Recording, settings: FitSettings) -> FitResult:
    """Force model with friction that knows the direction; the drive's gain is known (N/V)."""
    return fit("force", [recording], settings=settings, effects=EFFECTS, known={"force_constant": DRIVE_GAIN})


def draws_of(result: FitResult, count: int) -> Array:
    """Parameter vectors (count, VECTOR_SIZE) from the fit's covariance, on the logarithm for scale parameters."""
    model = Model(result.model, result.effects)
    values = {e.name: e.value for e in result.estimates}
    known = {p.name: p for p in model.parameters}
    deviations = np.sqrt(np.maximum(np.diag(result.covariance), 0.0))
    away = np.random.default_rng(SEED).multivariate_normal(np.zeros(deviations.size), result.correlation, count)
    out = np.repeat(model.vector(values)[None, :], count, axis=0)
    for k, name in enumerate(result.fitted):
        parameter, value = known[name], values[name]
        step = deviations[k] * away[:, k]
        drawn = value * np.exp(step / value) if parameter.log and value > 0.0 else value + step
        out[:, model.slot(name)] = np.clip(drawn, parameter.lower, parameter.upper)
    return out


def open_loop(model: Model, vectors: Array, recording: Recording, speed: float, substeps: int) -> Array:
    """Errors (C, n) in m of whole runs that the input alone drives from the first position and a speed in m/s."""
    simulator = Simulator(model, pack_inputs([recording]), substeps)
    starts = np.full((vectors.shape[0], 1, 3), np.nan)
    starts[:, 0, 0], starts[:, 0, 1] = recording.y[0], speed
    return simulator.run(vectors, whole_recordings(simulator.inputs), starts)[0] - recording.y


def score(errors: Array) -> Array:
    """1000 RMSE over the last axis, mm."""
    return np.asarray(1e3 * np.sqrt(np.mean(errors**2, axis=-1)))


def scores_of(objective: str, result: FitResult, held: Recording, starts: dict[str, float], draws: int) -> list[Scores]:
    """The held-out run's scores under every start."""
    model = Model(result.model, result.effects)
    best = model.vector({e.name: e.value for e in result.estimates})[None, :]
    out = []
    for name, speed in starts.items():
        errors = open_loop(model, np.vstack([best, draws_of(result, draws)]), held, speed, result.substeps)[:, SKIPPED:]
        length = round(WINDOW / held.period)
        parts = np.array([score(errors[0, a : a + length]) for a in range(0, errors.shape[1] - length // 2, length)])
        values = score(errors)
        out.append(Scores(objective, name, float(values[0]), values[1:], parts))
    return out


def friction_level(result: FitResult, recording: Recording) -> tuple[float, float]:
    """Change in N of the Coulomb force that the force balance of a recording asks for, all else as fitted, and its
    standard error, from the scatter of its parts of `WINDOW`: least squares along the change."""
    model = Model(result.model, (*EFFECTS, "friction_level_change"))
    one = replace(recording, number=1)
    values = {e.name: e.value for e in result.estimates} | {"friction_change_recordings": 1.0}
    vectors = np.stack([model.vector(values | {"friction_change": change}) for change in (0.0, _NUDGE)])
    part = Acceleration(model, (one,), 1)
    plain, nudged = part.residuals(vectors, np.zeros((2, 0)))
    slope = (nudged - plain) / (_NUDGE * result.value("coulomb_force"))  # m/s^2 per N
    piece = (one.t[part.rows] - one.t[0]) // WINDOW
    changes = [-(slope[k] @ plain[k]) / (slope[k] @ slope[k]) for k in (piece == n for n in np.unique(piece))]
    whole = -(slope @ plain) / (slope @ slope)
    return float(whole), float(np.std(changes, ddof=1) / np.sqrt(len(changes)))


def page(
    fits: dict[str, FitResult],
    scores: Sequence[Scores],
    changes: Sequence[tuple[float, float]],
    level: float,
    after: Array,
    draws: int,
) -> str:
    """docs/emps.md. changes: of the Coulomb force in both runs with standard errors, N; level: that force, N; after:
    open-loop scores in mm per start with the held-out run's own level."""
    ranges = [
        f"**{min(s.span[0] for s in rows):.1f} to {max(s.span[1] for s in rows):.1f} mm** by {objective}"
        for objective, rows in ((name, [s for s in scores if s.objective == name]) for name in fits)
    ]
    lines = [
        "# EMPS in open loop",
        "",
        "Written by `python -m tests.benchmarks.emps`; nothing here is typed by hand.",
        "",
        "A real ball-screw axis (Janot, Gautier, Brunot 2019). Model: one mass, LuGre friction that depends on the "
        "direction (`asymmetric_friction`), drive gain known. Fitted to `DATA_EMPS` alone. Score: `qm` of "
        f"`DATA_EMPS_PULSES` simulated from `vir` alone over the whole run, 1000 RMSE of samples {SKIPPED} to the end, "
        "in mm.",
        "",
        f"{', '.join(ranges)}: from the lowest 5th to the highest 95th percentile of both start conventions, each over "
        f"{draws} draws of the parameters from the fit's covariance. No choice among the rows is made by the held-out "
        "run. The force balance is the objective that the published parameters come from, too; the windows of "
        f"{WINDOW:g} s (objective `ahead` with that horizon, restarted from the measured state) are fitted but for a "
        "straight line each.",
        "",
        "| fitted by | start | fitted parameters, mm | 5 to 95 % of the draws, mm | consecutive "
        f"{WINDOW:g} s of the run, mm |",
        "|---|---|---|---|---|",
    ]
    for s in scores:
        parts = ", ".join(f"{x:.1f}" for x in s.parts)
        lines.append(f"| {s.objective} | {s.start} | {s.best:.2f} | {s.span[0]:.1f} to {s.span[1]:.1f} | {parts} |")
    lines += ["", "| parameter | " + " | ".join(fits) + " |", "|---|" + "---|" * len(fits)]
    for name in SHOWN:
        found = [next(e for e in result.estimates if e.name == name) for result in fits.values()]
        cells = " | ".join(f"{e.value:.4g} ± {e.std:.2g} {e.unit}" for e in found)
        lines.append(f"| `{name}` | {cells} |")
    (own, own_error), (held, held_error) = changes
    starts = dict.fromkeys(s.start for s in scores)
    lines += [
        "",
        "## What separates the two runs",
        "",
        f"With all else as the force balance of the fitting run gave it, the held-out run's balance asks for a Coulomb "
        f"force that is {held:+.2f} ± {held_error:.2f} N ({100.0 * held / level:+.1f} % of {level:.2f} N) off; the "
        f"fitting run's own asks for {own:+.2f} ± {own_error:.2f} N (scatter of parts of {WINDOW:g} s). No fit to the "
        "fitting run can know that. With that level, which is no prediction any more, the same parameters score "
        + ", ".join(f"{value:.1f} mm {name}" for name, value in zip(starts, after, strict=True))
        + ".",
        "",
        "An axis without a spring integrates such forces: what a single low score on this run shows is that errors "
        "cancel (friction, its asymmetry, the start), and whether they do is within the parameters' uncertainty.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=200)
    draws = parser.parse_args().draws
    fitted, held = emps("DATA_EMPS"), emps("DATA_EMPS_PULSES")
    measured = float(measure_motion([held]).v[0])
    speeds = {"at rest": 0.0, f"at the measured {1e3 * measured:.1f} mm/s": measured}
    fits, scores = {}, []
    for objective, settings in OBJECTIVES.items():
        fits[objective] = fit_on(fitted, settings)
        scores += scores_of(objective, fits[objective], held, speeds, draws)
        for s in scores[-len(speeds) :]:
            print(f"{s.objective}, {s.start}: {s.best:.2f} mm, {s.span[0]:.1f} to {s.span[1]:.1f}", flush=True)
    balance = next(iter(fits.values()))
    changes = [friction_level(balance, run) for run in (fitted, held)]
    level = balance.value("coulomb_force")
    model = Model("force", (*EFFECTS, "friction_level_change"))
    values = {e.name: e.value for e in balance.estimates}
    values |= {"friction_change": changes[1][0] / level, "friction_change_recordings": 1.0}
    run = replace(held, number=1)
    after = np.array(
        [
            score(open_loop(model, model.vector(values)[None, :], run, v, balance.substeps)[:, SKIPPED:])[0]
            for v in speeds.values()
        ]
    )
    PAGE.write_text(page(fits, scores, changes, level, after, draws), encoding="utf-8")
    print(f"written: {PAGE}")


if __name__ == "__main__":
    main()
