"""Checks of recordings before anything is fitted: what clock, input and encoder can be trusted with."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Collection, Sequence
from dataclasses import asdict, replace
from typing import Any

from linid.arrays import Array
from linid.recording.check_field import commutation, pushing_current
from linid.recording.check_findings import Finding, RecordingChecks, compared, findings_of
from linid.recording.check_input import input_checks, saturation
from linid.recording.check_position import angle, end_stop, resolution
from linid.recording.noise import quantum
from linid.recording.recording import Reading, Recording
from linid.recording.timebase import gaps, jitter

_FOLLOWS = 0.5  # coherence: the input accounts for most of the acceleration
_SIDED = 0.1  # correlation: nearer to zero its sign may be chance
HEADER = (
    "Recording",
    "Follows",
    "Band Hz",
    "Late ms",
    "Jitter %",
    "Missing",
    "At limit %",
    "Step",
    "Noise",
    "Floor %",
    "Field",
)
_MEANINGS = (
    (
        ("Follows", "Band Hz"),
        "Follows: share of the acceleration's power in the band that follows the input; in brackets where it proves "
        "nothing.",
    ),
    (("Late ms",), "Late: acceleration after input."),
    (("At limit %",), "At limit: of the time."),
    (("Step", "Noise"), "Step, noise: of the position, SI."),
    (("Floor %",), "Floor: acceleration that the position's noise feigns in 15 ms."),
    (("Field",), "Field: electrical angle per position, 1/m or pole pairs."),
)


def checks_legend(shown: Collection[str] = HEADER) -> str:
    """What the shown columns of `checks_table` mean, of columns that explain themselves nothing."""
    return "\n".join(textwrap.wrap(" ".join(text for titles, text in _MEANINGS if set(titles) & set(shown)), 116))


CHECKS_LEGEND = checks_legend()


def checks_of(
    recordings: Sequence[Recording], thrust: Sequence[Array | None] | None = None
) -> tuple[RecordingChecks, ...]:
    """The checks of each recording, in order, with findings on each alone and on those that differ from the others.

    thrust: per recording (n,) what pushes the axis up to a factor, where a model knows it better than the q-current,
    the command, or the phase currents along the direction in which they turn with the position. Some ms each.
    """
    given = thrust if thrust is not None else [None] * len(recordings)
    found = [_checks(recording, one) for recording, one in zip(recordings, given, strict=True)]
    odd = compared(found)
    return tuple(replace(c, findings=(*c.findings, *(f for f in odd if f.recording == c.name))) for c in found)


def _checks(recording: Recording, thrust: Array | None) -> RecordingChecks:
    reading = recording.reading if recording.reading is not None else _reading(recording)
    field = commutation(recording)
    push = thrust if thrust is not None else pushing_current(recording, field)
    coherence, delay = input_checks(recording, reading.position_step, push)
    phased = thrust is None and recording.phase_currents is not None
    pushing = recording.drive_input if push is None and recording.phase_currents is None else push
    # The side on which the input pushes is known by what it accelerates, where it does.
    known = coherence.judged and coherence.value > _FOLLOWS and abs(coherence.correlation) > _SIDED
    sense = 0 if not known else (1 if coherence.correlation > 0.0 else -1)
    checks = RecordingChecks(
        name=recording.name,
        axis=recording.axis,
        kind=recording.kind,
        split=recording.split,
        samples=int(recording.y.size),
        period=recording.period,
        duration=recording.duration,
        phased=phased,
        reading=reading,
        coherence=coherence,
        delay=delay,
        saturation=saturation(recording, reading.input_step),
        resolution=resolution(recording, reading.position_step),
        angle=angle(recording, reading.position_step),
        commutation=field,
        end_stop=end_stop(recording, pushing, reading.position_step, sense),
    )
    return replace(checks, findings=findings_of(checks))


def _reading(recording: Recording) -> Reading:
    """The facts of a recording that was not read from a file, as far as its arrays hold them."""
    count, missing, longest, _ = gaps(recording.t)
    channels = recording.inputs
    return Reading(
        jitter=jitter(recording.t),
        gaps=count,
        missing=missing,
        longest_gap=longest,
        position_step=quantum(recording.y),
        input_step=0.0 if channels is None else quantum(channels.ravel()),
    )


def all_findings(checks: Sequence[RecordingChecks]) -> tuple[Finding, ...]:
    """The findings of all recordings, warnings first."""
    found = [f for c in checks for f in c.findings]
    return tuple(sorted(found, key=lambda f: f.level != "warning"))


def joined_findings(checks: Sequence[RecordingChecks]) -> tuple[tuple[str, str, str], ...]:
    """(level, recordings, text) for people: findings of one check on many recordings as one, told by the first."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in all_findings(checks):
        groups.setdefault((finding.level, finding.check), []).append(finding)
    rows = []
    for (level, _), found in groups.items():
        names = list(dict.fromkeys(f.recording for f in found))
        where = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more ({', '.join(names[1:4])}"
        where += "" if len(names) == 1 else (", ...)" if len(names) > 4 else ")")
        rows.append((level, where, found[0].text))
    return tuple(rows)


def checks_data(checks: Sequence[RecordingChecks]) -> list[dict[str, Any]]:
    """The checks as plain dicts, lists, numbers and strings, None where a number is not to be had."""
    return [_plain(asdict(c)) for c in checks]


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


def checks_table(checks: Sequence[RecordingChecks]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows of strings for console, page and Markdown; '-' where there is no number or it is not judged."""
    return HEADER, [_row(c) for c in checks]


def _row(c: RecordingChecks) -> tuple[str, ...]:
    k, r = c.coherence, c.resolution
    band = f"{k.low:.3g}-{k.high:.3g}" if math.isfinite(k.low) else "-"
    late = f"{1e3 * c.delay.seconds:.2g}±{1e3 * c.delay.deviation:.1g}" if c.delay.sharp else "-"
    follows = "-" if math.isnan(k.value) else (f"{k.value:.3f}" if k.judged else f"({k.value:.2f})")
    limit = max(c.saturation.share, c.saturation.rate_share)
    return (
        c.name,
        follows,
        band,
        late,
        _short(100.0 * c.reading.jitter, 1e-3),
        str(c.reading.missing) if c.reading.missing else "-",
        _short(100.0 * limit, 1e-3),
        _short(r.step),
        _short(r.noise),
        _short(100.0 * r.floor / r.acceleration if r.acceleration > 0.0 else math.nan),
        "-" if math.isnan(c.commutation.wavenumber) else f"{c.commutation.wavenumber:.4g}",
    )


def _short(value: float, least: float = 0.0) -> str:
    return f"{value:.2g}" if math.isfinite(value) and value > least else "-"
