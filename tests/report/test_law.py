"""The friction law is said alike in page and Markdown where there is something to say, and nowhere else."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace

import pytest

from linid.diagnosis.report_data import Diagnosis, LawFinding
from linid.report.diagnosis.files import diagnosis_data
from linid.report.diagnosis.law import LAW_TITLE, law_lines, law_rows, law_words
from linid.report.diagnosis.markdown import diagnosis_markdown
from linid.report.page.build import page_html

from .diagnosis_samples import explained, rotary

GAINS = {
    "lugre": (0.0, 0.0),
    "dahl": (-0.4, -3.0),
    "coulomb": (-1.2, -8.0),
    "elasto_plastic": (0.1, 1.2),
    "maxwell_slip": (0.9, 12.0),
}
OWN = {"slip_stiffness_ratio": 0.5, "slip_force_tilt": 0.11, "slip_force_bend": 0.0, "slip_force_twist": -0.2}
MAXWELL = LawFinding(
    *("maxwell_slip", "maxwell_slip", True, (), 0.93, 21.4, 1.2, OWN, GAINS),
    "Friction law: Maxwell slip rather than LuGre closes 93 % of the gap.",
)
UNTOLD = LawFinding("lugre", "lugre", False, ("dahl",), 0.0, 0.1, 0.1, {}, GAINS | {"dahl": (0.0, 0.2)}, "")
STIFF = LawFinding(
    *("coulomb", "lugre", True, (), 0.0, 0.4, 0.5, {}, GAINS),
    "Friction law: Coulomb-Stribeck without presliding; the recordings show stops, but no presliding.",
)
DAHL = LawFinding(*("dahl", "dahl", True, (), 0.0, 0.1, 0.1, {"dahl_exponent": 1.2}, GAINS), "Friction law: Dahl.")
SAID = {"maxwell": MAXWELL, "untold": UNTOLD, "stiff": STIFF, "dahl": DAHL}
ALIKE = replace(MAXWELL, told=False, alike=("elasto_plastic",))


def said(law: LawFinding | None) -> Diagnosis:
    return explained(friction_law=law)


def titles(law: LawFinding) -> dict[str, str]:
    """The lines of the section, by title."""
    return {line.title: " ".join(filter(None, (line.lead, line.code, line.text))) for line in law_lines(said(law))}


@pytest.mark.parametrize("name", SAID)
def test_page_and_markdown_say_the_same(name: str) -> None:
    told = said(SAID[name])
    page = re.sub(r"\s+", " ", html.unescape(page_html(told)).replace("<wbr>", ""))
    for text in (diagnosis_markdown(told), page):
        assert LAW_TITLE in text and law_words(told) in text
        for line in law_lines(told):
            assert all(part in text for part in (line.title, line.code, line.text))
        assert all(cell in text for row in law_rows(told) for cell in row)


@pytest.mark.parametrize(
    "law", [None, replace(UNTOLD, told=True, alike=())], ids=["friction is known", "LuGre is told"]
)
def test_nothing_is_said_where_there_is_nothing_to_say(law: LawFinding | None) -> None:
    told = said(law)
    assert not law_words(told) and not law_lines(told) and not law_rows(told)
    assert f"<h2>{LAW_TITLE}</h2>" not in page_html(told) and f"## {LAW_TITLE}" not in diagnosis_markdown(told)


def test_the_best_law_comes_first_and_each_has_an_outcome() -> None:
    rows = law_rows(said(ALIKE))
    assert [row[0] for row in rows][:2] == ["Maxwell slip", "elasto-plastic"]
    assert {row[0]: row[3] for row in rows} == {
        "Maxwell slip": "named",
        "elasto-plastic": "not told from it",
        "LuGre": "refuted",
        "Dahl": "refuted",
        "Coulomb-Stribeck without presliding": "refuted",
    }
    # A gain of 0.9 in the logarithm leaves exp(-0.9) = 41 %; one of -1.2 makes 3.3 times as much.
    assert rows[0][1:3] == ("-59 %", "12.0 σ") and rows[-1][1] == "+232 %"
    # LuGre's law without breakaway force and damping is Dahl's: it cannot be refuted by it.
    assert {row[0]: row[3] for row in law_rows(said(DAHL))}["LuGre"] == "holds it as a special case"


def test_a_recording_is_asked_for_where_laws_are_not_told_apart() -> None:
    for law in (UNTOLD, ALIKE):
        assert "presliding distance" in titles(law)["To tell them apart"]
    assert "To tell them apart" not in titles(MAXWELL) and "To tell them apart" not in titles(STIFF)
    assert "Dahl would do as well" in law_words(said(UNTOLD))


def test_the_models_and_the_command_are_named() -> None:
    assert titles(MAXWELL)["In the models"] == "Both have Maxwell slip."
    assert titles(STIFF)["In the models"] == "Both models keep LuGre."
    assert titles(MAXWELL)["To use it"] == "linid fit-motor --model sine --law maxwell_slip CAMPAIGN --out fitted"
    assert "To use it" not in titles(UNTOLD)
    assert "21.4 floors under LuGre, 1.2 under it" in titles(MAXWELL)["Gap above the floor"]
    assert "stiffness of an element over the one before 0.5" in titles(MAXWELL)["Parameters"].lower()


def test_a_rotary_axis_has_a_section_too() -> None:
    told = replace(rotary(), friction_law=UNTOLD)
    assert law_words(told) in diagnosis_markdown(told)


def test_the_law_stands_in_diagnosis_json() -> None:
    read = json.loads(json.dumps(diagnosis_data(said(ALIKE)), allow_nan=False))["friction_law"]
    assert read["law"] == read["base"] == "maxwell_slip" and not read["told"]
    assert read["alike"] == ["elasto_plastic"] and read["parameters"] == OWN
    assert read["gains"]["dahl"] == {"gain": -0.4, "certainty": -3.0}
    assert (read["closed"], read["before"], read["after"]) == (0.93, 21.4, 1.2)
    assert json.loads(json.dumps(diagnosis_data(said(None))))["friction_law"] is None
