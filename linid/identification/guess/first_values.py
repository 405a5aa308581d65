"""Where the search starts: first guesses of all parameters and the candidates made of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from linid.arrays import Array
from linid.identification.guess import regression as guess
from linid.identification.guess.effect_values import effect_guess, scaled_to_masses
from linid.identification.guess.field_shape import field_shapes
from linid.identification.objectives.acceleration import Acceleration
from linid.identification.objectives.problem import Cost, Problem
from linid.identification.optimise.least_squares import levenberg_marquardt
from linid.identification.result import FitResult
from linid.identification.settings import Ending, FitSettings
from linid.identification.space.bounds import build_space
from linid.identification.space.search_space import SearchSpace
from linid.physics.effects.effect import Values
from linid.physics.model import Model
from linid.physics.motors.registry import MOTORS
from linid.recording.recording import Recording

_BRISTLE = {"bristle_stiffness", "bristle_damping"}
# Search coordinates of a friction that rises little, and over a wide range of speeds, on the way to rest. From the
# middle of the box alone the descent ended at a needle of friction at rest: of 100 draws of noise, in 8 of the stand
# with table 1's friction and in 49 with table 2's; from here in 1 and 1, from the better of both in as few.
_GENTLE = {"static_force": 0.2, "stribeck_velocity": 0.75}


def first_values(
    model: Model, recordings: Sequence[Recording], known: dict[str, float], start: FitResult | None
) -> tuple[dict[str, float], tuple[float, ...]]:
    """First guesses of all parameters, SI, from the friction result where there is one, else by regression.

    known: SI values that are given. Returns also the rival densities of the field, rad/m in the motor's own angles.
    """
    free = [r for r in recordings if r.kind == "free_wheel"]
    driven = [r for r in recordings if r.kind != "free_wheel"]
    values: dict[str, float] = {}
    densities: tuple[float, ...] = ()
    mass = known.get("mass")
    if start is not None:
        values = _told(start)
        mass = mass if mass is not None else values.get("mass")
    if free and start is None:
        values.update(guess.free_wheel_guess(free, mass))
        mass = values["mass"]
    if driven and model.single:
        values = {**guess.force_guess(driven, known.get("force_constant"), mass), **values}
    elif driven and model.phases:
        given = known.get("electrical_wavenumber")
        motor, densities = guess.phase_guess(
            driven, mass if mass is not None else 1.0, 20.0, 1500.0, None if given is None else given * model.turns
        )
        motor = MOTORS[model.kind].of_first_harmonic(motor, known)
        densities = tuple(d / model.turns for d in densities)
        values = {**motor, **values, **{k: motor[k] for k in ("force_constant", "commutation_offset")}}
    return {**values, **known}, densities


def _told(start: FitResult) -> dict[str, float]:
    """The values of an earlier result, SI, without those of the bristle that it says nothing of: they may lie anywhere,
    as at a damping with which the bristle hardly moves, where the middle of the range is the better start."""
    untold = {e.name for e in start.estimates if e.status == "not_identifiable"} & _BRISTLE
    if "bristle_stiffness" in untold:
        untold.add("bristle_damping")  # which is searched by what it is beside the stiffness
    return {e.name: e.value for e in start.estimates if e.name not in untold}


def guess_effects(
    model: Model,
    recordings: Sequence[Recording],
    first: dict[str, float],
    fixed: dict[str, float],
    densities: tuple[float, ...],
    settings: FitSettings,
) -> tuple[tuple[Values, ...], Values]:
    """Rival first values of all parameters, and those of effects that are preset; see `effect_guess`.

    first, fixed: SI values by name; densities: rival ones of the field, as of `first_values`.
    """
    base = model.with_effects(())
    own = {p.name for p in base.parameters}
    space = build_space(
        base,
        recordings,
        first,
        {name: value for name, value in fixed.items() if name in own},
        {name: pair for name, pair in settings.bounds.items() if name in own},
        settings.free_exponent,
        densities,
        settings.stribeck,
    )
    return effect_guess(space, model.effects, recordings, first, fixed, settings.jobs)


def mass_known(recordings: Sequence[Recording], known: dict[str, float], model: Model) -> tuple[bool, bool]:
    """Whether the mass is given, and whether it can be found from the data. known: SI values that are given."""
    masses = {r.added_mass for r in recordings}
    free = {r.added_mass for r in recordings if r.kind == "free_wheel"}
    by_force = model.single and "force_constant" in known
    return "mass" in known, len(free) > 1 or by_force or (len(masses) > 1 and model.kind != "friction")


def seed_candidates(
    space: SearchSpace,
    model: Model,
    recordings: Sequence[Recording],
    first: dict[str, float],
    densities: tuple[float, ...],
    settings: FitSettings,
    rivals: Sequence[Values] = (),
) -> tuple[Array, Array]:
    """First candidates (S, p) that lie in valleys of their own and are worth a least-squares fit, and more (T, p) as
    they are.

    The regression's guess after a least-squares fit of the force balance, with the friction that free wheels tell and
    with the balance's own, with other shapes of the field, and with a gentler rise of friction; first values of
    `rivals`; the guess itself and with rival densities (rad/m). first: SI values by name.
    """
    guess_row = space.encode(first)
    rows: list[Array] = []
    others = [guess_row]
    driven = tuple(r for r in recordings if r.kind != "free_wheel")
    if driven:
        # Accelerations at one mass say nothing about it: all forces would shrink with it.
        held = {} if len({r.added_mass for r in driven}) > 1 or "mass" not in first else {"mass": first["mass"]}
        part = Acceleration(model, driven, settings.jobs, stride=10)
        balance = Problem(space.holding(held), (part,))
        # Straight steps: a force balance is biased, and the bottom of its valley is no better a start than its side.
        refined = levenberg_marquardt(
            balance, Cost(balance), balance.space.encode(first), ending=Ending(12, 0.3), final=False, bend=False
        )
        vector = balance.space.vectors(refined.point)[0]
        values = {p.name: float(vector[space.model.slot(p.name)]) for p in model.parameters}
        for shaped in field_shapes(balance.space, part, values):
            motor = {p.name: shaped[p.name] for p in MOTORS[model.kind].parameters}
            rows.append(space.encode({**shaped, **first, **motor}))
        if held and model.effects:
            values = scaled_to_masses(model, recordings, values, space.fixed, settings.jobs)
        rows.insert(0, space.encode(values))
        if any(r.kind == "free_wheel" for r in recordings):  # which mostly tell friction far better than the balance
            told = {p.name: first[p.name] for p in model.friction if p.name in first}
            rows.insert(0, space.encode({**values, **told}))
    rows = rows or [guess_row]
    if any(r.kind == "free_wheel" for r in recordings) and not _GENTLE.keys() & first.keys():
        rows.append(_gentle(space, rows[-1]))
    rows += [space.encode(values) for values in rivals]
    for density in densities[1:]:
        others.append(space.encode({**first, "electrical_wavenumber": density}))
    return np.array(rows), np.array(others)


def _gentle(space: SearchSpace, point: Array) -> Array:
    """The point (p,) with the rise of friction towards rest that `_GENTLE` says, where that is searched."""
    out = point.copy()
    for column, name in enumerate(space.names):
        out[column] = _GENTLE.get(name, out[column])
    return out
