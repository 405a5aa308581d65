"""Fits of which nothing tells the mass: all forces are per kilogram of what moved, which only then stays comparable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from linid.errors import DataError
from linid.identification.result import FitResult
from linid.recording.recording import Recording

ADDED = "added_mass_of_unit"  # setting of a result: what all its recordings had on the mover, kg (rotary: kg m^2)
_SAME = 1e-9  # kg


def on_unit_mass(recordings: Sequence[Recording]) -> tuple[list[Recording], float]:
    """Recordings whose moving mass, with the added one that all share, is the unit; and that added mass in kg."""
    return [replace(r, added_mass=0.0) for r in recordings], recordings[0].added_mass


def comparable(result: FitResult, recording: Recording) -> Recording:
    """The recording as a result can be asked for it: per kilogram, what was added belongs to the unit.

    Raises DataError where something else was on the mover than in the fit: nobody knows what part of the mass that is.
    """
    if not result.per_mass:
        return recording
    return on_same_mass(recording, float(result.settings.get(ADDED, 0.0)))


def on_same_mass(recording: Recording, added: float) -> Recording:
    """The recording per unit of what moved in those that were fitted. added: mass in kg that these had on the mover
    (rotary: kg m^2).

    Raises DataError where the recording has another one.
    """
    if abs(recording.added_mass - added) > _SAME:
        what, unit = ("inertia", "kg m^2") if recording.axis == "rotary" else ("mass", "kg")
        raise DataError(
            recording.name,
            f"has {recording.added_mass:g} {unit} added, the fitted recordings {added:g} {unit}, and forces are "
            f"per unit of a moving {what} that nobody knows",
            f"Give --mass, or fit recordings with both: they tell the {what}.",
        )
    return replace(recording, added_mass=0.0)
