"""What is written of a diagnosis says what the diagnosis says, in JSON, Markdown, figures and on the console."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from linid.diagnosis.report_data import Budget, Change, Diagnosis, Verdict
from linid.report.diagnosis.budget import budget_lines, waterfall
from linid.report.diagnosis.console import diagnosis_console
from linid.report.diagnosis.content import percent
from linid.report.diagnosis.files import diagnosis_data, write_diagnosis
from linid.report.diagnosis.markdown import diagnosis_markdown
from linid.report.diagnosis.words import in_axis_words, in_print
from linid.report.figures.diagnosis_pairs import pairs_figure
from linid.report.figures.diagnosis_traces import residual_trace_figure
from linid.report.figures.diagnosis_waterfall import waterfall_figure
from linid.report.style import ERROR, MEASURED

from .diagnosis_parts import DEVIATION, entry
from .diagnosis_samples import SAMPLES, explained, partly, rotary, unknown
from .samples import NAN


def strict(text: str) -> Any:
    """JSON as the standard has it: no NaN, no Infinity."""

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All files of the sample with four effects."""
    path = tmp_path_factory.mktemp("diagnosis")
    written = write_diagnosis(partly(), path)
    assert sorted(written) == sorted(p for p in path.rglob("*") if p.is_file())
    return path


def test_json_has_the_agreed_schema(folder: Path) -> None:
    data, source = strict((folder / "diagnosis.json").read_text(encoding="utf-8")), partly()
    assert data["schema"] == 2 and data["name"] == "axis_07" and data["force_scale"] == ""
    assert data["verdict"] == {
        "status": "partly explained",
        "effects": ["cogging", "cable_force", "asymmetric_friction", "quadratic_drag"],
        "equivalent": ["position_dependent_friction"],
        "sentence": source.verdict.sentence,
        "next_experiment": source.verdict.next_experiment,
    }
    stated, budget = data["budget"], source.budget
    assert stated["gap"] == stated["excess_before"] == budget.excess_before
    for key in ("before", "after", "floor", "excess_after", "closed"):
        assert stated[key] == getattr(budget, key)
    assert stated["closed_interval"] == [budget.closed_low, budget.closed_high]
    assert stated["unexplained"] == {
        "share": budget.unexplained,
        "low": budget.unexplained_low,
        "high": budget.unexplained_high,
        "ceiling": budget.ceiling,
        "depends_on": ["time in the recording"],
    }
    for row, ranked, one in zip(stated["entries"], data["ranking"], budget.entries, strict=True):
        for key in ("effect", "share", "low", "high", "first_in", "last_in", "certainty", "note"):
            assert row[key] == getattr(one, key)
        assert row["rivals"] == list(one.rivals) and row["combinations"] == list(one.combinations)
        assert row["worsens"] == (["free_run"] if one.effect == "quadratic_drag" else [])
        assert row["measures"] == {
            m: {"before": c.before, "after": c.after, "floor": c.floor} for m, c in one.measures.items()
        }
        assert [p["value"] for p in row["parameters"]] == [p.value for p in one.parameters]
        assert (ranked["effect"], ranked["closure"], ranked["interval"]) == (one.effect, one.share, [one.low, one.high])
    assert [(t["effect"], t["outcome"]) for t in data["tried"]] == [(t.effect, t.outcome) for t in source.tried]
    for row, share in zip(data["where"], source.where, strict=True):
        assert (row["coordinate"], row["share"], row["p_value"]) == (share.coordinate, share.share, share.p_value)
    for row, pair in zip(data["pairs"], source.pairs, strict=True):
        assert row["coordinates"] == [pair.x_coordinate, pair.y_coordinate] and row["form"] == pair.form
        assert np.array_equal(np.array(row["mean"], dtype=float), pair.mean, equal_nan=True)
    assert [c["name"] for c in data["checks"]] == [t.recording for t in source.traces]
    assert data["checks"][1]["findings"][0]["check"] == "gaps"
    assert data["combinations"] == list(source.combinations) and data["seed"] == 1


@pytest.mark.parametrize("name", SAMPLES)
def test_json_is_strict_for_every_verdict(name: str) -> None:
    text = json.dumps(diagnosis_data(SAMPLES[name]()), allow_nan=False)
    assert strict(text)["verdict"]["status"] == SAMPLES[name]().verdict.status


@pytest.mark.parametrize("name", ["explained", "partly", "unknown", "rotary"])
def test_closed_is_one_number_everywhere(name: str, tmp_path: Path) -> None:
    diagnosis = SAMPLES[name]()
    closed = percent(diagnosis.budget.closed)
    console = io.StringIO()
    Console(file=console, width=200, color_system=None).print(diagnosis_console(diagnosis))
    for text in (console.getvalue(), diagnosis_markdown(diagnosis)):
        assert re.search(rf"{closed}( \[\d+, \d+\] %)? of the gap closes", text)
    steps = waterfall(diagnosis)
    assert sum(s.start - s.end for s in steps if s.kind == "effect") == pytest.approx(diagnosis.budget.closed)
    assert steps[-1].start == pytest.approx(1 - diagnosis.budget.closed)
    assert diagnosis_data(diagnosis)["budget"]["closed"] == diagnosis.budget.closed


@given(st.floats(-2, 2))
def test_percent_never_claims_all_or_nothing_falsely(share: float) -> None:
    text = percent(share)
    if share < 1 and "100" in text:
        assert share < 0
    if re.search(r"^-?0 %$", text):
        assert share == 0
    assert abs(float(text.strip("<> %")) - 100 * share) <= 1.0


@pytest.mark.parametrize("name", SAMPLES)
def test_markdown_tables_are_whole_and_nothing_is_left_out(name: str) -> None:
    diagnosis = SAMPLES[name]()
    text = diagnosis_markdown(diagnosis)
    for table in re.findall(r"(?:^\|.*\n)+", text, re.M):
        assert len({len(re.findall(r"(?<!\\)\|", row)) for row in table.splitlines()}) == 1
    assert "nan" not in text
    diagnosis = in_print(diagnosis)
    verdict = diagnosis.verdict
    for part in (diagnosis.name, verdict.sentence, verdict.next_experiment, *diagnosis.warnings):
        assert part in text
    for part in (*diagnosis.assumptions, *(t.effect for t in diagnosis.tried), *(s.label for s in diagnosis.where)):
        assert part in text
    for line in budget_lines(diagnosis):
        for part in (line.label, line.share, line.interval, line.worsens, line.note, *line.combinations):
            assert part in text


def test_markdown_survives_hostile_names() -> None:
    text = diagnosis_markdown(explained(name="a|b <script>x</script>\n# c"))
    assert "<script>" not in text and text.startswith("# Diagnosis of a|b &lt;script>x&lt;/script> # c\n")


def test_markdown_shows_the_written_figures(folder: Path) -> None:
    shown = re.findall(r"!\[[^]]*\]\(([^)]*)\)", (folder / "diagnosis.md").read_text(encoding="utf-8"))
    assert {folder / path for path in shown} == set((folder / "figures").iterdir())
    assert {
        "figures/pole_pair.png",
        "figures/waterfall.png",
        "figures/pairs.png",
        "figures/residual_moves_3.png",
    } <= set(shown)


def test_a_few_figures_say_which_effects_how_far_and_where(tmp_path: Path) -> None:
    made, seen = partly(), list[Path]()
    paths = write_diagnosis(made, tmp_path, figures="few", written=lambda: seen.extend(tmp_path.rglob("*.*")))
    held_out = {
        t.recording: float(np.sqrt(np.nanmean(t.before**2))) / t.deviation for t in made.traces if t.split == "held_out"
    }
    worst = max(held_out, key=lambda name: held_out[name])
    assert len(made.traces) > 1
    figures = {p.name for p in paths if p.suffix == ".png"}
    assert figures == {"waterfall.png", "measures.png", "shares.png", f"residual_{worst}.png"}
    assert {p.name for p in seen} == {"diagnosis.json", "diagnosis.md", "report.html"}  # before the first figure
    shown = re.findall(r"!\[[^]]*\]\(([^)]*)\)", (tmp_path / "diagnosis.md").read_text(encoding="utf-8"))
    assert {Path(path).name for path in shown} == figures


@pytest.mark.parametrize("name", SAMPLES)
def test_console_fits_80_columns(name: str) -> None:
    diagnosis, stream = SAMPLES[name](), io.StringIO()
    Console(file=stream, width=80, color_system=None).print(diagnosis_console(diagnosis))
    lines = stream.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    words = " ".join(stream.getvalue().split())
    verdict = in_print(diagnosis).verdict
    for part in (diagnosis.name, verdict.sentence, verdict.next_experiment, *diagnosis.warnings):
        assert part in words
    assert "…" not in words  # nothing was cut
    assert ("After" in words) == bool(diagnosis.verdict.effects)


def test_figures_without_poles_and_without_change(tmp_path: Path) -> None:
    made = unknown()
    few = replace(made, traces=made.traces[:1])
    names = {p.name for p in write_diagnosis(few, tmp_path, formats=("svg",)) if p.suffix == ".svg"}
    assert "position_velocity.svg" in names and "pole_pair.svg" not in names
    assert not figures_of_none(few, tmp_path / "bare")


def test_long_labels_of_pairs_stay_below_the_title() -> None:
    made = partly()
    long = ("input, with the sign of its push", "position within two pole pitches, of the field")
    told = tuple(replace(pair, x_label=long[1], y_label=long[0]) for pair in made.pairs)
    figure = pairs_figure(replace(made, pairs=told))
    figure.draw_without_rendering()
    assert figure._suptitle is not None
    title = figure._suptitle.get_window_extent()
    panels = [axes for axes in figure.axes if axes.get_visible()]
    for axes in panels:
        label = axes.yaxis.label.get_window_extent()
        assert label.y1 < title.y0 and label.y0 > 0.0
    for axes in panels:
        if axes.get_xlabel():
            assert axes.xaxis.label.get_window_extent().width < 0.5 * figure.bbox.width


def test_residuals_share_one_pdf_of_a_page_each(tmp_path: Path) -> None:
    made = explained()
    seen: list[tuple[int, int]] = []
    for processes, folder in enumerate(("one", "two"), 1):
        written = write_diagnosis(
            made,
            tmp_path / folder,
            formats=("png", "pdf"),
            processes=processes,
            progress=lambda done, total, stem: seen.append((done, total)),
        )
    pages = (tmp_path / "two" / "figures" / "residuals.pdf").read_bytes()
    assert len(re.findall(rb"/Type /Page\b", pages)) == len(made.traces)
    assert pages == (tmp_path / "one" / "figures" / "residuals.pdf").read_bytes()
    figures = {p.stem for p in written if p.suffix == ".png"}
    pdfs = {p.stem for p in written if p.suffix == ".pdf"}
    assert pdfs == {stem for stem in figures if not stem.startswith("residual_")} | {"residuals"}
    number = len(figures) + 1  # and the pages
    assert seen == 2 * [(k, number) for k in range(1, number + 1)]


def figures_of_none(diagnosis: Diagnosis, folder: Path) -> list[Path]:
    """The figures among what is written when none are wanted."""
    return [path for path in write_diagnosis(diagnosis, folder, figures="none") if path.parent != folder]


def test_trace_figure_shows_residuals_and_two_sigma() -> None:
    diagnosis = explained()
    upper = residual_trace_figure(diagnosis, diagnosis.traces[2]).axes[0]
    colours = [line.get_color() for line in upper.lines]
    assert colours == [ERROR, MEASURED]
    peaks = [float(np.max(np.abs(line.get_ydata()))) for line in upper.lines]
    trace = diagnosis.traces[2]
    assert peaks == pytest.approx([np.abs(trace.before).max(), np.abs(trace.after).max()])
    band = upper.patches[0].get_extents().transformed(upper.transData.inverted())
    assert (band.y0, band.y1) == pytest.approx((-2 * DEVIATION, 2 * DEVIATION))
    bare = unknown()
    assert [line.get_color() for line in residual_trace_figure(bare, bare.traces[0]).axes[0].lines] == [ERROR]


def test_waterfall_figure_has_a_bar_per_step_and_whiskers() -> None:
    diagnosis = partly()
    axes = waterfall_figure(diagnosis).axes[0]
    solid = [p for p in axes.patches if not p.get_hatch()]
    entries = diagnosis.budget.entries
    assert [abs(p.get_width()) for p in solid] == pytest.approx([100, *(100 * e.share for e in entries), 19])
    (hatched,) = [p for p in axes.patches if p.get_hatch()]
    assert hatched.get_width() == pytest.approx(0.4 * 19)
    whiskers = [line.get_xdata() for line in axes.lines if line.get_marker() == "|"]
    assert [float(np.ptp(x)) for x in whiskers] == pytest.approx([6, 10, 6, 8, 4])
    labels = [text.get_text().replace("\n", " ") for text in axes.get_yticklabels()]
    assert labels[2] == "cable_force or position_dependent_friction" and labels[-1] == "unexplained"
    written = " ".join(text.get_text() for text in axes.texts).replace("\n", " ")
    assert "floor" in written and "46 % [43, 49] %" in written


def test_an_effect_that_adds_to_the_gap_steps_upwards() -> None:
    base = explained()
    odd = replace(base, budget=replace(base.budget, entries=(*base.budget.entries, entry("gravity", -0.05))))
    step = waterfall(odd)[2]
    assert step.end == pytest.approx(step.start + 0.05)
    bar = [p for p in waterfall_figure(odd).axes[0].patches if not p.get_hatch()][2]
    assert bar.get_facecolor()[:3] == pytest.approx(tuple(int(ERROR[k : k + 2], 16) / 255 for k in (1, 3, 5)))


def test_a_rotary_axis_of_unknown_inertia_is_told_in_its_words_and_units(tmp_path: Path) -> None:
    diagnosis, console = rotary(), io.StringIO()
    Console(file=console, width=80, color_system=None).print(diagnosis_console(diagnosis))
    write_diagnosis(diagnosis, tmp_path, figures="none")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    page = re.sub(r"<script>/\*\*\n\* plotly\.js.*?</script>", "", page, flags=re.S)
    data = strict((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))
    written = json.dumps({key: value for key, value in data.items() if key != "checks"})  # whose keys name a stroke
    for text in (console.getvalue(), diagnosis_markdown(diagnosis), page, written):
        assert not re.search(r"stroke|mm/s|pole pitch|guideway|one phase|added mass", text)
    for text in (console.getvalue(), diagnosis_markdown(diagnosis), page):
        assert "rad/s²" in text and "inertia, which no recording tells" in text.replace("\n", " ").replace(
            "inertia (N m per kg m² is rad/s²), which", "inertia, which"
        )
        assert not re.search(r"\d N m\b(?! per)", text)
    units = [p["unit"] for p in data["budget"]["entries"][0]["parameters"]]
    assert units == ["1/rad", "rad/s^2", "rad/s^2", "N m/A per kg m^2"]
    known = replace(diagnosis, force_scale="")
    assert "rad/s²" not in diagnosis_markdown(known) and "mN m" in diagnosis_markdown(known)
    assert in_axis_words(in_axis_words(diagnosis)).budget == in_axis_words(diagnosis).budget


def test_a_linear_axis_of_unknown_mass_has_forces_per_kilogram() -> None:
    text = diagnosis_markdown(explained(force_scale="kg"))
    assert "N/kg" in text and "which no recording tells" in text and "| N |" not in text
    assert "N/kg" not in diagnosis_markdown(explained())


def test_heavy_packages_are_imported_late() -> None:
    code = "import sys, linid.report.diagnosis.files, linid.report.diagnosis.console, linid.report.page.build; "
    code += "print([m for m in ('matplotlib', 'plotly', 'jinja2', 'scipy', 'rich', 'numba') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_what_is_missing_or_diverged_breaks_nothing(tmp_path: Path) -> None:
    inf = float("inf")
    base = unknown()
    silent = replace(base.traces[0], before=np.full_like(base.traces[0].t, NAN), after=base.traces[0].t * NAN)
    short = replace(base.traces[1], **{name: getattr(base.traces[1], name)[:5] for name in ("t", "y", "v")})
    short = replace(short, before=np.zeros(5), after=np.zeros(5), deviation=NAN)
    diverged = {"free_run": Change(inf, NAN, 0.0), "ahead": Change(NAN, NAN, NAN), "force": Change(0.0, 0.0, 0.0)}
    rows = tuple(replace(one, changes=diverged) for one in base.recordings)
    unclear = tuple(replace(share, share=NAN, p_value=NAN) for share in base.where)
    cases = {
        "empty": replace(
            base,
            tried=(),
            where=(),
            pairs=(),
            recordings=(),
            traces=(),
            measures={},
            checks=(),
            budget=Budget(*[NAN] * 11, (), NAN, ()),
        ),
        "odd": replace(base, recordings=rows, traces=(silent, short), where=unclear, field_wavenumber=222.0),
        "after": replace(
            base,
            recordings=rows,
            measures=diverged,
            traces=(),
            budget=replace(base.budget, entries=(replace(entry("cogging", NAN), measures=diverged),), closed=NAN),
            verdict=Verdict("explained", ("cogging",), (), "s", ""),
        ),
    }
    for name, diagnosis in cases.items():
        assert {p.name for p in write_diagnosis(diagnosis, tmp_path / name)} >= {"diagnosis.json", "report.html"}
        strict((tmp_path / name / "diagnosis.json").read_text(encoding="utf-8"))
        Console(file=io.StringIO(), width=80).print(diagnosis_console(diagnosis))
