"""A motor's dimensions from a YAML file, from options, or from both."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import UsageError

if TYPE_CHECKING:
    from linid.physics.field.geometry import MotorGeometry

_NAMES = ("magnet", "remanence", "gap", "pitch", "coil", "turns", "phase_spacing")


def read_geometry(path: Path | None, options: dict[str, Any]) -> MotorGeometry | None:
    """The dimensions; options (None: not given) override the file. None where there are neither.

    Raises ConfigError for the file, UsageError for options that are wrong or do not suffice.
    """
    from linid.physics.field.geometry import MotorGeometry, load_geometry

    given = {name: options[name] for name in _NAMES if options.get(name) is not None}
    below: dict[str, Any] = {} if path is None else load_geometry(path).model_dump(exclude_none=True)
    if not below and not given:
        return None
    missing = [name for name in _NAMES if name not in given] if path is None else []
    if missing:
        raise UsageError(
            "field",
            f"lacks {', '.join('--' + name.replace('_', '-') for name in missing)}",
            "Give all dimensions, or a GEOMETRY.yaml.",
        )
    merged = _merge(below, _sections(given))
    try:
        return MotorGeometry.model_validate(merged)
    except ValueError as error:
        raise UsageError("field", _first(error), "Correct the option.") from None


def _sections(given: dict[str, Any]) -> dict[str, Any]:
    """Options as the keys of the file."""
    out: dict[str, Any] = {"magnet": {}, "coil": {}}
    if "magnet" in given:
        out["magnet"] = dict(zip(("width_mm", "length_mm", "thickness_mm"), given["magnet"], strict=True))
    if "remanence" in given:
        out["magnet"]["remanence_t"] = given["remanence"]
    if "coil" in given:
        out["coil"] = dict(zip(("width_mm", "length_mm"), given["coil"], strict=True))
    if "turns" in given:
        out["coil"]["turns"] = given["turns"]
    keys = {"gap": "air_gap_mm", "pitch": "pole_pitch_mm", "phase_spacing": "phase_spacing_mm"}
    return out | {key: given[name] for name, key in keys.items() if name in given}


def _merge(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    return below | {
        key: {**below.get(key, {}), **value} if isinstance(value, dict) else value for key, value in above.items()
    }


def _first(error: ValueError) -> str:
    """The first complaint of pydantic in a line."""
    from pydantic import ValidationError

    if not isinstance(error, ValidationError):
        return str(error)
    one = error.errors()[0]
    place = ".".join(map(str, one["loc"]))
    return f"{place}: {one['msg']}" if place else one["msg"].removeprefix("Value error, ")
