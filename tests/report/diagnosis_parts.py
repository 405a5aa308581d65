"""What synthetic diagnoses are made of: forces of known physics, their residuals, shares, pairs and budgets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from linid.diagnosis.report_data import (
    MEASURES,
    Budget,
    Change,
    Entry,
    PairShare,
    RecordingChange,
    ResidualTrace,
    Share,
)
from linid.recording import Reading, Recording, RecordingChecks, checks_of

from .samples import NAN

Array = np.ndarray
FIELD = 222.0
DEVIATION = 0.06
Force = Callable[[Array, Array, Array], Array]


def cogging(t: Array, y: Array, v: Array) -> Array:
    """A force of the first and second order of the field's angle, N."""
    return 0.9 * np.sin(FIELD * y + 0.4) + 0.35 * np.sin(2 * FIELD * y)


def cable(t: Array, y: Array, v: Array) -> Array:
    """A linear spring over the stroke, N."""
    return 2.4 * (y - 0.35)


def drag(t: Array, y: Array, v: Array) -> Array:
    """Friction that is stronger forwards, and drag with the square of the speed, N."""
    return -0.3 * np.sign(v) * (v > 0) - 0.9 * v * np.abs(v)


def push(t: Array, y: Array, v: Array) -> Array:
    """A slow wave in time that no effect of the library knows, N."""
    return 0.8 * np.sin(2 * np.pi * 0.31 * t) * np.sin(2 * np.pi * 1.7 * t)


def nothing(t: Array, y: Array, v: Array) -> Array:
    """No force, N."""
    return np.zeros_like(t)


def traces(force: Force, left: Force = nothing, count: int = 6) -> tuple[ResidualTrace, ...]:
    """Moves of different length and speed at 1 kHz."""
    made = []
    for number in range(count):
        rng = np.random.default_rng(number)
        t = np.arange(4000 + 500 * number) * 1e-3
        stroke, rate = 0.12 + 0.05 * number, 0.35 + 0.11 * number
        y = 0.35 + stroke * np.sin(2 * np.pi * rate * t) * np.cos(0.6 * t) + 0.004 * number
        v = np.gradient(y, t)
        kernel = np.ones(9) / 9
        noise = np.convolve(rng.normal(0, 3 * DEVIATION, len(t)), kernel, "same")
        before, after = force(t, y, v) + noise, left(t, y, v) + noise
        split = "held_out" if number % 3 == 2 else "fit"
        name = f"moves_{number + 1}"
        made.append(ResidualTrace(name, "motor", split, t, y, v, before, after, DEVIATION))
    return tuple(made)


def share(all_traces: tuple[ResidualTrace, ...], coordinate: str, label: str, unit: str, values: list[Array]) -> Share:
    """Variance share of bin means of the residual over a coordinate; bins with equal counts."""
    x, force = np.concatenate(values), np.concatenate([t.before for t in all_traces])
    few = np.unique(x)
    edges = np.append(few, few[-1] + 1) if len(few) < 9 else np.quantile(x, np.linspace(0, 1, 31))
    place = np.clip(np.searchsorted(edges, x, "right") - 1, 0, len(edges) - 2)
    count = np.bincount(place, minlength=len(edges) - 1)
    mean = np.bincount(place, force, len(edges) - 1) / count
    rest = force - mean[place]
    spread = np.sqrt(np.bincount(place, rest**2, len(edges) - 1) / count / np.maximum(count / 40, 1))
    explained = float(1 - rest.var() / force.var()) - 0.004
    centres = few.astype(float) if len(few) < 9 else (edges[1:] + edges[:-1]) / 2
    return Share(coordinate, label, unit, explained, 0.0005 if explained > 0.02 else 0.41, centres, mean, spread)


def shares(all_traces: tuple[ResidualTrace, ...], field: float | None) -> tuple[Share, ...]:
    """The usual coordinates."""
    columns: list[tuple[str, str, str, list[Array]]] = [
        ("velocity", "velocity", "m/s", [t.v for t in all_traces]),
        ("position", "position", "m", [t.y for t in all_traces]),
        ("direction", "direction of motion", "1", [np.sign(t.v) for t in all_traces]),
        ("time", "time in the recording", "s", [t.t for t in all_traces]),
        ("recording", "recording", "1", [np.full(len(t.t), i + 1.0) for i, t in enumerate(all_traces)]),
    ]
    if field is not None:
        angle = [np.mod(field * t.y, 2 * np.pi) for t in all_traces]
        columns.append(("pole_phase", "position within two pole pitches", "rad", angle))
    return tuple(share(all_traces, *column) for column in columns)


def recordings(all_traces: tuple[ResidualTrace, ...]) -> tuple[RecordingChange, ...]:
    """Measures of each recording; the positions follow the forces."""
    made = []
    for t in all_traces:
        before, after = float(np.sqrt(np.mean(t.before**2))), float(np.sqrt(np.mean(t.after**2)))
        changes = {
            "free_run": Change(0.031 * before, 0.031 * after, 0.025 * t.deviation),
            "ahead": Change(4.8e-5 * before, 4.8e-5 * after, 3.6e-5 * t.deviation),
            "force": Change(before, after, 0.9 * t.deviation),
        }
        made.append(RecordingChange(t.recording, t.kind, t.split, changes))
    return tuple(made)


def pair_share(
    all_traces: tuple[ResidualTrace, ...],
    x: tuple[str, str, str, list[Array]],
    y: tuple[str, str, str, list[Array]],
    form: Any,
    share: float,
) -> PairShare:
    """Cell means of the residual over two coordinates (name, label, unit, values)."""
    values, force = [np.concatenate(c[3]) for c in (x, y)], np.concatenate([t.before for t in all_traces])
    edges = [np.linspace(one.min(), one.max(), count + 1) for one, count in zip(values, (24, 8), strict=True)]
    rows, *_ = np.histogram2d(values[1], values[0], bins=edges[::-1])
    total, *_ = np.histogram2d(values[1], values[0], bins=edges[::-1], weights=force)
    mean = np.where(rows >= 5, total / np.maximum(rows, 1), NAN)
    p_value = 0.001 if share > 0.02 else 0.4
    return PairShare(
        x[0], y[0], x[1], y[1], x[2], y[2], form, share, p_value, edges[0], edges[1], mean, rows.astype(np.int64)
    )


def pairs(all_traces: tuple[ResidualTrace, ...]) -> tuple[PairShare, ...]:
    """A table, a proportion, one that overlaps with the first, one by chance."""
    position = ("position", "position", "m", [t.y for t in all_traces])
    velocity = ("velocity", "velocity", "m/s", [t.v for t in all_traces])
    time = ("time", "time in the recording", "s", [t.t for t in all_traces])
    current = ("current", "current", "A", [np.gradient(t.v, t.t) for t in all_traces])
    direction = ("direction", "direction of motion", "1", [np.sign(t.v) for t in all_traces])
    return (
        pair_share(all_traces, position, velocity, "table", 0.12),
        pair_share(all_traces, time, current, "proportional", 0.06),
        pair_share(all_traces, position, current, "proportional", 0.04),
        pair_share(all_traces, time, direction, "table", 0.001),
    )


def checks(all_traces: tuple[ResidualTrace, ...], axis: Any = "linear") -> tuple[RecordingChecks, ...]:
    """The checks of the recordings behind the traces; the second one has gaps."""
    made = []
    for place, t in enumerate(all_traces):
        rng = np.random.default_rng(place)
        y = np.round((t.y + 2e-7 * rng.normal(size=t.y.size)) / 1e-7) * 1e-7
        made.append(
            Recording(
                t.recording,
                t.t.copy(),
                y,
                drive_input=np.gradient(t.v, t.t),
                axis=axis,
                split=t.split,  # type: ignore[arg-type]
                reading=Reading(0.0, gaps=2, missing=170, longest_gap=0.11) if place == 1 else None,
            )
        )
    return checks_of(made)


def together(rows: tuple[RecordingChange, ...]) -> dict[str, Change]:
    """Root mean square over the held-out recordings, with an interval for a new one."""
    found = {}
    for measure in MEASURES:
        some = [r.changes[measure] for r in rows if r.split == "held_out"]
        before, after, floor = (
            float(np.sqrt(np.mean([getattr(c, end) ** 2 for c in some]))) for end in ("before", "after", "floor")
        )
        found[measure] = Change(before, after, floor, 0.82 * after, 1.31 * after)
    return found


def entry(effect: str, share: float, half: float = 0.04, rivals: tuple[str, ...] = (), **more: Any) -> Entry:
    """An entry whose measures shrink by its share."""

    def change(after: float, floor: float) -> Change:
        return Change(after * float(np.sqrt(1.0 + 3.0 * share)), after, floor)

    measures = {"free_run": change(0.006, 0.0009), "ahead": change(9e-6, 2.2e-6), "force": change(0.21, 0.057)}
    values: dict[str, Any] = {
        "first_in": share + 0.03,
        "last_in": share - 0.02,
        "certainty": 60 * share,
        "measures": measures,
    }
    return Entry(effect, rivals, share, share - half, share + half, **{**values, **more})


def budget_of(*entries: Entry, measures: dict[str, Change], **more: Any) -> Budget:
    """The budget of some entries: what they leave is unexplained."""
    before, floor = measures["force"].before, measures["force"].floor
    closed = sum(e.share for e in entries)
    after = float(np.sqrt(before**2 - closed * (before**2 - floor**2)))
    excess = (before**2 - floor**2) / floor**2
    values: dict[str, Any] = {"ceiling": 0.4, "depends_on": ("time in the recording",)}
    return Budget(
        before,
        after,
        floor,
        excess,
        (1 - closed) * excess,
        closed,
        closed - 0.02,
        min(closed + 0.02, 1.0),
        1 - closed,
        max(1 - closed - 0.02, 0.0),
        min(1 - closed + 0.02, 1.0),
        entries,
        **{**values, **more},
    )
