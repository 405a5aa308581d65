"""Recognition of channels by the names that drive makers give them; documented patterns, no guessing."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from linid.recording.mapping import PHASES, VOLTAGES, Role
from linid.recording.units import find_unit


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


# A column with one of these words is a demand or a difference, not a measurement.
_NOT_MEASURED = _words(
    "command commanded cmd target set setpoint setpos desired demand demanded reference ref soll sollwert error err "
    "deviation lag following limit max min diff difference nominal profile profiled planned"
)
# An angle or position of these is not the axis': the motor's field, a regulator's result.
_NOT_THE_AXIS = _words(
    "electrical electric elec elektrisch elektrischer commutation kommutierung kommutierungswinkel commut phase field "
    "hall sector controller regulator regler reglerausgang output modulation pwm virtual simulated estimated"
)
_MEASURED = _words("actual act measured feedback ist istwert")
_TIME = re.compile(
    r"(?:t|time|zeit|time ?stamp|(?:sample|elapsed|relative|rel) time|time (?:axis|rel|[mu]s)|x ?axis)(?: \d+| [a-z])?"
)
_POSITION = _words("position pos actpos lage weg displacement angle winkel istposition istpos theta")
_VELOCITY = _words("velocity vel velo speed geschwindigkeit drehzahl actvel actvelo")
_CURRENT = r"(?:current|currents|curr|cur|strom)"
_VOLTAGE = r"(?:voltage|voltages|volt|spannung)"
_Q_CURRENT = re.compile(
    rf"(?:.* )?(?:i ?q|q(?: axis)? {_CURRENT}|{_CURRENT} q|(?:torque|quadrature|active) {_CURRENT})(?: (?:act|actual))?"
)
_COMMAND = re.compile(
    r"(?:.* )?(?:torque|force|current|voltage|control|motor|drive|iq|i q)(?: \w+)? "
    r"(?:command|cmd|demand|setpoint|reference|output)"
)
_AXIS = re.compile(
    r"\b(?:axis|achse|ax|drive|antrieb|motor|mot|joint|servo|slave|node|station|amp) ?(\d{1,3}|[xyz])\b"
    r"|\b([xyz]) (?:axis|achse)\b"
)
# Words, not units, where they end a name after an underscore: pos_in (an input), pos_min (a minimum).
_NO_UNITS_HERE = _words("in min h")
_LONGEST = 300  # characters; what is longer names nothing
_PHASE_SETS = (("u", "v", "w"), ("a", "b", "c"), ("1", "2", "3"), ("r", "s", "t"))


_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]+")


def plain(text: str) -> str:
    """A foreign name without line feeds and other control characters, which would break tables and terminals."""
    return _CONTROL.sub(" ", text).strip()


def normalised(name: str) -> str:
    """Lower-case words: `ActPos`, `I_q`, `Q-Current` -> `act pos`, `i q`, `q current`."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Za-z]{2})(?=\d)", " ", name[:_LONGEST])
    return " ".join(re.findall(r"[a-z0-9äöüß]+", spaced.lower()))


def split_header(header: str) -> tuple[str, str | None]:
    """Name and unit of a header cell: `Name (mm)`, `Name [A]`, `Name / mm`, `Name, mm`, `Name_mm`.

    The unit text is returned as written, also when it is unknown (in brackets only).
    """
    text = header.strip().strip('"').lstrip("#%").strip()
    if len(text) > _LONGEST:
        return text, None
    brackets = re.findall(r"[(\[{<]([^()\[\]{}<>]*)[)\]}>]", text)
    known = [content for content in brackets if find_unit(content) and content.strip() not in ("1", "-")]
    if known or brackets:
        unit = known[-1] if known else brackets[-1]
        name = re.sub(rf"\s*[(\[{{<]{re.escape(unit)}[)\]}}>]", "", text).strip()
        return (name, unit.strip()) if known or not re.fullmatch(r"\s*\d*\s*", unit) else (text, None)
    for pattern in (r"(.+?)\s+(?:/|in)\s*(\S+)", r"(.+?)\s*/\s*(\S+)", r"(.+?),\s*(\S+)"):
        match = re.fullmatch(pattern, text)
        if match and find_unit(match[2]):
            return match[1].strip(), match[2]
    match = re.fullmatch(r"(.+)_([A-Za-zµμ]+)", text)
    # One letter after an underscore may be a phase (I_A) or `measured` (q_m): only time_s is clear.
    if match and find_unit(match[2]) and (len(match[2]) > 1 or normalised(match[1]) in ("t", "time")):
        return (text, None) if match[2].lower() in _NO_UNITS_HERE else (match[1], match[2])
    return text, None


def is_time(name: str) -> bool:
    """Whether a column of this name counts time."""
    return name.strip() != "T" and bool(_TIME.fullmatch(normalised(name)))  # T is a temperature


def candidates(names: Sequence[str]) -> dict[Role, list[int]]:
    """For each channel, the indices of the columns whose names fit it (several: ambiguous)."""
    words = [normalised(name) for name in names]
    found: dict[Role, list[int]] = {
        "time": [i for i, name in enumerate(names) if is_time(name)],
        "position": _measured(words, _POSITION),
        "velocity": _measured(words, _VELOCITY),
        "current_q": _best([i for i, w in enumerate(words) if _Q_CURRENT.fullmatch(w) and _is_measured(w)], words),
        "command": [i for i, w in enumerate(words) if _COMMAND.fullmatch(w) or w == "command"],
    }
    for roles, is_phase in ((PHASES, _is_phase_current), (VOLTAGES, _is_phase_voltage)):
        found |= dict(zip(roles, _phases(words, is_phase), strict=True))
    return found


def looks_like_position(name: str) -> bool:
    """Whether a name speaks of a position that is another one than the axis', such as the electrical angle."""
    words = set(normalised(name).split())
    return bool(_POSITION & words) and bool(_NOT_THE_AXIS & words)


def axis_of(name: str) -> str | None:
    """Which axis of several a name says that it belongs to (`Axis2.Iq`: axis 2), or None."""
    match = _AXIS.search(normalised(name))
    return (match[1] or match[2]) if match else None


def _is_measured(words: str) -> bool:
    return not _NOT_MEASURED & set(words.split())


def _measured(words: Sequence[str], keys: frozenset[str]) -> list[int]:
    fitting = [i for i, w in enumerate(words) if keys & set(w.split()) and _is_measured(w)]
    return _best([i for i in fitting if not _NOT_THE_AXIS & set(words[i].split())], words)


def _best(indices: list[int], words: Sequence[str]) -> list[int]:
    """Columns that say `actual` win over those that say nothing."""
    actual = [i for i in indices if _MEASURED & set(words[i].split())]
    return actual or indices


def _phases(words: Sequence[str], is_phase: Callable[[str, str], bool]) -> list[list[int]]:
    """Columns of the three phases; a set counts from two of three on, two sets are ambiguous."""
    complete = []
    for letters in _PHASE_SETS:
        columns = [[i for i, w in enumerate(words) if is_phase(w, letter)] for letter in letters]
        if sum(bool(c) for c in columns) >= 2:
            complete.append(columns)
    if not complete:
        return [[], [], []]
    return [sorted({i for columns in complete for i in columns[k]}) for k in range(3)]


def _is_phase_current(words: str, letter: str) -> bool:
    pattern = (
        rf"(?:.* )?(?:i ?{letter}|i l ?{letter}|{_CURRENT} (?:phase |l ?|i ?)?{letter}|phase l? ?{letter} {_CURRENT}"
        rf"|{letter} (?:phase )?{_CURRENT})(?: (?:act|actual))?"
    )
    return bool(re.fullmatch(pattern, words)) and _is_measured(words)


def _is_phase_voltage(words: str, letter: str) -> bool:
    if letter.isdigit() and not re.search(r"\bphase\b|\bl ?\d|^u ?\d", words):
        return False  # `Input Voltage 1` may be anything
    # A phase before the phase, as in `u v voltage`, means the voltage between the two.
    symbol = "u ?" if letter.isdigit() else "[uv] " if letter in "abc" else "u "
    pattern = (
        rf"(?:(?:.* )?{_VOLTAGE} (?:phase )?(?:l ?)?{letter}"
        rf"|(?:.*[a-zäöüß]{{2}} )?(?:l ?)?{letter} (?:phase )?{_VOLTAGE}"
        rf"|{symbol}(?:l ?)?{letter})(?: (?:act|actual))?"
    )
    return bool(re.fullmatch(pattern, words)) and _is_measured(words)
