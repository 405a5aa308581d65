"""Making one campaign of the challenge: what is hidden in it, how strongly, and the recordings of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from linid.challenge.axes import FRESH_PLAN, draw_axis, draw_modes, scales, tamed
from linid.challenge.catalogue import LISTED, OUTSIDE, HiddenEffect, draw_effect
from linid.challenge.plant import HiddenRun
from linid.challenge.strength import OutOfStrokeError, calibrate, commands, run_all
from linid.errors import UsageError
from linid.stand.description import AxisDescription
from linid.stand.measurement import measure
from linid.stand.mode_descriptions import FreeWheel, Mode, SlowRamp

Array = NDArray[np.float64]
Kind = Literal["single", "pair", "none", "unknown", "crowd"]
# Of ten campaigns with the first four kinds.
_SHARES: dict[Kind, int] = {"single": 6, "pair": 2, "none": 1, "unknown": 1, "crowd": 2}
# Effects that a kind hides at once (a crowd: as many as drawn uniformly from this range).
_LEAST: dict[Kind, int] = {"pair": 2, "crowd": 3}
_MOST_AT_ONCE = 6
_ATTEMPTS = 40
_TAMINGS = 12
_FRESH_INDEX = 100  # random walks and phases of fresh recordings differ from those of the campaign
_LEAST_TRAVEL = 1e-3  # m


@dataclass(frozen=True)
class Plan:
    """What a challenge is to hold. effects: names to hide (empty: all); strength: (low, high), drawn log-uniformly."""

    seed: int
    effects: tuple[str, ...] = ()
    strength: tuple[float, float] = (0.05, 1.0)
    kinds: tuple[Kind, ...] = ("single", "pair", "none", "unknown")

    def __post_init__(self) -> None:
        known = (*LISTED, *OUTSIDE)
        wrong = [name for name in self.effects if name not in known]
        if wrong:
            raise UsageError("--effects", f"{', '.join(wrong)} is unknown", f"Known: {', '.join(known)}.")
        low, high = self.strength
        if not 0 < low <= high:
            raise UsageError("--strength", f"is {low:g} to {high:g}", "Give 0 < low <= high, such as 0.05,1.")
        odd = [kind for kind in self.kinds if kind not in _SHARES]
        if odd or not self.kinds:
            raise UsageError("--kinds", f"{', '.join(odd) or 'nothing'} is no kind", f"Known: {', '.join(_SHARES)}.")
        for kind in self.kinds:
            if len(self.names(kind)) < _LEAST.get(kind, 1):
                raise UsageError(
                    "--effects", f"a {kind} needs {_LEAST[kind]} listed effects", f"Name more, or leave `{kind}` out."
                )

    def names(self, kind: Kind) -> tuple[str, ...]:
        """The effects that campaigns of a kind may hide."""
        pool = tuple(OUTSIDE if kind == "unknown" else LISTED)
        return tuple(name for name in pool if name in self.effects) or pool


@dataclass(frozen=True)
class Measured:
    """One recording as the scope shows it: y (n,) in m, currents (3, n) in A."""

    mode: Mode
    y: Array
    currents: Array


@dataclass(frozen=True)
class HiddenCampaign:
    """A campaign, its fresh twin and its key. strength: effect name -> strength (see `linid.challenge.strength`)."""

    name: str
    kind: Kind
    description: AxisDescription
    effects: tuple[HiddenEffect, ...]
    strength: dict[str, float]
    recordings: tuple[Measured, ...]
    fresh: tuple[Measured, ...] = field(default_factory=tuple)


def assignment(plan: Plan, index: int) -> tuple[Kind, tuple[str, ...], tuple[float, ...]]:
    """Kind, effects and wanted strengths of campaign `index` (from 0); they do not depend on how many there are.

    Kinds come in shuffled blocks, singles and unknowns go through all their effects before one comes again.
    """
    block = [kind for kind in dict.fromkeys(plan.kinds) for _ in range(_SHARES[kind])]
    if len(set(block)) == 1:
        block = block[:1]
    number, place = divmod(index, len(block))
    kinds = [block[k] for k in np.random.default_rng([plan.seed, 1, number]).permutation(len(block))]
    kind = kinds[place]
    random = np.random.default_rng([plan.seed, 2, index])
    names: tuple[str, ...] = ()
    if kind == "pair":
        names = tuple(map(str, random.choice(plan.names("pair"), 2, replace=False)))
    elif kind == "crowd":
        pool = plan.names("crowd")
        count = int(random.integers(_LEAST["crowd"], _MOST_AT_ONCE + 1))
        names = tuple(map(str, random.choice(pool, min(count, len(pool)), replace=False)))
    elif kind != "none":
        pool = plan.names(kind)
        turn, position = divmod(number * block.count(kind) + kinds[:place].count(kind), len(pool))
        order = np.random.default_rng([plan.seed, 3, turn, int(kind == "unknown")]).permutation(len(pool))
        names = (pool[order[position]],)
    low, high = plan.strength
    wanted = tuple(float(math.exp(random.uniform(math.log(low), math.log(high)))) for _ in names)
    return kind, names, wanted


def make_campaign(plan: Plan, index: int) -> HiddenCampaign:
    """Draw an axis, hide the assigned effects at their strengths, and record the campaign and a fresh one.

    Axes on which an effect cannot be that strong, or whose motion is not plausible, are drawn anew. Commands under
    which the forcer would leave the stroke are softened. Raises UsageError when no axis will do.
    """
    kind, names, wanted = assignment(plan, index)
    name = f"axis_{index + 1:04d}"
    for attempt in range(_ATTEMPTS):
        random = np.random.default_rng([plan.seed, 4, index, attempt])
        made = _attempt(name, kind, names, wanted, random)
        if made is not None:
            return made
    raise UsageError(
        name, f"no axis shows {', '.join(names)} at strength {', '.join(f'{s:.2g}' for s in wanted)}",
        "Lower the upper end of --strength.",
    )  # fmt: skip


def _attempt(
    name: str, kind: Kind, names: Sequence[str], wanted: Sequence[float], random: np.random.Generator
) -> HiddenCampaign | None:
    description = draw_axis(name, random)
    sizes = scales(description)
    listed = tuple(
        (m.name, "free_wheel" if isinstance(m, FreeWheel) else "motor", m.split) for m in description.campaign
    )
    drawn = [draw_effect(effect, random, sizes, listed) for effect in names]
    fresh_modes = tuple(
        m.model_copy(update={"name": f"fresh_{m.name}"}) for m in draw_modes(description, random, FRESH_PLAN)
    )
    noise = int(random.integers(2**31))
    for _ in range(_TAMINGS):
        try:
            told = commands(description)
            found = []
            for effect, strength in zip(drawn, wanted, strict=True):
                reached = calibrate(description, effect, strength, sizes, told)
                if reached is None:
                    return None
                found.append(reached)
            drawn = [effect for effect, _ in found]
            runs = run_all(description, drawn, told=told)
            break
        except OutOfStrokeError as error:
            description = _tame(description, error.indices)
    else:
        return None
    if any(stuck(mode, run) for mode, run in zip(description.campaign, runs, strict=True)):
        return None
    fresh = _fresh(description.model_copy(update={"campaign": fresh_modes}), drawn, noise)
    if fresh is None:
        return None
    return HiddenCampaign(
        name, kind, description, tuple(drawn), {effect.name: strength for effect, strength in found},
        _measured(description, runs, noise, 0), fresh,
    )  # fmt: skip


def _fresh(description: AxisDescription, effects: Sequence[HiddenEffect], noise: int) -> tuple[Measured, ...] | None:
    """Other recordings of the same hidden plant; pushes and payloads, which belong to single recordings, are absent."""
    for _ in range(_TAMINGS):
        try:
            runs = run_all(description, effects, first_index=_FRESH_INDEX)
            return _measured(description, runs, noise, _FRESH_INDEX)
        except OutOfStrokeError as error:
            description = _tame(description, error.indices)
    return None


def _tame(description: AxisDescription, indices: Sequence[int]) -> AxisDescription:
    modes = tuple(tamed(m) if i in indices else m for i, m in enumerate(description.campaign))
    return description.model_copy(update={"campaign": modes})


def stuck(mode: Mode, run: HiddenRun) -> bool:
    """Whether a recording that should move does not (slow ramps may end below breakaway)."""
    return not isinstance(mode, SlowRamp) and float(np.ptp(run.y)) < _LEAST_TRAVEL


def _measured(description: AxisDescription, runs: Sequence[HiddenRun], noise: int, first: int) -> tuple[Measured, ...]:
    out = []
    for index, (mode, run) in enumerate(zip(description.campaign, runs, strict=True)):
        y, currents = measure(
            run.reading, run.currents, description.measurement, seed=noise, index=first + index,
            powered=not isinstance(mode, FreeWheel),
        )  # fmt: skip
        out.append(Measured(mode, y, currents))
    return tuple(out)
