"""Making one campaign of the challenge: what is hidden in it, how strongly, and the recordings of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from linid.arrays import Array
from linid.challenge.axes import FRESH_PLAN, draw_axis, draw_modes, scales, tamed
from linid.challenge.catalogue import ENTRIES, FIRST, LISTED, draw_effect
from linid.challenge.entries import HiddenEffect
from linid.challenge.hidden_axis import AXES, LAWS, AxisKind, HiddenAxis, Law, varied
from linid.challenge.outside import OUTSIDE
from linid.challenge.plant import HiddenRun
from linid.challenge.strength import OutOfStrokeError, calibrate, commands, run_all
from linid.challenge.truth import Truth, true_shares
from linid.errors import UsageError
from linid.stand.measurement import measure
from linid.stand.mode_descriptions import FreeWheel, Mode, SlowRamp

Kind = Literal["single", "pair", "none", "unknown", "crowd", "changed", "unchanged"]
# Of ten campaigns with the first four kinds.
_SHARES: dict[Kind, int] = {"single": 6, "pair": 2, "none": 1, "unknown": 1, "crowd": 2, "changed": 2}
# Effects that a kind hides at once (a crowd: as many as drawn uniformly from this range).
_LEAST: dict[Kind, int] = {"pair": 2, "crowd": 3}
_MOST_AT_ONCE = 6
ALL = "all"
RATES = (250.0, 500.0, 1000.0, 2000.0, 4000.0)  # Hz
_ATTEMPTS = 40
_TAMINGS = 12
_FRESH_INDEX = 100  # random walks and phases of fresh recordings differ from those of the campaign
_LEAST_TRAVEL = 1e-3  # m


@dataclass(frozen=True)
class Plan:
    """What a challenge is to hold.

    effects: names to hide (`all`: every listed one; empty: every one in crowds, else the first eighteen, so that older
    seeds' campaigns stay what they were); strength: (low, high), drawn log-uniformly; laws, axes, rates (Hz): of
    each campaign one, drawn evenly; encoders: (finest, coarsest) resolution in m, drawn log-uniformly, None: 0.1 um;
    crowd: least and most effects of a crowd.
    """

    seed: int
    effects: tuple[str, ...] = ()
    strength: tuple[float, float] = (0.05, 1.0)
    kinds: tuple[Kind, ...] = ("single", "pair", "none", "unknown")
    laws: tuple[Law, ...] = ("lugre",)
    axes: tuple[AxisKind, ...] = ("phase",)
    rates: tuple[float, ...] = (1000.0,)
    encoders: tuple[float, float] | None = None
    crowd: tuple[int, int] = (_LEAST["crowd"], _MOST_AT_ONCE)

    def __post_init__(self) -> None:
        known = (*LISTED, *OUTSIDE, ALL)
        wrong = [name for name in self.effects if name not in known]
        if wrong:
            raise UsageError("--effects", f"{', '.join(wrong)} is unknown", f"Known: {', '.join(known)}.")
        low, high = self.strength
        if not 0 < low <= high:
            raise UsageError("--strength", f"is {low:g} to {high:g}", "Give 0 < low <= high, such as 0.05,1.")
        odd = [kind for kind in self.kinds if kind not in _SHARES]
        if odd or not self.kinds:
            raise UsageError("--kinds", f"{', '.join(odd) or 'nothing'} is no kind", f"Known: {', '.join(_SHARES)}.")
        _check_axes(self)
        for kind in self.kinds:
            if len(self.names(kind)) < _LEAST.get(kind, 1):
                raise UsageError(
                    "--effects", f"a {kind} needs {_LEAST[kind]} listed effects", f"Name more, or leave `{kind}` out."
                )

    def names(self, kind: Kind) -> tuple[str, ...]:
        """The effects that campaigns of a kind may hide on at least one of the axes.

        A crowd may hold effects outside the library beside listed ones, where they are named.
        """
        pool = tuple(OUTSIDE) if kind == "unknown" else tuple(LISTED)
        possible = tuple(name for name in pool if set(ENTRIES[name].axes) & set(self.axes))
        chosen = tuple(name for name in possible if name in self.effects)
        if kind == "crowd":
            chosen = (possible if ALL in self.effects else chosen) + tuple(n for n in OUTSIDE if n in self.effects)
        elif not chosen and kind != "unknown" and ALL not in self.effects:
            return tuple(name for name in FIRST if name in possible)
        return chosen or possible


@dataclass(frozen=True)
class Measured:
    """One recording as the scope shows it: y (n,) in m, currents (3, n) in A; (1, n) where only the q-current is."""

    mode: Mode
    y: Array
    currents: Array


@dataclass(frozen=True)
class HiddenCampaign:
    """A campaign, its fresh twin and its key. strength: effect name -> strength (see `linid.challenge.strength`);
    truth: each effect's share of the gap (see `linid.challenge.truth`); commissioned: recordings of the axis as it was
    before it changed, factors: by which its parameters have changed since."""

    name: str
    kind: Kind
    description: HiddenAxis
    effects: tuple[HiddenEffect, ...]
    strength: dict[str, float]
    recordings: tuple[Measured, ...]
    fresh: tuple[Measured, ...] = field(default_factory=tuple)
    truth: Truth = field(default_factory=lambda: Truth(0.0, {}, 0.0))
    commissioned: tuple[Measured, ...] = ()
    factors: dict[str, float] = field(default_factory=dict)


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
    if kind in _LEAST:
        axis = _axis(plan, index)
        pool = tuple(name for name in plan.names(kind) if axis in ENTRIES[name].axes)
        count = 2 if kind == "pair" else int(random.integers(plan.crowd[0], plan.crowd[1] + 1))
        names = tuple(map(str, random.choice(pool, min(count, len(pool)), replace=False)))
    elif kind not in ("none", "changed"):  # what changes is drawn later
        pool = plan.names(kind)
        turn, position = divmod(number * block.count(kind) + kinds[:place].count(kind), len(pool))
        order = np.random.default_rng([plan.seed, 3, turn, int(kind == "unknown")]).permutation(len(pool))
        names = (pool[order[position]],)
    wanted = tuple(_strength(plan, name, random) for name in names)
    return kind, names, wanted


def _strength(plan: Plan, name: str, random: np.random.Generator) -> float:
    """Log-uniform between the plan's limits; effects that never show strongly keep within what they can reach."""
    low, high = plan.strength
    most = ENTRIES[name].most
    return float(math.exp(random.uniform(math.log(min(low, most)), math.log(min(high, most)))))


def _axis(plan: Plan, index: int, names: Sequence[str] = ()) -> AxisKind:
    """The kind of axis of a campaign: one on which all of the effects can be."""
    random = np.random.default_rng([plan.seed, 5, index])
    axis = plan.axes[int(random.integers(len(plan.axes)))]
    possible = [axis for axis in plan.axes if all(axis in ENTRIES[name].axes for name in names)]
    return axis if axis in possible else possible[int(random.integers(len(possible)))]


def variant(plan: Plan, index: int, axis: HiddenAxis, names: Sequence[str] = ()) -> HiddenAxis:
    """The drawn axis of campaign `index` with the drive, friction law, rate and encoder that its plan has for it."""
    random = np.random.default_rng([plan.seed, 6, index])
    law = plan.laws[int(random.integers(len(plan.laws)))]
    rate = plan.rates[int(random.integers(len(plan.rates)))]
    resolution = None
    if plan.encoders is not None:
        low, high = plan.encoders
        resolution = float(f"{math.exp(random.uniform(math.log(low), math.log(high))):.2g}")
    return varied(axis, random, kind=_axis(plan, index, names), law=law, rate=rate, resolution=resolution)


def _check_axes(plan: Plan) -> None:
    """Raise UsageError for laws, axes, rates and encoders that no plant has."""
    given: tuple[tuple[str, Sequence[str], Sequence[str]], ...] = (
        ("--laws", plan.laws, LAWS),
        ("--axes", plan.axes, AXES),
    )
    for option, values, known in given:
        odd = [value for value in values if value not in known]
        if odd or not values:
            raise UsageError(option, f"{', '.join(odd) or 'nothing'} is unknown", f"Known: {', '.join(known)}.")
    odd_rates = [rate for rate in plan.rates if rate not in RATES]
    if odd_rates or not plan.rates:
        listed = ", ".join(f"{rate:g}" for rate in RATES)
        raise UsageError(
            "--rates", f"{', '.join(f'{r:g}' for r in odd_rates) or 'nothing'} is no rate here", f"Known: {listed} Hz."
        )
    if plan.encoders is not None and not 1e-8 <= plan.encoders[0] <= plan.encoders[1] <= 1e-4:
        low, high = (1e6 * value for value in plan.encoders)
        raise UsageError("--encoders", f"is {low:g} to {high:g} um", "Give 0.01 <= low <= high <= 100, such as 0.1,10.")


def make_campaign(plan: Plan, index: int) -> HiddenCampaign:
    """Draw an axis, hide the assigned effects at their strengths, and record the campaign and a fresh one.

    Axes on which an effect cannot be that strong, or whose motion is not plausible, are drawn anew. Commands under
    which the forcer would leave the stroke are softened. Raises UsageError when no axis will do.
    """
    kind, names, wanted = assignment(plan, index)
    name = f"axis_{index + 1:04d}"
    for attempt in range(_ATTEMPTS):
        random = np.random.default_rng([plan.seed, 4, index, attempt])
        axis = variant(plan, index, draw_axis(name, random), names)
        made = recorded(axis, kind, names, wanted, random, several=kind == "crowd" or ALL in plan.effects)
        if made is not None:
            return made
    raise UsageError(
        name,
        f"no axis shows {', '.join(names)} at strength {', '.join(f'{s:.2g}' for s in wanted)}",
        "Lower the upper end of --strength.",
    )


def recorded(
    description: HiddenAxis,
    kind: Kind,
    names: Sequence[str],
    wanted: Sequence[float],
    random: np.random.Generator,
    *,
    several: bool,
) -> HiddenCampaign | None:
    """An axis with effects of wanted strengths, recorded; None where it cannot show them or does not move."""
    sizes = scales(description)
    listed = tuple(
        (m.name, "free_wheel" if isinstance(m, FreeWheel) else "motor", m.split) for m in description.campaign
    )
    drawn = [draw_effect(effect, random, sizes, listed, several=several) for effect in names]
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
        description.name,
        kind,
        description,
        tuple(drawn),
        {effect.name: strength for effect, strength in found},
        _measured(description, runs, noise, 0),
        fresh,
        true_shares(description, drawn),
    )


def _fresh(description: HiddenAxis, effects: Sequence[HiddenEffect], noise: int) -> tuple[Measured, ...] | None:
    """Other recordings of the same hidden plant; pushes and payloads, which belong to single recordings, are absent."""
    for _ in range(_TAMINGS):
        try:
            runs = run_all(description, effects, first_index=_FRESH_INDEX)
            return _measured(description, runs, noise, _FRESH_INDEX)
        except OutOfStrokeError as error:
            description = _tame(description, error.indices)
    return None


def _tame(description: HiddenAxis, indices: Sequence[int]) -> HiddenAxis:
    modes = tuple(tamed(m) if i in indices else m for i, m in enumerate(description.campaign))
    return description.model_copy(update={"campaign": modes})


def stuck(mode: Mode, run: HiddenRun) -> bool:
    """Whether a recording that should move does not (slow ramps may end below breakaway)."""
    return not isinstance(mode, SlowRamp) and float(np.ptp(run.y)) < _LEAST_TRAVEL


def _measured(description: HiddenAxis, runs: Sequence[HiddenRun], noise: int, first: int) -> tuple[Measured, ...]:
    out = []
    for index, (mode, run) in enumerate(zip(description.campaign, runs, strict=True)):
        y, currents = measure(
            run.reading,
            run.currents,
            description.measurement,
            seed=noise,
            index=first + index,
            powered=not isinstance(mode, FreeWheel),
        )
        out.append(Measured(mode, y, currents))
    return tuple(out)
