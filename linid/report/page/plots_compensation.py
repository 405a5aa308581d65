"""The following error over time, under each feed-forward."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from linid.report.diagnosis.compensation import CASES, compensation_display
from linid.report.display import display_unit, envelope, peak
from linid.report.page.pieces import Plot, base_layout, line
from linid.report.style import ACCENT, ERROR, MEASURED, MUTED

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis

_BINS = 700


def compensation_plots(diagnosis: Diagnosis) -> list[Plot]:
    """The first reference: following errors above, the command below; nothing where there is no figure."""
    told = diagnosis.compensation
    if told is None or not told.courses:
        return []
    course, display = told.courses[0], compensation_display(diagnosis)
    colours = {"without": ERROR, "base": ACCENT, "full": MEASURED}
    cases = [case for case in CASES if told.effects or case[0] != "base"]
    data = []
    for case, title in cases:
        drawn = envelope(course.t, getattr(course, case) * display.factor, _BINS)
        data.append(line(*drawn, title.lower(), colours[case], width=1.0))
    position = display_unit("position", diagnosis.axis, peak(course.reference))
    motion = line(*envelope(course.t, course.reference * position.factor, _BINS // 3), "command", MUTED)
    data.append({**motion, "yaxis": "y2", "showlegend": False})
    layout = base_layout("time (s)", f"following error ({display.unit})", 380)
    layout["yaxis"] |= {"domain": [0.32, 1.0]}
    layout["yaxis2"] = layout["yaxis"] | {"domain": [0.0, 0.22], "title": {"text": f"command ({position.unit})"}}
    layout["xaxis"] |= {"anchor": "y2"}
    largest = [f"{title.lower()} {np.max(np.abs(getattr(course, case))):.3g}" for case, title in cases]
    alt = f"Following error along {course.recording} over time; largest, in SI: {'; '.join(largest)}."
    return [Plot("compensation", alt, data, layout)]
