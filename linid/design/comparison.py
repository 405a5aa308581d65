"""An identified motor beside its data sheet: does the recording agree with the dimensions?"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from linid.identification.result import Estimate, FitResult
from linid.physics.field.geometry import MotorDesign
from linid.physics.field.guideway import k_of
from linid.physics.motors.registry import MOTORS


@dataclass(frozen=True)
class Comparison:
    """One quantity by dimensions and by identification.

    by_dimensions, identified: in `unit`, SI; identified is the one of its equivalent values that lies next to the
    dimensions' (a coil of 2 chi - l_y pushes like one of l_y; phases may be counted the other way round); low, high:
    its 95 % interval in that unit; agrees: whether that holds the dimensions' value (None where there is no interval);
    note: in words.
    """

    name: str
    symbol: str
    unit: str
    by_dimensions: float
    identified: float
    low: float
    high: float
    agrees: bool | None
    note: str


def against_dimensions(result: FitResult, design: MotorDesign) -> tuple[Comparison, ...]:
    """Pole pitch, phase spacing, force constant, and for theta coil length and field shape, beside the dimensions.

    Force constant and field shape are those of the exact field, which a recording of such a motor would show, not of
    the Gaussian that was fitted to a magnet.
    """
    geometry = design.geometry
    pitch = geometry.pole_pitch
    shaped = bool(MOTORS[result.model].shape)
    wanted: list[tuple[str, float, Callable[[float], tuple[float, ...]]]] = [
        ("pole_pitch", pitch, lambda x: (x,)),
        ("phase_spacing", geometry.phase_spacing, lambda x: _spacings(x, _own_pitch(result))),
        ("coil_length", geometry.winding.length_y, lambda x: (x, 2.0 * _own_pitch(result) - x)),
        ("field_shape", k_of(design.matched["nome"]), lambda x: (x,)),
        ("fundamental_force_constant" if shaped else "force_constant", design.exact[1], lambda x: (x, -x)),
    ]
    known = {e.name: e for e in (*result.derived, *result.estimates)}
    rows = []
    for name, value, equivalents in wanted:
        if name in known:
            rows.append(_row(known[name], value, equivalents))
    return tuple(rows)


def _own_pitch(result: FitResult) -> float:
    return next(e.value for e in result.derived if e.name == "pole_pitch")


def _spacings(x: float, pitch: float) -> tuple[float, ...]:
    """Spacings of windings that push alike: two pole pitches apart, and with the phases counted the other way."""
    return (x, *(sign * x + 2.0 * turns * pitch for sign in (1.0, -1.0) for turns in range(-2, 3)))


def _row(found: Estimate, value: float, equivalents: Callable[[float], tuple[float, ...]]) -> Comparison:
    candidates = equivalents(found.value)
    nearest = min(range(len(candidates)), key=lambda k: abs(candidates[k] - value))
    ends = sorted((equivalents(found.low)[nearest], equivalents(found.high)[nearest]))
    known = found.status != "not_identifiable" and all(map(math.isfinite, ends))
    note = found.note if found.status == "not_identifiable" else ""
    if nearest != 0 and not note:
        note = f"identified as {found.value:.5g}, which is equivalent"
    return Comparison(
        found.name,
        found.symbol,
        found.unit,
        value,
        candidates[nearest],
        ends[0],
        ends[1],
        ends[0] <= value <= ends[1] if known else None,
        note,
    )
