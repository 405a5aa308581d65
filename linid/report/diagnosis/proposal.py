"""The proposed term in words: what it depends on, what it closes, what it is like, whether the models have it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from linid.diagnosis.proposed.quantities import STRIBECK
from linid.diagnosis.report_data import MEASURES
from linid.physics.wording import fitting_words
from linid.report.diagnosis.content import STATUS_WORDS, force_word, interval_percent, p_words, percent
from linid.report.diagnosis.measures import WORSE, MeasureLine, measure_lines, state
from linid.report.result_files import MODEL_AFTER

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis, ProposedTerm, ShortFormula

TERM_TITLE = "A term for what is left"
_SPOKEN = {"free_run": "the free run", "ahead": "the prediction 0.1 s ahead"}
# What a formula calls an argument.
_LETTERS = {
    "position": "y",
    "velocity": "v",
    "motor_force": "F",
    "acceleration": "a",
    "time": "t",
    "campaign_time": "T",
}
_NAMED = re.compile(r"\w+\s*:")  # an own term with its name
_TEST = "To test it, "
_FINER = "the term may well be a part of what it does in another form, and is no sign of another cause."


@dataclass(frozen=True)
class TermLine:
    """One thing said of the term, in this order: lead, code (a formula, a command, a name), text; '' what is not."""

    title: str
    lead: str = ""
    code: str = ""
    text: str = ""


def enumerated(words: tuple[str, ...]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def argument_words(diagnosis: Diagnosis) -> str:
    """What the proposed term depends on: `position and motor force`; empty if none is proposed."""
    from linid.physics.effects.effect import ARGUMENTS  # compiles: not for those who propose nothing

    if diagnosis.proposal is None:
        return ""
    shared = [name for name in diagnosis.proposal.arguments if name != "recording"]
    labels = [ARGUMENTS.get(name, name.replace("_", " ")) for name in shared]
    words = enumerated(tuple(fitting_words(label, diagnosis.axis, diagnosis.model) for label in labels))
    if len(shared) == len(diagnosis.proposal.arguments):
        return words
    return f"{words}, another in each recording," if words else "the recording"


def refined_words(diagnosis: Diagnosis) -> str:
    """The named effects of whose form the term may be a part: `cogging and end effect`; empty if there are none."""
    names = () if diagnosis.proposal is None else diagnosis.proposal.refines
    return enumerated(tuple(name.replace("_", " ") for name in names))


def headline(diagnosis: Diagnosis) -> str:
    """The verdict in a few words, with the term that is proposed for what has no known cause."""
    words = STATUS_WORDS[diagnosis.verdict.status]
    if diagnosis.proposal is None or diagnosis.verdict.status not in ("partly explained", "unknown"):
        return words
    return f"{words}; {_proposed(diagnosis)}"


def proposed_words(diagnosis: Diagnosis) -> str:
    """`; a term of position is proposed`, to go on with after what is known; empty if none is."""
    return f"; {_proposed(diagnosis)}" if diagnosis.proposal is not None else ""


def _proposed(diagnosis: Diagnosis) -> str:
    words, refined = argument_words(diagnosis), refined_words(diagnosis)
    if refined:
        return f"a finer form of {refined} is proposed"
    return f"a term of {words} is proposed" if words else "a constant term is proposed"


def term_closed_words(diagnosis: Diagnosis) -> str:
    """How much of the rest the term closes, in one sentence; empty if none is proposed."""
    term = diagnosis.proposal
    if term is None:
        return ""
    interval, chance = interval_percent(term.low, term.high), p_words(term.p_value)
    return (
        f"The proposed term closes {percent(term.closed)}{f' {interval}' if interval else ''} of what is left"
        f"{f' ({chance})' if chance else ''}."
    )


def term_lines(diagnosis: Diagnosis) -> tuple[TermLine, ...]:
    """What there is to say of the proposed term besides its sentence."""
    term = diagnosis.proposal
    if term is None:
        return ()
    lines = []
    left_out = [label for label in term.not_on if label not in term.sentence]
    if left_out:
        lines.append(
            TermLine(
                "Nor on" if len(left_out) < len(term.not_on) else "Not on",
                f"{enumerated(tuple(left_out))}, beyond chance.",
            )
        )
    if term.short is not None:
        lines.append(TermLine("Short formula", code=term.short.text, text=_short_words(diagnosis, term, term.short)))
    refined = refined_words(diagnosis)
    if refined:
        verb = "depends" if len(term.refines) == 1 else "depend"
        lines.append(TermLine("Form of an effect", f"{_raised(refined)} {verb} on the same: {_FINER}"))
    for one in term.resembles:
        text = f"reproduces {percent(one.alike)} of the term" + (f"; {one.difference}" if one.difference else "")
        lines.append(TermLine("Resembles", code=one.effect, text=_ended(text)))
    lines.append(TermLine("In the models", _model_words(diagnosis, term)))
    if term.next_experiment and term.next_experiment != diagnosis.verdict.next_experiment:
        asked = term.next_experiment.removeprefix(_TEST)
        lines.append(TermLine("To test it", _raised(asked)))
    return (*lines, *_use_lines(diagnosis, term))


def term_measures(diagnosis: Diagnosis) -> tuple[MeasureLine, ...]:
    """The three measures without the term and with it; none where it was not simulated."""
    return () if diagnosis.proposal is None else measure_lines(diagnosis, diagnosis.proposal.measures)


def _short_words(diagnosis: Diagnosis, term: ProposedTerm, short: ShortFormula) -> str:
    from linid.physics.effects.effect import ARGUMENTS

    count = f"{short.numbers} fitted number{'' if short.numbers == 1 else 's'}"
    said = [
        f"{letter}: {fitting_words(ARGUMENTS[name], diagnosis.axis, diagnosis.model)}"
        for name, letter in _LETTERS.items()
        if re.search(rf"(?<![A-Za-z]){letter}(?![A-Za-z])", short.text.replace(STRIBECK, ""))
    ]
    if STRIBECK in short.text:
        said.append(f"{STRIBECK}: friction of steady sliding over that of fast sliding")
    return f"closes {percent(short.closed)} of what is left with {count}" + (f" ({', '.join(said)})." if said else ".")


def _model_words(diagnosis: Diagnosis, term: ProposedTerm) -> str:
    """Whether the models after have the term, and if not, why."""
    if term.kept:
        spoils_none = "with it no held-out recording is predicted worse, chance apart"
        return f"{MODEL_AFTER} has it as a term of its own: {spoils_none}."
    if not term.effect and term.curve is None:
        return "Left out: each recording has its own coefficients, which say nothing of a new recording."
    if not term.effect:
        return "Left out: a simulation cannot know what it depends on."
    spoken = {**_SPOKEN, "force": f"the residual {force_word(diagnosis.axis)}"}
    worse = [spoken[name] for name in MEASURES if name in term.measures and state(term.measures[name]) == WORSE]
    if worse:
        verb = "gets" if len(worse) == 1 else "get"
        return f"Left out: with it {enumerated(tuple(worse))} {verb} worse, all held-out recordings together."
    if term.measures:
        return "Left out: with it not every held-out recording is predicted as well as without."
    return "Left out: no simulation with it was made."


def _use_lines(diagnosis: Diagnosis, term: ProposedTerm) -> list[TermLine]:
    """How to have the term in a fit: by name, and written out."""
    if not term.effect:
        return []
    lines, effect = [], term.effect if _NAMED.match(term.effect) else f"learned: {term.effect}"
    if diagnosis.model != "friction":
        command = f"linid fit-motor --model {diagnosis.model} --effect learned CAMPAIGN --out motor"
        lines.append(TermLine("To use it", code=command, text="looks for it again and fits it with the motor."))
    return [*lines, TermLine("Written out", code=f'--effect "{effect}"')]


def _raised(text: str) -> str:
    return text[:1].upper() + text[1:]


def _ended(text: str) -> str:
    return text if text.endswith(".") else f"{text}."
