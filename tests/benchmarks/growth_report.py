"""Measured growth as a figure with fitted slopes and as a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.report.style import ACCENT, ERROR, MEASURED, MODEL, new_figure, save, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DECADE, _ALL = 0.1, 0.0  # of the largest size: the slope is fitted from there on
_LEAST_MB = 1.0  # below which added memory is that of chance


@dataclass(frozen=True)
class Point:
    """One measurement. seconds: processor time by what was done (and the number of parameters under `parameters`);
    peak_mb: largest resident memory of the process; base_mb: the same before the measurement."""

    series: str
    size: int
    seconds: dict[str, float]
    peak_mb: float
    base_mb: float

    def stored(self) -> dict[str, Any]:
        """As JSON holds it."""
        return asdict(self)

    @property
    def text(self) -> str:
        """In one line."""
        times = ", ".join(f"{name} {value:.3g}" for name, value in self.seconds.items())
        return f"{self.series:<11}{self.size:>9}  {times} s, {self.peak_mb:.0f} MB (before: {self.base_mb:.0f})"


@dataclass(frozen=True)
class Line:
    """One curve: sizes and values (n,), both above zero; begin: share of the largest size where the fit begins."""

    label: str
    x: Sequence[float]
    y: Sequence[float]
    begin: float = _DECADE

    @property
    def fitted(self) -> tuple[float, float, float]:
        """Slope, factor and first size of the power law through the largest sizes; slope nan for a single point."""
        x, y = np.array(self.x), np.array(self.y)
        used = x >= self.begin * x.max() * (1.0 - 1e-9)
        if used.sum() < 2:
            return float("nan"), float("nan"), float(x[-1])
        slope, level = np.polyfit(np.log(x[used]), np.log(y[used]), 1)
        return float(slope), float(np.exp(level)), float(x[used][0])


def line_of(
    points: Sequence[Point],
    series: str,
    label: str,
    value: Callable[[Point], float],
    size: str = "",
    begin: float = _DECADE,
) -> Line:
    """The curve of a series; size: name of the value that is the abscissa (default: the size itself)."""
    rows = sorted((p for p in points if p.series == series), key=lambda p: p.size)
    pairs = [(p.seconds[size] if size else float(p.size), value(p)) for p in rows]
    pairs = [(x, y) for x, y in pairs if y > 0.0]
    return Line(label, [x for x, _ in pairs], [y for _, y in pairs], begin)


def _seconds(name: str) -> Callable[[Point], float]:
    return lambda point: point.seconds[name]


def _memory(point: Point) -> float:
    added = point.peak_mb - point.base_mb
    return added if added >= _LEAST_MB else 0.0


def panels(points: Sequence[Point]) -> list[tuple[str, str, str, list[Line]]]:
    """Title, abscissa, ordinate and curves of every panel."""
    time, memory = "processor time in s", "added peak memory in MB"
    return [
        (
            "Length of a recording",
            "samples",
            time,
            [
                line_of(points, "fit", "linid fit-friction", _seconds("linid fit-friction")),
                line_of(points, "read", "read", _seconds("read")),
                line_of(points, "evaluate", "cost of a candidate", _seconds("one candidate"), begin=_ALL),
            ],
        ),
        (
            "Length of a recording",
            "samples",
            memory,
            [
                line_of(points, "fit", "linid fit-friction", _memory),
                line_of(points, "evaluate", "costs of 8 candidates", _memory),
                line_of(points, "read", "read", _memory),
            ],
        ),
        (
            "Number of recordings of 1000 samples",
            "recordings",
            time,
            [
                line_of(points, "recordings", "read all", _seconds("read"), begin=_ALL),
                line_of(points, "recordings", "cost of a candidate", _seconds("one candidate"), begin=_ALL),
            ],
        ),
        (
            "Population, 1000 samples",
            "candidates",
            time,
            [line_of(points, "population", "costs of all", _seconds("population"), begin=_ALL)],
        ),
        (
            "Number of parameters, 10 000 samples",
            "parameters",
            time,
            [
                line_of(points, "effects", "Jacobian, effects added", _seconds("Jacobian"), "parameters", _ALL),
                line_of(points, "effects", "a candidate, effects added", _seconds("one candidate"), "parameters", _ALL),
                line_of(points, "parameters", "Jacobian, the same effects", _seconds("Jacobian"), begin=_ALL),
            ],
        ),
        (
            "Memory besides length",
            "recordings, candidates",
            memory,
            [
                line_of(points, "recordings", "recordings: read, cost", _memory),
                line_of(points, "population", "candidates: costs", _memory),
            ],
        ),
    ]


def write_report(points: Sequence[Point], out: Path) -> None:
    """growth.png and growth.md in the folder `out`."""
    with style():
        figure = new_figure(190.0, "How time and memory grow with the size of the task", 200.0)
        for axes, (title, x, y, lines) in zip(figure.subplots(3, 2).ravel(), panels(points), strict=True):
            axes.set(title=title, xlabel=x, ylabel=y, xscale="log", yscale="log")
            for line, colour in zip(lines, (MEASURED, ERROR, ACCENT), strict=False):
                _draw(axes, line, colour)
            if axes.has_data():
                _make_room(axes)
                axes.legend(loc="upper left")
        save(figure, out / "growth", ("png",))
    (out / "growth.md").write_text(table(points), encoding="utf-8")


def _draw(axes: Axes, line: Line, colour: str) -> None:
    """Points, and the power law fitted to the largest of them."""
    if not line.x:
        return
    slope, factor, begin = line.fitted
    label = f"{line.label}: slope {slope:.2f}" if np.isfinite(slope) else line.label
    axes.plot(line.x, line.y, marker="o", markersize=3.5, color=colour, label=label)
    if np.isfinite(slope):
        x = np.array([begin, max(line.x)])
        axes.plot(x, factor * x**slope, color=MODEL, linewidth=0.7, linestyle="--")


def _make_room(axes: Axes) -> None:
    """Room for the legend above the curves, and numbers on an axis of less than two decades."""
    from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.4)
    left, right = axes.get_xlim()
    axes.xaxis.set_minor_formatter(NullFormatter())
    if right < 100.0 * left:
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(ScalarFormatter())


def table(points: Sequence[Point]) -> str:
    """All points as a Markdown table."""
    rows = ["| series | size | processor time | peak memory in MB | before |", "|---|---|---|---|---|"]
    for p in sorted(points, key=lambda p: (p.series, p.size)):
        times = ", ".join(
            f"{name} {value:.0f}" if name == "parameters" else f"{name} {value:.3g} s"
            for name, value in p.seconds.items()
        )
        rows.append(f"| {p.series} | {p.size} | {times} | {p.peak_mb:.0f} | {p.base_mb:.0f} |")
    return "\n".join(rows) + "\n"
