"""Where the gap lies, before and after: by coordinate, by pairs of them, over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from linid.arrays import Array
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge
from linid.diagnosis.locate import Coordinate, ceiling, coordinates, locate, recording_masses
from linid.diagnosis.pairs import locate_pairs
from linid.diagnosis.report_data import Budget, Entry, ResidualTrace
from linid.diagnosis.select import Selection
from linid.diagnosis.shares import Shares, judged_rows
from linid.diagnosis.verdict import SURE, TELLING
from linid.physics.model import Model
from linid.recording.recording import Recording


class Seen:
    """Where the gap lies, before and after, as the judge sees it."""

    def __init__(self, judge: Judge, found: Selection, kind: str, recordings: Sequence[Recording], seed: int) -> None:
        self.judge, self.found = judge, found
        balance = judge.balance
        self.field = field_wavenumber(kind, found.base.values)
        self.masses = recording_masses(recordings, found.base.values["mass"])
        self.axes: tuple[Coordinate, ...] = coordinates(balance, recordings[0].axis, self.field)
        base, best = found.base.residual, found.best.residual
        self.where = locate(balance, base, judge.scale, self.masses, self.axes, seed)
        self.pairs = locate_pairs(balance, base, judge.scale, self.masses, self.axes, seed)
        self.later = self.where if best is base else locate(balance, best, judge.scale, self.masses, self.axes, seed)
        noise = judge.noise.deviation(balance.rows)
        self.ceiling = ceiling(balance, best, judge.scale, self.axes, noise)
        held = balance.split
        whole = max(float(np.mean(judge.power(balance.rows.a)[held])), 1e-300)
        missed = float(np.mean(judge.power(best)[held])) / whole
        self.motion = 1.0 - missed

    def budget(self, shares: Shares, entries: tuple[Entry, ...]) -> Budget:
        """The budget of a selection's entries."""
        judge, found = self.judge, self.found
        rows = judged_rows(judge, found.best)
        force = self.masses[judge.balance.rows.recording[rows]]
        noise = (judge.noise.encoder + judge.noise.inputs)[judge.balance.rows.bin[rows]]

        def rms(x: Array) -> float:
            return float(np.sqrt(np.mean(x)))

        telling = [s.label for s in self.later if s.share > TELLING and s.p_value < SURE and entries]
        closed, low, high = shares.closed if entries else (0.0, 0.0, 0.0)
        rest = shares.unexplained if entries else (1.0, 1.0, 1.0)
        return Budget(
            before=rms((force * found.base.residual[rows]) ** 2),
            after=rms((force * found.best.residual[rows]) ** 2),
            floor=rms(force**2 * noise),
            excess_before=judge.excess(found.base.residual, rows),
            excess_after=judge.excess(found.best.residual, rows),
            closed=closed,
            closed_low=low,
            closed_high=high,
            unexplained=rest[0],
            unexplained_low=rest[1],
            unexplained_high=rest[2],
            entries=entries,
            ceiling=self.ceiling,
            depends_on=tuple(telling[:3]),
            level_before=judge.fits.level(found.base.residual, found.base.floor, rows),
            level_after=judge.fits.level(found.best.residual, found.best.floor, rows),
        )


def field_wavenumber(kind: str, values: dict[str, float]) -> float | None:
    """Wavenumber of the motor's field in rad/m, None without a phase motor; values: SI, by name."""
    model = Model(kind)
    return values["electrical_wavenumber"] * model.turns if model.phases else None


def residual_traces(judge: Judge, base: Fitted, best: Fitted, masses: Array) -> tuple[ResidualTrace, ...]:
    """The residual force of all rows, recording by recording, before and after; masses: (R,) kg."""
    rows = judge.balance.rows
    noise = judge.noise.deviation(rows)
    out = []
    for index, recording in enumerate(judge.balance.recordings):
        mine = rows.recording == index
        out.append(
            ResidualTrace(
                recording=recording.name,
                kind=recording.kind,
                split=recording.split,
                t=rows.t[mine],
                y=rows.y[mine],
                v=rows.v[mine],
                before=masses[index] * base.residual[mine],
                after=masses[index] * best.residual[mine],
                deviation=float(masses[index] * noise[index]),
            )
        )
    return tuple(out)
