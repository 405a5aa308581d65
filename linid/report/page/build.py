"""The page of a diagnosis: one HTML file that needs neither network nor server."""

from __future__ import annotations

import json
from dataclasses import asdict
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from linid.report.diagnosis_content import (
    CLOSURE_MEANING,
    MEASURE_MEANING,
    STATUS_WORDS,
    after_words,
    before_words,
    by_share,
    ceiling_words,
    changed,
    chosen,
    effect_meanings,
    held_out,
    measure_lines,
    p_words,
    rank_lines,
    share_words,
    totals,
)
from linid.report.figures.diagnosis_where import map_words
from linid.report.numbers import estimate_text, interval_text
from linid.report.page.plots import (
    Plot,
    curve_plots,
    map_plots,
    measure_plots,
    pole_pair_plot,
    ranking_plot,
    shares_plot,
    spectrum_plot,
    trace_plot,
)
from linid.report.residual_views import worst_first
from linid.report.symbols import symbol_parts, unit_label
from linid.report.tables import rounded

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis


def page_html(diagnosis: Diagnosis) -> str:
    """The whole page: verdict, numbers, figures, next recording, assumptions; equal diagnoses give equal bytes."""
    import jinja2
    from plotly.offline import get_plotlyjs

    folder = files("linid.report.page")
    texts = {name: (folder / name).read_text(encoding="utf-8") for name in ("page.html.j2", "page.css", "page.js")}
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    plots = _plots(diagnosis)
    traces = {t.recording: trace_plot(diagnosis, t) for t in worst_first(diagnosis.traces)}
    first = list(traces.values())[:1]
    drawn = [plot for group in plots.values() for plot in group] + first
    return environment.from_string(texts["page.html.j2"]).render(
        **_words(diagnosis),
        plots=plots,
        trace=first,
        trace_names=[(t.recording, t.split.replace("_", " ")) for t in worst_first(diagnosis.traces)],
        css=texts["page.css"],
        script=texts["page.js"],
        plotly=get_plotlyjs(),
        figures=_script_data([asdict(plot) for plot in drawn]),
        traces=_script_data({name: asdict(plot) for name, plot in traces.items()}),
    )


def _plots(diagnosis: Diagnosis) -> dict[str, list[Plot]]:
    """The figures by section."""
    traces = bool(diagnosis.traces)
    poles = traces and diagnosis.field_wavenumber is not None
    return {
        "measures": measure_plots(diagnosis),
        "ranking": [ranking_plot(diagnosis)] if diagnosis.candidates else [],
        "shares": [shares_plot(diagnosis)] if diagnosis.where else [],
        "curves": curve_plots(diagnosis),
        "maps": map_plots(diagnosis) if traces else [],
        "pole_pair": [pole_pair_plot(diagnosis)] if poles else [],
        "spectrum": [spectrum_plot(diagnosis)] if traces else [],
    }


def _words(diagnosis: Diagnosis) -> dict[str, Any]:
    """All texts and tables of the page."""
    measures = measure_lines(diagnosis, totals(diagnosis))
    candidate = chosen(diagnosis)
    return {
        "name": diagnosis.name,
        "status": diagnosis.verdict.status,
        "status_words": STATUS_WORDS[diagnosis.verdict.status],
        "verdict": diagnosis.verdict,
        "meanings": effect_meanings(diagnosis),
        "changed": changed(diagnosis),
        "before_words": before_words(diagnosis),
        "after_words": after_words(diagnosis),
        "measures": measures,
        "per_recording": [(one.recording, measure_lines(diagnosis, one.changes)) for one in held_out(diagnosis)],
        "ranking": rank_lines(diagnosis),
        "parameters": [_parameter(one) for one in candidate.parameters] if candidate is not None else [],
        "where": [(s.label, share_words(s), p_words(s.p_value)) for s in by_share(diagnosis)],
        "ceiling": ceiling_words(diagnosis),
        "map_words": map_words(diagnosis),
        "closure_meaning": CLOSURE_MEANING,
        "terms": [(m.label, MEASURE_MEANING[m.measure]) for m in measures],
        "warnings": diagnosis.warnings,
        "assumptions": diagnosis.assumptions,
        "model": diagnosis.model,
        "axis": diagnosis.axis,
        "base_effects": ", ".join(diagnosis.base_effects),
        "seed": diagnosis.seed,
        "recordings": len(diagnosis.recordings),
        "held_out": len(held_out(diagnosis)),
    }


def _parameter(estimate: Any) -> dict[str, Any]:
    value = rounded(estimate)
    return {
        "name": estimate.name.replace("_", " "),
        "symbol": symbol_parts(estimate.symbol),
        "value": estimate_text(value),
        "interval": interval_text(value),
        "unit": "" if estimate.unit == "1" else unit_label(estimate.unit),
        "note": estimate.note,
    }


def _script_data(value: Any) -> Any:
    """JSON that may stand inside a script element."""
    from markupsafe import Markup

    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    # A recording may be called anything, even </script>.
    return Markup(text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))
