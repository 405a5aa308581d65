"""One look for all figures: measured blue, model black, error vermilion (Okabe-Ito, safe for colour-blind readers)."""

from __future__ import annotations

import io
import textwrap
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from linid.report.files import write_atomic

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec

MEASURED = "#0072B2"
MEASURED_LIGHT = "#7FB8D8"
MODEL = "#111111"
ERROR = "#D55E00"
ERROR_LIGHT = "#F2B48A"
ACCENT = "#009E73"
SHADE = "#E7E3DC"
MUTED = "#777777"
NO_DATA = "#E4E4E4"  # cells of a map in which nothing was recorded
PHASES = ("#0072B2", "#E69F00", "#009E73")
WIDTH_MM = 160.0
_INCH = 25.4
_LABEL_MM = 7.0  # from the left edge to a vertical label, of stacked panels
_PNG_LEVEL = 2  # of zlib's nine: three times as fast as the usual one, files a fifth larger
_CAPTION_COLUMNS = 122  # characters of small print on a figure of full width

_RC: Any = {
    "figure.facecolor": "white",
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # no search for a place: nothing stands above the axes
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": "#444444",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 6),
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "lines.linewidth": 1.0,
    "lines.markersize": 2.5,
    "figure.titlesize": 9.5,
    "figure.titleweight": "bold",
    "figure.constrained_layout.h_pad": 0.05,
    "pdf.fonttype": 42,
    "svg.hashsalt": "linid",
    "axes.unicode_minus": True,
    "text.usetex": False,
    "path.simplify": True,
}
# matplotlib's settings belong to the process: figures drawn in threads take turns.
_LOCK = threading.RLock()


@contextmanager
def style() -> Iterator[None]:
    """Matplotlib settings of linid's figures, whatever the user's matplotlibrc says; one thread at a time."""
    import matplotlib

    with _LOCK, matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_RC)
        yield


def new_figure(height_mm: float, title: str = "", width_mm: float = WIDTH_MM) -> Figure:
    """An empty figure with its own Agg canvas, outside pyplot. Call inside `style()`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_mm / _INCH, height_mm / _INCH), layout="constrained")
    FigureCanvasAgg(figure)
    if title:
        figure.suptitle(title, x=0.01, ha="left")
    return figure


def stacked(
    figure: Figure, heights: Sequence[float], *, apart: bool = False, caption_mm: float = 0.0
) -> NDArray[np.object_]:
    """Panels one above the other, (k,) axes, with margins in mm that hold titles, ticks and labels.

    What the constrained layout finds by drawing twice is known for figures that all recordings have. heights: relative;
    apart: each panel has a time axis of its own; caption_mm: what `caption` takes.
    """
    left, right = 19.0, 3.0
    margins, gaps = (left, right, 10.5 + caption_mm, 6.5), (0.0, 16.0 if apart else 6.5)
    cells = grid(figure, len(heights), 1, margins=margins, gaps=gaps, heights=heights)
    panels: NDArray[np.object_] = np.atleast_1d(np.asarray(cells.subplots(sharex=not apart)))
    width = float(figure.get_size_inches()[0]) * _INCH
    for axes in panels:
        axes.yaxis.set_label_coords(-(left - _LABEL_MM) / (width - left - right), 0.5)
    return panels


def grid(
    figure: Figure,
    rows: int,
    columns: int,
    *,
    margins: tuple[float, float, float, float],
    gaps: tuple[float, float] = (0.0, 0.0),
    heights: Sequence[float] | None = None,
    widths: Sequence[float] | None = None,
) -> GridSpec:
    """A grid of panels without a layout engine, which would draw the figure twice.

    margins: left, right, bottom, top in mm, with what stands in them; gaps: between columns and between rows, mm;
    heights, widths: relative.
    """
    inches = figure.get_size_inches()
    width, height = float(inches[0]) * _INCH, float(inches[1]) * _INCH
    left, right, bottom, top = margins
    panel_width = (width - left - right - (columns - 1) * gaps[0]) / columns
    panel_height = (height - bottom - top - (rows - 1) * gaps[1]) / rows
    figure.set_layout_engine(None)
    return figure.add_gridspec(
        rows,
        columns,
        left=left / width,
        right=1.0 - right / width,
        bottom=bottom / height,
        top=1.0 - top / height,
        wspace=gaps[0] / panel_width,
        hspace=gaps[1] / panel_height,
        height_ratios=heights,
        width_ratios=widths,
    )


def save(
    figure: Figure, path_stem: str | Path, formats: Sequence[str] = ("png", "pdf"), title: str | None = None
) -> list[Path]:
    """Write the figure as `path_stem.png` (200 dpi), `.pdf`, `.svg`; equal figures give equal bytes. title: in the
    file's own description."""
    paths = []
    with style():
        for extension in formats:
            buffer = io.BytesIO()
            more: dict[str, Any] = {"pil_kwargs": {"compress_level": _PNG_LEVEL}} if extension == "png" else {}
            about = {**_metadata(extension), **({"Title": title} if title else {})}
            figure.savefig(buffer, format=extension, dpi=200, metadata=about, **more)
            # All formats share the first one's layout, which takes long to find ("none" would look for it again).
            figure.set_layout_engine(None)
            paths.append(write_atomic(Path(f"{path_stem}.{extension}"), buffer.getvalue()))
    return paths


def save_pages(figures: Iterable[Figure], path_stem: str | Path) -> Path:
    """Write figures as the pages of one `path_stem.pdf`; fonts, most of a small file, are embedded once."""
    from matplotlib.backends.backend_pdf import PdfPages

    buffer = io.BytesIO()
    with style(), PdfPages(buffer, metadata=_metadata("pdf")) as pages:
        for figure in figures:
            pages.savefig(figure)
    return write_atomic(Path(f"{path_stem}.pdf"), buffer.getvalue())


def caption(figure: Figure, text: str) -> float:
    """Small print below the axes, wrapped to the figure's width; returns its height in mm."""
    columns = int(figure.get_size_inches()[0] * _INCH / WIDTH_MM * _CAPTION_COLUMNS)
    lines = textwrap.wrap(text, columns)
    figure.supxlabel("\n".join(lines), x=0.01, ha="left", fontsize=7, color="#444444")
    return 1.0 + 3.0 * len(lines)


def _metadata(extension: str) -> dict[str, None]:
    # Dates and version strings would make each file differ.
    empty: dict[str, tuple[str, ...]] = {
        "png": ("Software",),
        "pdf": ("CreationDate", "Creator", "Producer"),
        "svg": ("Date", "Creator"),
    }
    return dict.fromkeys(empty.get(extension, ()))
