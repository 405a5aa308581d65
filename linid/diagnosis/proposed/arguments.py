"""What a missing force may depend on: values of each row of the force balance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from linid.arrays import Array
from linid.diagnosis.proposed.problem import Problem
from linid.diagnosis.proposed.wave_columns import wave_columns
from linid.physics.effects.effect import ARGUMENTS

# What only passes comes last: between equals, what a designer can change is likelier the cause.
PASSING = ("time", "campaign_time", "recording")
NEAR = 0.004  # of the stroke: what a reversal or a rest leaves behind is drawn by the logarithm of the way since
RATE = "rate of the motor force"
_BRIEF = 0.03  # s, a rest that hardly counts
TURN = 2.0 * math.pi  # rad
_TURNS = 2.0  # from which on an axis comes back to the same angles


@dataclass(frozen=True)
class Argument:
    """One argument. name: as in `ARGUMENTS`; symbol: what a formula calls it, empty where none can; unit: of it;
    values: (n,) of each row; period: of a periodic one in that unit, 0 for others; offset: in that unit, where the
    values are logarithms of what is measured and this; said: its label where it is not that of its name;
    spread: (n,) in that unit, deviation of the values that a row is the mean of, 0 where it hardly is one."""

    name: str
    symbol: str
    unit: str
    values: Array
    period: float = 0.0
    offset: float = 0.0
    said: str = ""
    spread: Array | float = 0.0

    @property
    def label(self) -> str:
        """What people call it."""
        return self.said or ARGUMENTS[self.name]

    @property
    def plain(self) -> Argument:
        """The argument itself, where the values are logarithms."""
        if not self.offset:
            return self
        plain = self.symbol.removeprefix("log(").split(" ")[0]
        return replace(self, symbol=plain, values=self.shown(self.values), offset=0.0)

    def shown(self, x: Array) -> Array:
        """Places x: (m,) among the values, in the unit."""
        return np.exp(x) - self.offset if self.offset else x

    def waves(self, wavenumbers: Sequence[float] | Array) -> Array:
        """Cosine and sine (n, 2 W) of each of the wavenumbers (W,) in rad per unit, as the rows see them."""
        return wave_columns(self.values, wavenumbers, self.spread)


def arguments_of(problem: Problem) -> dict[str, Argument]:
    """All arguments that these rows can tell, by a key of their own (two may be the same thing seen differently).

    Not among them is the measured acceleration: it is a part of the residual, and its noise would explain itself.
    That of the model stands for it.
    """
    rows = problem.rows
    length, force = ("rad", "N m") if problem.rotary else ("m", "N")
    memory = problem.memory
    near = float(f"{NEAR * max(float(np.ptp(rows.y)), 1e-9):.2g}")
    swept = np.abs(rows.v) * problem.blur
    found = {
        "position": Argument("position", "y", length, rows.y, spread=swept),
        "velocity": Argument("velocity", "v", f"{length}/s", rows.v),
        "speed": Argument("velocity", "abs(v)", f"{length}/s", np.abs(rows.v)),
        "travel": Argument("travel", f"log(travel + {near:g})", length, np.log(memory.travel + near), offset=near),
        "slid": Argument(
            "rest_time",
            f"log(slid + {near:g})",
            length,
            np.log(memory.slid + near),
            offset=near,
            said="travel since the last rest",
        ),
        "since_reversal": Argument("since_reversal", "since_reversal", "s", memory.lasting),
        "rest_time": Argument("rest_time", f"log(rest + {_BRIEF:g})", "s", np.log(memory.rest + _BRIEF), offset=_BRIEF),
        "acceleration": Argument("acceleration", "acceleration", f"{length}/s^2", rows.a - problem.residual),
        "time": Argument("time", "t", "s", rows.t, spread=problem.blur),
    }
    if problem.field is not None:
        found["pole_phase"] = Argument("position", "y", length, rows.y, 2.0 * math.pi / problem.field, spread=swept)
    if problem.rotary and float(np.ptp(rows.y)) > _TURNS * TURN:
        found["turn"] = Argument("position", "y", length, rows.y, TURN, spread=swept)
    if np.any(problem.push != 0.0):
        found["motor_force"] = Argument("motor_force", "F", force, problem.push)
        found["force_size"] = Argument("motor_force", "abs(F)", force, np.abs(problem.push))
        rates = problem.rates(problem.push[:, None])[:, 0]
        found["force_rate"] = Argument("motor_force", "", f"{force}/s", rates, said=RATE)
    if problem.elapsed.size > 1 and float(np.ptp(problem.elapsed)) > 0.0:
        elapsed = problem.elapsed[rows.recording] + rows.t
        found["campaign_time"] = Argument("campaign_time", "T", "s", elapsed)
    return found
