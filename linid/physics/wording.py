"""Words and units that fit an axis: rotary axes have no stroke, motors with one input no phase to feed alone."""

from __future__ import annotations

import re

_ROTARY = (
    (r"\b(in the middle and at|near|at) both ends of the stroke", r"\1 both ends of the range"),
    (r"\bthe (?:whole|full) stroke of\b", "the whole range of"),
    (r"\bthe (?:whole|full) stroke\b", "whole revolutions"),
    (r"\bthe middle of the stroke\b", "the middle of the range"),
    (r"\bthe same stroke\b", "the same range"),
    (r"\ba longer stroke\b", "a larger range"),
    (r"\bthe stroke\b", "the range"),
    (r"\bseveral pole pitches\b", "several poles"),
    (r"\bmore pole pitches\b", "more poles"),
    (r"\bpole pitch\b", "angle of a pole"),
    (r"\bmotor force\b", "motor torque"),
    (r"\balong the guideway\b", "around the turn"),
    (r"\bguideway\b", "rotor"),
    (r"\b1 to 20 mm/s\b", "0.01 to 1 rad/s"),
    (r"\badded masses\b", "added inertias"),
    (r"\badded mass\b", "added inertia"),
)
_ONE_INPUT = (
    (
        r"(?:move the axis under a constant current or )?feed one phase alone(?:, so that the currents do not sum to "
        r"zero|: the third field harmonic is invisible while the currents sum to zero)?",
        "record free wheels with and without a known added mass",
    ),
    (r", with reactive current\b", ""),
)


def fitting_words(text: str, axis: str, kind: str) -> str:
    """A text on recordings or physics in the words of this axis (linear, rotary) and kind of motor model.

    Applied twice it changes nothing more.
    """
    from linid.physics.effects.effect import PHASE_MOTORS  # compiles: not for those who only print

    for pattern, words in _ONE_INPUT if kind not in PHASE_MOTORS else ():
        text = re.sub(pattern, words, text)
    for pattern, words in _ROTARY if axis == "rotary" else ():
        text = re.sub(pattern, words, text)
    return text


def scaled_unit(unit: str, axis: str, scale: str) -> str:
    """The unit of a quantity when all forces are divided by a mass (kg) or inertia (kg m^2) that nobody knows.

    scale: what they are divided by, "" nothing. A torque per inertia is an angular acceleration.
    """
    above = unit.split("/")[0].split()
    if not scale or "N" not in above or "kg" in unit:
        return unit
    if axis != "rotary":
        top, _, below = unit.partition("/")
        return f"{top}/({below} kg)" if below and not below.startswith("(") else f"{unit}/kg"
    return "rad/s^2" if unit == "N m" else f"{unit} per kg m^2"


def scaled_text(text: str, axis: str, scale: str) -> str:
    """A text with quantities in N (rotary: N m) when all forces are divided by a mass or inertia that nobody knows.

    scale: as in `scaled_unit`. Applied twice it changes nothing more.
    """
    if not scale:
        return text
    return re.sub(r"\bN m\b", "rad/s²", text) if axis == "rotary" else re.sub(r"\bN\b(?! m\b|/kg)", "N/kg", text)
