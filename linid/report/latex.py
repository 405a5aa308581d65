"""Tables as LaTeX (booktabs), ready for \\input; the preamble needs \\usepackage{booktabs}."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from decimal import Decimal
from typing import TYPE_CHECKING

from linid.physics.own_terms.own_term import OwnTerm, is_own, parse_term
from linid.physics.wording import scaled_unit
from linid.report.numbers import Rounded, common_exponent, estimate_text, format_number, plain, round_estimate
from linid.report.symbols import latex_escape, symbol_math, unit_math

if TYPE_CHECKING:
    from linid.diagnosis.gap import RecordingGap
    from linid.identification.result import Estimate, FitResult

_PREAMBLE = "% needs \\usepackage{booktabs}\n"
_MANY = 4  # numbered coefficients of an own term, from which on they stand with its formula
_STATUS = {"fixed": " (fixed)", "at_bound": " (at bound)"}


def parameter_latex(result: FitResult) -> str:
    """The parameter table of a fit as a booktabs tabular, derived quantities below a rule, notes below the table."""
    notes = [e.note for e in (*tabled(result), *result.derived) if e.note]
    lines = [
        r"\begin{tabular}{@{}lllll@{}}",
        r"\toprule",
        r"Parameter & Symbol & Value & 95\,\% interval & Unit \\",
        r"\midrule",
    ]
    number = 0
    for group in (tabled(result), result.derived):
        if group is result.derived and result.derived:
            lines.append(r"\midrule")
        for estimate in group:
            number += bool(estimate.note)
            lines.append(_parameter_row(estimate, f"$^{{{number}}}$" if estimate.note else ""))
    lines.append(r"\bottomrule")
    lines += [_note(5, f"$^{{{i}}}$ {latex_escape(note)}") for i, note in enumerate(notes, 1)]
    lines += [_note(5, latex_escape(note)) for note in formula_notes(result)]
    return _PREAMBLE + "\n".join([*lines, r"\end{tabular}"]) + "\n"


def formula_notes(result: FitResult) -> list[str]:
    """The own terms of a fit, each with its formula, and its coefficients where they are many."""
    unit = "N m" if result.axis == "rotary" else "N"
    unit = scaled_unit(unit, result.axis, "kg" if result.per_mass else "")
    return [
        f"{term.name} = {term.formula} in {unit}{_numbered(term, coefficients)}"
        for term, coefficients in _coefficients(result)
    ]


def tabled(result: FitResult) -> tuple[Estimate, ...]:
    """The estimates that have rows of a table: all but the coefficients that stand with their formulas."""
    noted = {e.name for _, coefficients in _coefficients(result) for e in coefficients}
    return tuple(e for e in result.estimates if e.name not in noted)


def _coefficients(result: FitResult) -> list[tuple[OwnTerm, list[Estimate]]]:
    """Own terms with their coefficients that are only numbered, none where they are few."""
    out = []
    for term in (parse_term(name) for name in result.effects if is_own(name)):
        numbered = re.compile(rf"{term.name}_(c_)?\d+\Z")
        found = [e for e in result.estimates if numbered.match(e.name)]
        out.append((term, found if len(found) >= _MANY else []))
    return out


def _numbered(term: OwnTerm, coefficients: Sequence[Estimate]) -> str:
    """Coefficients in words: what of them is held, and their values in order."""
    if not coefficients:
        return ""
    tied = [e for e in coefficients if e.note.startswith("in proportion to")]
    held = " (held; the intervals take them as exact)" if all(e.status == "fixed" for e in coefficients) else ""
    if tied:
        held = f" (their ratios are held, their size is known to {_relative(tied)})"
    values = ", ".join(f"{e.value:.3g}" if held else _with_std(e) for e in coefficients)
    return f"; {coefficients[0].name} to {coefficients[-1].name.removeprefix(f'{term.name}_')}{held}: {values}"


def _relative(estimates: Sequence[Estimate]) -> str:
    largest = max(estimates, key=lambda e: abs(e.value))
    share = largest.std / max(abs(largest.value), 1e-300)
    return f"{100.0 * share:.2g} %" if math.isfinite(share) else "no digit"


def _with_std(estimate: Estimate) -> str:
    if estimate.status == "fixed":
        return f"{estimate.value:.3g}"
    rounded = round_estimate(estimate.value, estimate.std, estimate.low, estimate.high, estimate.status)
    return estimate_text(rounded)


def gap_latex(gaps: Sequence[RecordingGap], axis: str = "linear") -> str:
    """The gap table as a booktabs tabular; the floor stands in brackets."""
    ahead = r"\mu rad" if axis == "rotary" else r"\mu m"
    per_mass = any(gap.per_mass for gap in gaps)
    force = unit_math(scaled_unit("N m" if axis == "rotary" else "N", axis, "kg" if per_mass else ""))
    lines = [
        r"\begin{tabular}{@{}lllrrrr@{}}",
        r"\toprule",
        r"Recording & Kind & Split & Free run & 0.1\,s ahead & Force & Force \\",
        rf" & & & \% & $\mathrm{{{ahead}}}$ & ${force}$ & \% \\",
        r"\midrule",
    ]
    for gap in gaps:
        cells = [latex_escape(text.replace("_", " ")) for text in (gap.kind, gap.split)]
        cells = [latex_escape(gap.recording + ("*" if gap.repeats else "")), *cells]
        cells += [
            _with_floor(100 * gap.free_run, 100 * gap.free_run_floor),
            _with_floor(1e6 * gap.ahead, 1e6 * gap.ahead_floor),
            _with_floor(gap.force, gap.force_floor),
            _measure(100 * gap.force_share, 3),
        ]
        lines.append(" & ".join(cells) + r" \\")
    lines += [r"\bottomrule", _note(7, latex_escape(f"In brackets: the floor. {floor_note(gaps)}"))]
    return _PREAMBLE + "\n".join([*lines, r"\end{tabular}"]) + "\n"


def floor_note(gaps: Sequence[RecordingGap]) -> str:
    """What the floors hold, in a sentence."""
    noise = "noise of encoder and current sensors"
    repeated = sum(gap.repeats > 0 for gap in gaps)
    if not repeated:
        return f"Floor: {noise} alone; no repeated recordings, so the machine's own scatter is not in it."
    if repeated == len(gaps):
        return f"Floor: {noise}, and scatter between repeats."
    return f"Floor: {noise}; with * also the scatter between repeats."


def estimate_math(rounded: Rounded) -> str:
    """`value \\pm std` of a rounded estimate in LaTeX."""
    if rounded.value is None or rounded.kind == "unknown":
        return "not identifiable"
    if rounded.kind == "magnitude":
        return f"not identifiable, ${{\\sim}}{_math(rounded.value)}$"
    suffix = _STATUS.get(rounded.status, "")
    if rounded.std is None:
        return f"${_math(rounded.value)}$" + suffix
    value, std, exponent = common_exponent(rounded.value, rounded.std)
    if exponent is None:
        return f"${_power(value)} \\pm {_power(std)}$" + suffix
    return f"$({value} \\pm {std}) \\times 10^{{{exponent}}}$" + suffix


def _parameter_row(estimate: Estimate, mark: str) -> str:
    rounded = round_estimate(estimate.value, estimate.std, estimate.low, estimate.high, estimate.status)
    interval = ""
    if rounded.low is not None and rounded.high is not None:
        interval = f"$[{_math(rounded.low)},\\ {_math(rounded.high)}]$"
    cells = (
        latex_escape(estimate.name.replace("_", " ")) + mark,
        f"${symbol_math(estimate.symbol)}$" if estimate.symbol else "",
        estimate_math(rounded),
        interval,
        "--" if estimate.unit in ("", "1") else f"${unit_math(estimate.unit)}$",
    )
    return " & ".join(cells) + r" \\"


def _math(number: Decimal) -> str:
    if not number.is_finite():
        return r"\infty" if number > 0 else r"-\infty"
    return _power(plain(number))


def _power(text: str) -> str:
    mantissa, mark, exponent = text.partition("e")
    return f"{mantissa} \\times 10^{{{exponent}}}" if mark else mantissa


def _with_floor(value: float, floor: float) -> str:
    return f"{_measure(value, 3)} ({_measure(floor, 2)})"


def _measure(value: float, digits: int) -> str:
    text = format_number(value, digits)
    if "inf" in text:
        return r"$\infty$"
    return "--" if text == "nan" else f"${_power(text)}$"


def _note(columns: int, text: str) -> str:
    # Without a paragraph column a long note would widen the table beyond the page.
    return rf"\multicolumn{{{columns}}}{{@{{}}p{{0.9\linewidth}}@{{}}}}{{\footnotesize {text}}} \\"
