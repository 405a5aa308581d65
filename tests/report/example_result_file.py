"""A result file of another package: one line of friction per kilogram, for a spreadsheet of many axes.

Its pyproject.toml would say: [project.entry-points."linid.results"]  line = "example_result_file:RESULT_FILE".
"""

from __future__ import annotations

from linid.identification.result import FitResult
from linid.report.files import csv_text
from linid.report.result_files import ResultFile


def friction_line(result: FitResult) -> str:
    """Coulomb friction over the mass, m/s^2, and the axis; nothing where forces are per kilogram already."""
    if result.per_mass:
        return ""
    return csv_text(("axis", "coulomb_m_per_s2"), [(result.axis, result.value("coulomb_force") / result.value("mass"))])


RESULT_FILE = ResultFile("friction_line.csv", friction_line)
TAKEN = ResultFile("parameters.json", friction_line)
NONE = "no result file"
