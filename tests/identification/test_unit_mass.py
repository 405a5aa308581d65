"""Fits without a known mass: per kilogram of what moved, in value and in unit, and nothing else beside them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from linid.diagnosis.base import on_comparable_masses
from linid.diagnosis.diagnose import diagnose
from linid.diagnosis.measures import measure_gaps
from linid.errors import DataError
from linid.identification.fit import fit
from linid.identification.model_file import model_from_text, model_to_text
from linid.identification.settings import FitSettings, SearchSettings
from linid.report.figures.gap_bars import gap_figure
from linid.report.latex import gap_latex
from linid.report.tables import gap_table_console, table_text

from .stand import FREE_WHEELS, stand

SMALL = FitSettings(search=SearchSettings(population=24, generations=4), jobs=2)
ADDED = 0.5  # kg on the third and fourth free wheel


def test_an_added_mass_that_all_share_belongs_to_the_unit() -> None:
    campaign = stand(only=FREE_WHEELS)
    loaded = [r for r in campaign.recordings if r.added_mass == ADDED]
    result = fit("friction", loaded, settings=SMALL)
    assert result.per_mass
    moved = campaign.truth["mass"] + ADDED
    assert result.value("coulomb_force") == pytest.approx(campaign.truth["coulomb_force"] / moved, rel=5e-4)
    result = model_from_text(model_to_text(result), "model")
    (gap,), _ = measure_gaps(result, loaded[:1])
    assert gap.free_run < 1e-4 and gap.per_mass  # as little as with the mass known
    # Of other masses nobody knows what part of the whole they are.
    other = next(r for r in campaign.recordings if r.added_mass != ADDED)
    with pytest.raises(DataError, match=r"0 kg added, the fitted recordings 0\.5 kg"):
        measure_gaps(result, [other])


def test_every_force_of_a_gap_says_per_kilogram() -> None:
    campaign = stand(only=FREE_WHEELS)
    two = campaign.recordings[:2]
    result = fit("friction", two, settings=SMALL)
    gaps, _ = measure_gaps(result, two[:1], floors=False)
    texts = [table_text(gap_table_console(gaps)), gap_latex(gaps)]
    texts += [axes.get_xlabel() for axes in gap_figure(gaps).axes]
    assert sum("N/kg" in text for text in texts) == 3
    known = [replace(gap, per_mass=False) for gap in gaps]
    assert "N/kg" not in gap_latex(known) + table_text(gap_table_console(known))


def test_what_follows_from_a_force_constant_is_per_kilogram_too() -> None:
    campaign = stand(only=("sine_current_1", "sine_position_1"))
    result = fit("theta", campaign.recordings, settings=replace(SMALL, least_squares_steps=2))
    assert result.per_mass
    units = {e.name: e.unit for e in (*result.estimates, *result.derived)}
    assert units["force_constant"] == units["fundamental_force_constant"] == "N/(A kg)"
    assert units["viscous_friction"] == "N s/(m kg)" and units["pole_pitch"] == "m"


def test_a_diagnosis_asks_for_masses_that_can_be_compared() -> None:
    """A held-out load says nothing of forces per unit of an unknown mass; one that all share belongs to the unit."""
    wheels = stand(only=FREE_WHEELS).recordings
    split = [replace(r, split="held_out" if r.added_mass else "fit", number=k) for k, r in enumerate(wheels, 1)]
    with pytest.raises(DataError, match=f"has {ADDED:g} kg added, the fitted recordings 0 kg"):
        diagnose("stand", split, "friction")
    assert on_comparable_masses("friction", split, {"mass": 1.0}) == tuple(split)
    shared = [replace(r, added_mass=ADDED) for r in split]
    assert {r.added_mass for r in on_comparable_masses("friction", shared, {})} == {0.0}
    told = [replace(r, split="fit") for r in split]
    assert on_comparable_masses("friction", told, {}) == tuple(told)
