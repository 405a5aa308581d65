"""All figures of a fit or a validation, written into a folder under stable names."""

from __future__ import annotations

import gc
import math
import multiprocessing
import signal
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from linid.report.figures.comparison import comparison_figure
from linid.report.figures.convergence import convergence_figure
from linid.report.figures.correlation import correlation_figure
from linid.report.figures.currents import Spline, currents_figure
from linid.report.figures.free_wheel import free_wheel_displacement_figure, free_wheel_velocity_figure
from linid.report.figures.friction_curve import CURVE, friction_curve_figure, speed_covered
from linid.report.figures.gap_bars import gap_figure
from linid.report.figures.overview import overview_figure
from linid.report.figures.profile import profile_figure
from linid.report.files import file_stems
from linid.report.style import save, save_pages

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from linid.diagnosis.gap import RecordingGap, Trace
    from linid.identification.result import FitResult, Profile

# done, total, file stem
Progress = Callable[[int, int, str], None]


class Drawing(NamedTuple):
    """A figure to be drawn and the stem of its files; book: the PDF whose page it is rather, if PDF is wanted; formats:
    of its files, if not all that are wanted; few: whether it is one of the few that are drawn by default."""

    stem: str
    draw: Callable[[], Figure]
    book: str = ""
    formats: Sequence[str] = ()
    few: bool = False


def wanted(drawings: Sequence[Drawing], how_many: str) -> list[Drawing]:
    """Those of the drawings that `few`, `all` or `none` asks for."""
    return [d for d in drawings if how_many == "all" or (how_many == "few" and d.few)]


def worst_recordings(gaps: Iterable[RecordingGap]) -> frozenset[str]:
    """Names of the free wheel and the driven recording with the largest error, held-out ones where there are any.

    The error is that of the free run, over the motion; of driven recordings that of the prediction 0.1 s ahead, m. One
    that is no number is the largest.
    """
    worst: dict[bool, tuple[bool, float, str]] = {}
    for gap in gaps:
        driven = gap.kind != "free_wheel"
        error = gap.ahead if driven else gap.free_run
        rank = (gap.split == "held_out", error if math.isfinite(error) else math.inf, gap.recording)
        worst[driven] = max(worst.get(driven, rank), rank)
    return frozenset(name for _, _, name in worst.values())


def fit_drawings(
    result: FitResult, traces: Sequence[Trace], splines: Mapping[str, Spline] | None = None, worst: Collection[str] = ()
) -> list[Drawing]:
    """What shows a fit: free wheels, friction curve, convergence, correlation, currents, each recording.

    traces: of the fitted recordings; splines: recording name -> spline of its inputs, mapping (m,) s to (k, m); worst:
    names of recordings that belong to the few. Figures that have nothing to show are left out.
    """
    drawings: list[Drawing] = []
    wheels = [trace for trace in traces if trace.kind == "free_wheel"]
    if wheels:
        drawings.append(Drawing("free_wheel_displacement", lambda: free_wheel_displacement_figure(wheels), few=True))
        drawings.append(Drawing("free_wheel_velocity", lambda: free_wheel_velocity_figure(wheels)))
    if set(CURVE) <= {e.name for e in result.estimates}:
        covered = speed_covered(traces)
        drawings.append(
            Drawing("friction_curve", lambda: friction_curve_figure(result, covered, result.seed), few=True)
        )
    if result.history:
        drawings.append(Drawing("convergence", lambda: convergence_figure(result)))
    if len(result.fitted) > 1 and result.correlation.shape == (len(result.fitted),) * 2:
        drawings.append(Drawing("correlation", lambda: correlation_figure(result)))
    drawings += [Drawing(f"profile_{p.name}", _profile_later(result, p), few=True) for p in result.profiles]
    driven = [trace for trace in traces if trace.kind != "free_wheel"]
    if driven:
        drawings.append(Drawing("overview", lambda: overview_figure(driven), few=True))
    for trace, stem in zip(traces, file_stems(t.recording for t in traces), strict=True):
        drawings.append(Drawing(f"comparison_{stem}", _later(trace), "comparison", few=trace.recording in worst))
        inputs = _inputs(trace)
        if inputs is not None and trace.kind != "free_wheel":
            drawings.append(
                Drawing(
                    f"currents_{stem}", _inputs_later(trace, inputs, (splines or {}).get(trace.recording)), "currents"
                )
            )
    return drawings


def validation_drawings(
    gaps: Sequence[RecordingGap], traces: Sequence[Trace], worst: Collection[str] = ()
) -> list[Drawing]:
    """What shows a validation: gap measures, overview page, each recording; worst: names of those among the few."""
    drawings: list[Drawing] = []
    axis = traces[0].axis if traces else "linear"
    if gaps:
        drawings.append(Drawing("gaps", lambda: gap_figure(gaps, axis), few=True))
    if traces:
        drawings.append(Drawing("overview", lambda: overview_figure(traces), few=True))
    for trace, stem in zip(traces, file_stems(t.recording for t in traces), strict=True):
        drawings.append(Drawing(f"comparison_{stem}", _later(trace), "comparison", few=trace.recording in worst))
    return drawings


def inside(folder: str, drawings: Sequence[Drawing]) -> list[Drawing]:
    """The same drawings, their files in a folder of that name."""
    return [d._replace(stem=f"{folder}/{d.stem}", book=d.book and f"{folder}/{d.book}") for d in drawings]


def write_drawings(
    drawings: Sequence[Drawing],
    folder: Path,
    *,
    formats: Sequence[str] = ("png", "pdf"),
    progress: Progress | None = None,
    processes: int = 1,
) -> list[Path]:
    """Write figures into a folder; returns the files in order.

    With PDF among the formats those of single recordings are pages of `comparison.pdf` and `currents.pdf`, else files
    of their own. progress is called after each with (done, total, stem); processes: that draw at once.
    """
    folder = Path(folder)

    def pages(book: str) -> Callable[[], list[Path]]:
        return lambda: [save_pages((d.draw() for d in drawings if d.book == book), folder / book)]

    def files(drawing: Drawing) -> Callable[[], list[Path]]:
        return lambda: save(drawing.draw(), folder / drawing.stem, drawing.formats or formats)

    books = sorted({d.book for d in drawings if d.book}) if "pdf" in formats else []
    tasks = [(book, pages(book)) for book in books]  # the longest ones first
    tasks += [(d.stem, files(d)) for d in drawings if d.book not in books]
    paths: list[Path] = []
    for index, written in enumerate(_in_processes(lambda k: tasks[k][1](), len(tasks), processes)):
        paths += written
        if progress is not None:
            progress(index + 1, len(tasks), tasks[index][0])
    return paths


_task: Callable[[int], list[Path]]  # of a process that draws


def _in_processes(function: Callable[[int], list[Path]], count: int, processes: int) -> Iterator[list[Path]]:
    """The results of function(0) ... function(count - 1) in order.

    Processes are forks, which share what there is to draw; where the system has none, one after the other.
    """
    processes = min(processes, count)
    if processes < 2 or not sys.platform.startswith("linux"):
        yield from map(function, range(count))
        return
    context = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(processes, context, _begin_drawing, (function,)) as pool:
        try:
            yield from pool.map(_draw, range(count))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _begin_drawing(function: Callable[[int], list[Path]]) -> None:
    global _task
    _task = function
    gc.freeze()  # what the parent holds is not to be searched for garbage here, which takes a fifth of the time
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the parent, which ends this
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _draw(index: int) -> list[Path]:
    return _task(index)


def _later(trace: Trace) -> Callable[[], Figure]:
    return lambda: comparison_figure(trace)


def _profile_later(result: FitResult, profile: Profile) -> Callable[[], Figure]:
    return lambda: profile_figure(result, profile)


def _inputs_later(trace: Trace, inputs: np.ndarray, spline: Spline | None) -> Callable[[], Figure]:
    return lambda: currents_figure(trace.recording, trace.t, inputs, spline, unit=trace.input_unit)


def _inputs(trace: Trace) -> np.ndarray | None:
    if trace.phase_currents is not None:
        return trace.phase_currents
    return None if trace.drive_input is None else np.atleast_2d(trace.drive_input)
