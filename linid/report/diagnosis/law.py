"""The friction law in words: which one, how sure, what it closes, which recording would tell it from others."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from linid.physics.wording import fitting_words
from linid.report.diagnosis.content import number, percent, sigma_words
from linid.report.diagnosis.proposal import TermLine, enumerated

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, LawFinding

LAW_TITLE = "Friction law"
LAW_HEADER = ("Friction law", "Misses against LuGre", "Certainty", "Outcome")
LAW_MEANING = (
    "Misses against LuGre: mean square of what the law misses, noise included, in the geometric mean over held-out "
    "rows; the certainty of the difference in deviations from block to block. Fitted along the measured motion."
)
_LUGRE, _UNRESOLVED = "lugre", "coulomb"


def law_told(diagnosis: Diagnosis) -> bool:
    """Whether there is something to say of the friction law: it is not LuGre's, or nobody can tell."""
    law = diagnosis.friction_law
    return law is not None and (law.law != _LUGRE or not law.told)


def law_words(diagnosis: Diagnosis) -> str:
    """The friction law in one or two sentences; empty where LuGre is told, or friction is known."""
    law = diagnosis.friction_law
    if law is None or not law_told(diagnosis):
        return ""
    if law.law == _LUGRE:
        rivals = f"; {_titles(law.alike)} would do as well" if law.alike else ""
        return f"The friction law is not told by these recordings. LuGre is taken{rivals}."
    return _started(law.sentence.removeprefix("Friction law: "))


def law_lines(diagnosis: Diagnosis) -> tuple[TermLine, ...]:
    """What there is to say of the friction law besides its sentence."""
    from linid.diagnosis.law_of_base import PRESLIDING  # compiles: not for those who say nothing of the law
    from linid.physics.laws.registry import find_law

    law = diagnosis.friction_law
    if law is None or not law_told(diagnosis):
        return ()
    lines = [TermLine("What it says", _started(f"{find_law(law.law).meaning}."))]
    if law.base == law.law != _LUGRE:
        floors = f"{number(max(law.before, 0.0))} floors under LuGre, {number(max(law.after, 0.0))} under it"
        lines.append(TermLine("Gap above the floor", f"{floors} (mean square, held-out rows)."))
    own = [f"{p.meaning} {number(law.parameters[p.name])}" for p in find_law(law.law).own if p.name in law.parameters]
    if own:
        lines.append(TermLine("Parameters", _started(f"{enumerated(tuple(own))}.")))
    if law.alike and law.law != _LUGRE:
        lines.append(TermLine("Not told from it", f"{_titles(law.alike)}."))
    if law.alike or law.law == _LUGRE:
        told = fitting_words(PRESLIDING, diagnosis.axis, diagnosis.model)
        lines.append(TermLine("To tell them apart", f"Record {told}."))
    if law.base != law.law:
        text = f"Both models keep {find_law(law.base).title}."
    else:
        text = f"Both have {find_law(law.law).title}."
    lines.append(TermLine("In the models", text))
    if law.law != _LUGRE:
        fit = "fit-friction" if diagnosis.model == "friction" else f"fit-motor --model {diagnosis.model}"
        lines.append(TermLine("To use it", code=f"linid {fit} --law {law.law} CAMPAIGN --out fitted"))
    return tuple(lines)


def law_rows(diagnosis: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """All laws, the best first: how much more or less they miss than LuGre, and what became of them."""
    from linid.physics.laws.registry import find_law

    law = diagnosis.friction_law
    if law is None or not law_told(diagnosis):
        return ()
    ordered = sorted(law.gains.items(), key=lambda item: -item[1][0])
    return tuple(
        (
            find_law(name).title,
            "-" if name == _LUGRE else _signed(math.exp(-gain) - 1.0),
            "-" if name == _LUGRE else sigma_words(certainty) or "-",
            _outcome(law, name),
        )
        for name, (gain, certainty) in ordered
    )


def _outcome(law: LawFinding, name: str) -> str:
    from linid.physics.laws.registry import find_law

    if name == law.law:
        return "taken" if name == _LUGRE and not law.told else "named"
    if name in law.alike:
        return "not told from it"
    if law.law == _UNRESOLVED:
        return "no presliding to be seen"
    contains = name == _LUGRE and find_law(law.law).absent
    return "holds it as a special case" if contains else "refuted" if law.law != _LUGRE else "no better"


def _started(text: str) -> str:
    return text[:1].upper() + text[1:]


def _signed(share: float) -> str:
    return f"+{percent(share)}" if share > 0 else percent(share)


def _titles(names: tuple[str, ...]) -> str:
    from linid.physics.laws.registry import find_law

    return enumerated(tuple(find_law(name).title for name in names))
