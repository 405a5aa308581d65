"""The page of a diagnosis: one HTML file that needs neither network nor server."""

from __future__ import annotations

import json
from dataclasses import asdict
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from linid.report.diagnosis.budget import (
    budget_lines,
    closed_words,
    rest_words,
    waterfall,
    waterfall_words,
    where_words,
    which_words,
)
from linid.report.diagnosis.changes import change_words
from linid.report.diagnosis.compensation import (
    COMPENSATION_TITLE,
    compensation_setting,
    compensation_tables,
    compensation_words,
)
from linid.report.diagnosis.content import (
    TRIED_MEANING,
    after_words,
    before_words,
    changed,
    effect_meanings,
    findings,
    force_word,
    held_out,
    pairs_left_out,
    scale_words,
    tried_rows,
)
from linid.report.diagnosis.exports import EXPORTS_HEADER, EXPORTS_MEANING, EXPORTS_TITLE, export_rows
from linid.report.diagnosis.law import LAW_HEADER, LAW_MEANING, LAW_TITLE, law_lines, law_rows, law_words
from linid.report.diagnosis.measures import measure_lines, measure_meanings, measure_remarks, state_meaning
from linid.report.diagnosis.proposal import TERM_TITLE, headline, term_lines, term_measures
from linid.report.diagnosis.term_view import term_view, view_words
from linid.report.diagnosis.words import in_print
from linid.report.figures.diagnosis_pairs import PAIRS_MEANING
from linid.report.figures.diagnosis_where import map_words
from linid.report.page.pieces import Plot
from linid.report.page.plots import curve_plots, map_plots, pole_pair_plot, shares_plot, spectrum_plot, trace_plot
from linid.report.page.plots_budget import measure_plots, pair_plots, waterfall_plot
from linid.report.page.plots_compensation import compensation_plots
from linid.report.page.plots_term import term_plots
from linid.report.residual_views import worst_first

if TYPE_CHECKING:
    from linid.diagnosis.report_data import Diagnosis


def page_html(diagnosis: Diagnosis) -> str:
    """The whole page: verdict, budget, figures, next recording, assumptions; equal diagnoses give equal bytes."""
    import jinja2
    from plotly.offline import get_plotlyjs

    diagnosis = in_print(diagnosis)
    folder = files("linid.report.page")
    texts = {name: (folder / name).read_text(encoding="utf-8") for name in ("page.html.j2", "page.css", "page.js")}
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["breakable"] = _breakable
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
        "waterfall": [waterfall_plot(diagnosis)] if waterfall(diagnosis) else [],
        "term": term_plots(diagnosis),
        "measures": measure_plots(diagnosis),
        "compensation": compensation_plots(diagnosis),
        "shares": [shares_plot(diagnosis)] if diagnosis.where else [],
        "curves": curve_plots(diagnosis),
        "pairs": pair_plots(diagnosis),
        "maps": map_plots(diagnosis) if traces else [],
        "pole_pair": [pole_pair_plot(diagnosis)] if poles else [],
        "spectrum": [spectrum_plot(diagnosis)] if traces else [],
    }


def _words(diagnosis: Diagnosis) -> dict[str, Any]:
    """All texts and tables of the page."""
    from linid.recording.checks import CHECKS_LEGEND, checks_table

    measures, meanings = measure_lines(diagnosis, diagnosis.measures), measure_meanings(diagnosis.axis)
    return {
        "name": diagnosis.name,
        "status": diagnosis.verdict.status.split()[0],
        "status_words": headline(diagnosis),
        "verdict": diagnosis.verdict,
        **_law_words(diagnosis),
        **_term_words(diagnosis),
        **_compensation_words(diagnosis),
        **_export_words(diagnosis),
        "where_words": where_words(diagnosis),
        "which_words": which_words(diagnosis),
        "closed_words": closed_words(diagnosis),
        "waterfall_words": waterfall_words(diagnosis),
        "rest_words": rest_words(diagnosis),
        "scale_words": scale_words(diagnosis),
        "word": force_word(diagnosis.axis),
        "meanings": effect_meanings(diagnosis),
        "changed": changed(diagnosis),
        "before_words": before_words(diagnosis),
        "after_words": after_words(diagnosis),
        "budget": budget_lines(diagnosis),
        "measures": measures,
        "remarks": measure_remarks(diagnosis, diagnosis.measures),
        "state_meaning": state_meaning(),
        "per_recording": [(one.recording, measure_lines(diagnosis, one.changes)) for one in held_out(diagnosis)],
        "tried": tried_rows(diagnosis),
        "tried_meaning": TRIED_MEANING,
        "pairs_meaning": f"{PAIRS_MEANING} {pairs_left_out(diagnosis)}".strip(),
        "map_words": map_words(diagnosis),
        "checks": checks_table(diagnosis.checks),
        "checks_legend": CHECKS_LEGEND,
        "findings": findings(diagnosis),
        "terms": [(m.label, meanings[m.measure]) for m in measures],
        "warnings": diagnosis.warnings,
        "changes": change_words(diagnosis),
        "assumptions": (*diagnosis.assumptions, *diagnosis.combinations),
        "model": diagnosis.model,
        "axis": diagnosis.axis,
        "base_effects": ", ".join(diagnosis.base_effects),
        "seed": diagnosis.seed,
        "recordings": len(diagnosis.recordings),
        "held_out": len(held_out(diagnosis)),
    }


def _law_words(diagnosis: Diagnosis) -> dict[str, Any]:
    """What the page says of the friction law."""
    return {
        "law_title": LAW_TITLE,
        "law_words": law_words(diagnosis),
        "law_lines": law_lines(diagnosis),
        "law_header": LAW_HEADER,
        "law_rows": law_rows(diagnosis),
        "law_meaning": LAW_MEANING,
    }


def _term_words(diagnosis: Diagnosis) -> dict[str, Any]:
    """What the page says of a proposed term."""
    view = term_view(diagnosis)
    return {
        "term": diagnosis.proposal,
        "term_title": TERM_TITLE,
        "term_lines": term_lines(diagnosis),
        "term_measures": term_measures(diagnosis),
        "term_words": view_words(view) if view is not None else "",
    }


def _compensation_words(diagnosis: Diagnosis) -> dict[str, Any]:
    """What the page says of a feed-forward."""
    return {
        "compensation_title": COMPENSATION_TITLE,
        "compensation_words": compensation_words(diagnosis),
        "compensation_tables": compensation_tables(diagnosis),
        "compensation_setting": compensation_setting(diagnosis),
    }


def _export_words(diagnosis: Diagnosis) -> dict[str, Any]:
    """What the page says of other programs."""
    tables = [(EXPORTS_HEADER, rows)] if (rows := export_rows(diagnosis)) else []
    return {"export_title": EXPORTS_TITLE, "export_tables": tables, "export_meaning": EXPORTS_MEANING}


def _breakable(name: str) -> Any:
    """A name that a narrow table may break after its underscores."""
    from markupsafe import Markup, escape

    return Markup(str(escape(name)).replace("_", "_<wbr>"))


def _script_data(value: Any) -> Any:
    """JSON that may stand inside a script element."""
    from markupsafe import Markup

    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    # A recording may be called anything, even </script>.
    return Markup(text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))
