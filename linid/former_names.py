"""Names that files and command lines of earlier versions use; they are read as what they are called today."""

from __future__ import annotations

from typing import Any

FORMER_NAMES = {
    "guideway_density": "electrical_wavenumber",
    "guideway_density_per_m": "electrical_wavenumber_per_m",
    "shift": "commutation_offset",
    "shift_rad": "commutation_offset_rad",
    "polish_steps": "least_squares_steps",
    "polish_precision": "least_squares_precision",
}


def present_name(name: Any) -> Any:
    """What a former name is called today; all else as it is."""
    return FORMER_NAMES.get(name, name) if isinstance(name, str) else name


def with_present_keys(content: Any) -> Any:
    """A mapping with its former keys replaced, not looking into its values; anything else as it is.

    Raises ValueError where one thing stands under both of its names.
    """
    if not isinstance(content, dict):
        return content
    for key in content:
        if present_name(key) != key and present_name(key) in content:
            raise ValueError(f"{key} and {present_name(key)} are the same thing")
    return {present_name(key): value for key, value in content.items()}
