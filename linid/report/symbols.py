"""Symbols and units as LaTeX mathematics, which matplotlib's mathtext reads as well."""

from __future__ import annotations

import re
import unicodedata

_GREEK = re.compile(
    r"alpha|beta|gamma|delta|epsilon|zeta|eta|theta|iota|kappa|lambda|mu|nu|xi|pi|rho|sigma|tau|phi|chi|psi|omega|"
    r"Gamma|Delta|Theta|Lambda|Xi|Pi|Sigma|Phi|Psi|Omega"
)
_SYMBOL = re.compile(r"^([A-Za-z]+)(\d*)((?:_[A-Za-z0-9+-]+)*)('*)$")
_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "±": r"$\pm$",
    "µ": r"$\mu$",
    "²": r"$^{2}$",
    "→": r"$\to$",
    "≈": r"$\approx$",
}
_NAMES = {"lambda": "lamda", "Lambda": "lamda"}  # as Unicode spells it
_SUPERSCRIPT = str.maketrans("0123456789-+()kpn", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺⁽⁾ᵏᵖⁿ")
_POWER = re.compile(r"\^(-?\d+|[kpn]\b|\([-+\dkpn]+\))")
_PRIME = re.compile(r"(?<![\w'])([A-Za-z])'(?![\w'])")


def symbol_math(symbol: str) -> str:
    """LaTeX mathematics (without dollars) of a plain symbol: `sigma_0` -> `\\sigma_{0}`, `F_C` -> `F_{C}`."""
    match = _SYMBOL.match(symbol)
    if match is None:
        return r"\mathrm{" + re.sub(r"[^A-Za-z0-9]+", r"\\,", symbol) + "}"
    base, digits, subscripts, primes = match.groups()
    subs = [_letters(part) for part in ([digits] if digits else []) + subscripts.split("_")[1:]]
    return _letters(base) + ("_{" + ",".join(subs) + "}" if subs else "") + primes


def symbol_parts(symbol: str) -> tuple[str, str]:
    """A symbol and its subscript as plain Unicode, for HTML: `sigma_0` -> (`σ`, `0`)."""
    match = _SYMBOL.match(symbol)
    if match is None:
        return symbol, ""
    base, digits, subscripts, primes = match.groups()
    subs = ([digits] if digits else []) + subscripts.split("_")[1:]
    return _unicode(base) + primes.replace("'", "′"), ",".join(_unicode(part) for part in subs)


def symbol_label(symbol: str) -> str:
    """A symbol for matplotlib text."""
    return f"${symbol_math(symbol)}$"


def unit_math(unit: str) -> str:
    """LaTeX mathematics of a unit: `kg m^2` -> `\\mathrm{kg\\,m^{2}}`; `1` stays 1."""
    body = re.sub(r"\^(-?\d+(?:\.\d+)?)", r"^{\1}", unit)
    body = body.replace("µ", r"\mu ").replace("°", r"^{\circ}").replace("%", r"\%").replace(" ", r"\,")
    return r"\mathrm{" + body + "}"


def unit_label(unit: str) -> str:
    """A unit for axis labels: `N s^2/m^2` -> `N s²/m²`."""
    return _POWER.sub(lambda m: m.group(1).translate(_SUPERSCRIPT), unit)


def typeset(text: str) -> str:
    """Running text with the signs of print: `m/s^2`, `2 +- 1`, `z'` -> `m/s²`, `2 ± 1`, `z′`."""
    return _PRIME.sub(r"\1′", unit_label(text).replace("+-", "±"))


def latex_escape(text: str) -> str:
    """Running text made safe for LaTeX."""
    return "".join(_SPECIAL.get(char, char) for char in text)


def _unicode(part: str) -> str:
    if not _GREEK.fullmatch(part):
        return part
    return unicodedata.lookup(f"GREEK {'CAPITAL' if part[0].isupper() else 'SMALL'} LETTER {_NAMES.get(part, part)}")


def _letters(part: str) -> str:
    if _GREEK.fullmatch(part):
        return "\\" + part
    return part if len(part) == 1 or part.isdigit() else r"\mathrm{" + part + "}"
