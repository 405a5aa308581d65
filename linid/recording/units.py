"""Units of scope channels: declared text -> SI factor. Nothing is guessed: an unknown unit is an error."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass

from linid.errors import DataError

_TURN = 2.0 * math.pi
_COUNTS = ("count", "counts", "cnt", "cnts", "inc", "incs", "increments", "ct", "ticks", "pulse", "pulses")
_PEAK = math.sqrt(2.0)


@dataclass(frozen=True)
class Unit:
    """A declared unit: value_SI = value * factor, in the SI unit `si` of the physical `dimension`."""

    symbol: str
    dimension: str
    si: str
    factor: float


# Dimension, SI unit, and the factor of each way to write a unit of it.
_ROWS: tuple[tuple[str, str, dict[str, float]], ...] = (
    (
        "time",
        "s",
        {
            "s": 1.0,
            "ms": 1e-3,
            "us": 1e-6,
            "ns": 1e-9,
            "min": 60.0,
            "sec": 1.0,
            "msec": 1e-3,
            "usec": 1e-6,
            "second": 1.0,
            "seconds": 1.0,
            "milliseconds": 1e-3,
            "microseconds": 1e-6,
            "nanoseconds": 1e-9,
            "nsec": 1e-9,
            "h": 3600.0,
        },
    ),
    (
        "length",
        "m",
        {
            "m": 1.0,
            "cm": 1e-2,
            "mm": 1e-3,
            "um": 1e-6,
            "micron": 1e-6,
            "microns": 1e-6,
            "nm": 1e-9,
            "in": 0.0254,
            "inch": 0.0254,
        },
    ),
    (
        "angle",
        "rad",
        {
            "rad": 1.0,
            "mrad": 1e-3,
            "deg": _TURN / 360,
            "°": _TURN / 360,
            "degree": _TURN / 360,
            "degrees": _TURN / 360,
            "rev": _TURN,
            "revs": _TURN,
            "turn": _TURN,
            "turns": _TURN,
        },
    ),
    ("velocity", "m/s", {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "m/min": 1 / 60, "mm/min": 1e-3 / 60, "in/s": 0.0254}),
    (
        "angular velocity",
        "rad/s",
        {
            "rad/s": 1.0,
            "mrad/s": 1e-3,
            "deg/s": _TURN / 360,
            "°/s": _TURN / 360,
            "rev/s": _TURN,
            "rps": _TURN,
            "rpm": _TURN / 60,
            "1/min": _TURN / 60,
            "rev/min": _TURN / 60,
            "min^-1": _TURN / 60,
            "U/min": _TURN / 60,
            "r/min": _TURN / 60,
        },
    ),
    (
        "current",
        "A",
        {
            "A": 1.0,
            "mA": 1e-3,
            "uA": 1e-6,
            "kA": 1e3,
            "Amp": 1.0,
            "Amps": 1.0,
            "Ampere": 1.0,
            # A drive that shows instantaneous currents in Arms divides them by the root of two.
            "Arms": _PEAK,
            "A rms": _PEAK,
            "A_rms": _PEAK,
            "mArms": 1e-3 * _PEAK,
            "Aeff": _PEAK,
            "Apk": 1.0,
            "A pk": 1.0,
            "A_pk": 1.0,
            "Apeak": 1.0,
            "A peak": 1.0,
            "mApk": 1e-3,
        },
    ),
    ("voltage", "V", {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "kV": 1e3, "Volt": 1.0, "Volts": 1.0}),
    ("force", "N", {"N": 1.0, "kN": 1e3, "mN": 1e-3}),
    ("torque", "N m", {"N m": 1.0, "Nm": 1.0, "N*m": 1.0, "mNm": 1e-3, "mN m": 1e-3}),
    ("ratio", "1", {"%": 0.01, "1": 1.0, "-": 1.0}),
    ("count", "count", dict.fromkeys(_COUNTS, 1.0)),
)

UNITS = {name: Unit(name, dimension, si, factor) for dimension, si, names in _ROWS for name, factor in names.items()}


def _normal(text: str) -> str:
    text = text.strip().replace("µ", "u").replace("μ", "u").replace("·", "*").replace("²", "^2")
    return text.replace("⁻¹", "^-1")


def find_unit(text: str) -> Unit | None:
    """The unit written as `text`, or None; symbols are case-sensitive (mA is not MA), words are not."""
    name = _normal(text)
    if name in UNITS:
        return UNITS[name]
    lower = name.lower()
    if len(lower) > 2 and "/" not in lower:
        return next((unit for key, unit in UNITS.items() if key.lower() == lower), None)
    return None


def unit_of(text: str, place: str, dimensions: tuple[str, ...]) -> Unit:
    """The unit `text`, of one of `dimensions`; raises DataError naming near units or the expected kinds otherwise."""
    known = [unit.symbol for unit in UNITS.values() if unit.dimension in dimensions]
    unit = find_unit(text)
    if unit is None:
        near = difflib.get_close_matches(_normal(text), known, n=3, cutoff=0.5)
        near += [name for name in known if name.lower() == _normal(text).lower() and name not in near]
        hint = f"Did you mean {' or '.join(near)}? " if near else ""
        raise DataError(place, f"unknown unit '{text}'", f"{hint}Known here: {', '.join(known)}.")
    if unit.dimension not in (*dimensions, "count"):
        raise DataError(
            place,
            f"unit '{text}' is a {unit.dimension}, expected a {' or '.join(dimensions)}",
            "Set the axis type (linear, rotary) or the channel's unit and scale in the mapping.",
        )
    return unit
