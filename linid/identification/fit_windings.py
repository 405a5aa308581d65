"""The windings of a motor: resistance and inductance from phase voltages, together with everything else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from linid.arrays import Array
from linid.errors import DataError, UsageError
from linid.identification.fit import refine
from linid.identification.objectives.winding_currents import WindingCurrents, tells_windings
from linid.identification.result import Estimate, FitResult
from linid.identification.settings import FitSettings, Hooks
from linid.identification.signals.motion import measure_motion
from linid.identification.space.bounds import build_space
from linid.identification.space.proportions import proportions_of
from linid.identification.uncertainty.voltage_noise import tells_mutual_inductance
from linid.physics.electrical import INDUCTANCE, MUTUAL, SEPARATE, STAR
from linid.physics.model import Model
from linid.recording.input_course import input_coefficients
from linid.recording.recording import Recording

_UNTOLD = Estimate(
    MUTUAL.name,
    MUTUAL.symbol,
    MUTUAL.unit,
    0.0,
    math.nan,
    math.nan,
    math.nan,
    "not_identifiable",
    "these recordings do not tell it, as the currents all but sum to zero: feed one phase alone",
)
_TOGETHER = "stands for L - M, as in a star: these recordings do not tell M"


def fit_windings(
    result: FitResult,
    recordings: Sequence[Recording],
    winding: str,
    *,
    settings: FitSettings | None = None,
    known: dict[str, float] | None = None,
    hooks: Hooks | None = None,
) -> FitResult:
    """A fitted sine or theta motor with its windings, all parameters identified anew and together.

    The back-EMF constant is the force constant, so the voltages also sharpen what the motion alone told of it. Of
    separate windings whose currents sum to zero, M is not identifiable and the inductance is L - M. result: of a fit to
    the phase currents of the same recordings; winding: star or separate; known: SI values that are not identified.
    Raises UsageError for a result whose forces are per mass, DataError where no driven recording has phase voltages and
    currents.
    """
    settings = settings or FitSettings()
    if result.per_mass:
        raise UsageError("mass", "is not known, so volts and newtons cannot be compared", "Give the mass.")
    able = _telling(recordings)
    model = Model(result.model, result.effects, winding, result.law)
    values = {e.name: e.value for e in result.estimates}
    resistance, inductance = first_winding_values(model.turns * values["electrical_wavenumber"], able)
    values |= {"phase_resistance": resistance, "phase_inductance": inductance, MUTUAL.name: 0.0}
    names = {p.name for p in model.parameters}
    # What a space holds by itself is no known value.
    own = {"stribeck_exponent"} | (set() if settings.stribeck else {"static_force", "stribeck_velocity"})
    fixed = {e.name: e.value for e in result.estimates if e.status == "fixed" and e.name not in own}
    fixed |= {k: x for k, x in (known or {}).items() if k in names}
    values |= fixed
    untold = winding == SEPARATE and not {MUTUAL.name, INDUCTANCE.name} & fixed.keys()
    untold = untold and not tells_mutual_inductance(model.vector(values), WindingCurrents(model, tuple(able)))
    if untold:  # what the currents have in common is left out: noise in it would bias the rest
        model = Model(result.model, result.effects, STAR, result.law)
        names.remove(MUTUAL.name)
        settings = _without_mutual(settings)
    shape = proportions_of(model, {name: values[name] for name in settings.proportions if name in values}, fixed)
    space = build_space(
        model,
        recordings,
        {name: values[name] for name in names},
        {**fixed, **shape.values},
        {**shape.bounds, **settings.bounds},
        settings.free_exponent,
        (values["electrical_wavenumber"],),
        settings.stribeck,
    )
    found = refine(replace(space, ties=shape.ties), space.encode(values), recordings, settings=settings, hooks=hooks)
    if untold:
        found = replace(found, winding=winding, estimates=_with_mutual_untold(found.estimates))
    return _after(result, found)


def _after(result: FitResult, found: FitResult) -> FitResult:
    """What was found, with the search and the warnings of the result that it started from."""
    return replace(
        found,
        history=result.history + found.history,
        stop_reasons=result.stop_reasons + found.stop_reasons,
        evaluations=result.evaluations + found.evaluations,
        warnings=result.warnings + found.warnings,
        converged=result.converged and found.converged,
        seed=result.seed,
        search_check=result.search_check,
    )


def _telling(recordings: Sequence[Recording]) -> list[Recording]:
    able = [r for r in recordings if tells_windings(r)]
    if not able:
        raise DataError(
            "recordings",
            "hold no driven one with three phase voltages and the phase currents",
            "Log both, and map them: voltage_u, voltage_v, voltage_w beside current_u, current_v.",
        )
    return able


def _without_mutual(settings: FitSettings) -> FitSettings:
    """The settings without wishes for the mutual inductance."""
    bounds = {name: ends for name, ends in settings.bounds.items() if name != MUTUAL.name}
    profiles = tuple(name for name in settings.profiles if name != MUTUAL.name)
    return replace(settings, bounds=bounds, profiles=profiles)


def _with_mutual_untold(estimates: tuple[Estimate, ...]) -> tuple[Estimate, ...]:
    """Estimates of a star, read as those of separate windings whose mutual inductance left no trace."""
    out: list[Estimate] = []
    for estimate in estimates:
        if estimate.name == INDUCTANCE.name:
            note = "; ".join(filter(None, (estimate.note, _TOGETHER)))
            out += [replace(estimate, note=note), _UNTOLD]
        else:
            out.append(estimate)
    return tuple(out)


def first_winding_values(wavenumber: float, recordings: Sequence[Recording]) -> tuple[float, float]:
    """Resistance (V/A) and inductance (V s/A) by regression of the voltages on currents, their rates and back-EMF.

    wavenumber: of the field, rad/m. The back-EMF of each phase is any wave of that length with its third harmonic: the
    motion may have told little of the motor's shape. recordings: with phase voltages and currents. What all three
    phases share is left out: a star floats.
    """
    rows, voltages = [], []
    for recording in recordings:
        assert recording.phase_currents is not None and recording.phase_voltages is not None
        motion = measure_motion([recording])
        rates = input_coefficients(recording, recording.phase_currents)[:, :, 1]
        columns = [recording.phase_currents[:, :-1], rates]
        for harmonic in (1, 3):
            angle = harmonic * wavenumber * motion.y[:-1]
            for wave in (np.sin(angle) * motion.v[:-1], np.cos(angle) * motion.v[:-1]):
                columns += [np.outer(phase, wave) for phase in np.eye(3)]
        rows.append(np.column_stack([_apart(column) for column in columns]))
        voltages.append(_apart(recording.phase_voltages[:, :-1]))
    matrix = np.concatenate(rows)
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    found = np.linalg.lstsq(matrix / scale, np.concatenate(voltages), rcond=1e-8)[0] / scale
    return max(float(found[0]), 1e-3), max(float(found[1]), 1e-6)


def _apart(rows: Array) -> Array:
    """Three phase quantities (3, n) less their mean, in one row."""
    return np.asarray(rows - rows.mean(axis=0)).ravel()
