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

from linid.diagnosis.report_data import Change, Diagnosis, Verdict
from linid.report.diagnosis_console import diagnosis_console
from linid.report.diagnosis_content import closure, percent, ranked, totals
from linid.report.diagnosis_files import diagnosis_data, write_diagnosis
from linid.report.diagnosis_markdown import diagnosis_markdown
from linid.report.figures.diagnosis_traces import residual_trace_figure
from linid.report.figures.diagnosis_which import ranking_figure
from linid.report.style import ERROR, MEASURED

from .diagnosis_samples import DEVIATION, SAMPLES, candidate, identified, recordings, traces, unknown
from .samples import NAN


def strict(text: str) -> Any:
    """JSON as the standard has it: no NaN, no Infinity."""

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All files of the sample with one cause."""
    path = tmp_path_factory.mktemp("diagnosis")
    written = write_diagnosis(identified(), path)
    assert sorted(written) == sorted(p for p in path.rglob("*") if p.is_file())
    return path


def test_json_has_the_agreed_schema(folder: Path) -> None:
    data, source = strict((folder / "diagnosis.json").read_text(encoding="utf-8")), identified()
    assert data["schema"] == 1
    verdict = {"status": "identified", "effects": ["cogging"], "equivalent": []}
    assert {key: data["verdict"][key] for key in verdict} == verdict
    assert data["next_experiment"] == source.verdict.next_experiment
    by_name = {c.name: c for c in source.candidates}
    assert [row["effect"] for row in data["ranking"]] == [c.name for c in ranked(source)]
    for row in data["ranking"]:
        one = by_name[row["effect"]]
        confirmed = np.isfinite(one.closure)
        assert row["closure"] == (one.closure if confirmed else None)
        assert row["interval"] == ([one.low, one.high] if confirmed else None)
        for measure, change in one.held_out.items():
            assert {k: row["held_out"][measure][k] for k in ("before", "after", "floor")} == {
                "before": change.before, "after": change.after, "floor": change.floor,
            }  # fmt: skip
    for row, share in zip(data["where"], source.where, strict=True):
        assert (row["coordinate"], row["share"], row["p_value"]) == (share.coordinate, share.share, share.p_value)


@pytest.mark.parametrize("name", SAMPLES)
def test_json_is_strict_for_every_verdict(name: str) -> None:
    text = json.dumps(diagnosis_data(SAMPLES[name]()), allow_nan=False)
    assert strict(text)["verdict"]["status"] == SAMPLES[name]().verdict.status


def test_ranking_puts_the_verdict_first_then_the_confirmed() -> None:
    candidates = (
        candidate("a", 0.9), candidate("b", 0.1, 0.3), candidate("c", NAN), candidate("d + e", 0.5, 0.8),
        candidate("f", 0.2, 0.85),
    )  # fmt: skip
    verdict = Verdict("identified", ("e", "d"), (), "", "")
    assert [c.name for c in ranked(identified(candidates=candidates, verdict=verdict))] == ["d + e", "f", "b", "a", "c"]


def test_totals_are_root_mean_squares_of_the_held_out_only() -> None:
    rows = recordings(traces(lambda t, y, v: y))
    base = unknown()
    found = totals(replace(base, recordings=rows))["force"]
    held = [r.changes["force"].before for r in rows if r.split == "held_out"]
    assert found.before == pytest.approx(np.sqrt(np.mean(np.square(held))))
    assert len(held) < len(rows)


def test_closure_by_hand() -> None:
    assert closure(Change(5.0, 3.0, 3.0)) == pytest.approx(1.0)
    assert closure(Change(5.0, 4.0, 3.0)) == pytest.approx(9 / 16)
    assert closure(Change(5.0, 6.0, 3.0)) < 0
    assert np.isnan(closure(Change(3.0, 3.0, 3.0)))


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
    for part in (diagnosis.verdict.sentence, diagnosis.verdict.next_experiment, *diagnosis.warnings):
        assert part in text
    for part in (*diagnosis.assumptions, *(c.name for c in diagnosis.candidates), *(s.label for s in diagnosis.where)):
        assert part in text


def test_markdown_survives_hostile_names() -> None:
    text = diagnosis_markdown(identified(name="a|b <script>x</script>\n# c"))
    assert "<script>" not in text and text.startswith("# Diagnosis of a|b &lt;script>x&lt;/script> # c\n")


def test_markdown_shows_the_written_figures(folder: Path) -> None:
    shown = re.findall(r"!\[[^]]*\]\(([^)]*)\)", (folder / "diagnosis.md").read_text(encoding="utf-8"))
    assert {folder / path for path in shown} == set((folder / "figures").iterdir())
    assert {"figures/pole_pair.png", "figures/ranking.png", "figures/residual_moves_3.png"} <= set(shown)


@pytest.mark.parametrize("name", SAMPLES)
def test_console_fits_80_columns(name: str) -> None:
    diagnosis, stream = SAMPLES[name](), io.StringIO()
    Console(file=stream, width=80, color_system=None).print(diagnosis_console(diagnosis))
    lines = stream.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    words = " ".join(stream.getvalue().split())
    for part in (diagnosis.verdict.sentence, diagnosis.verdict.next_experiment, *diagnosis.warnings):
        assert part in words
    assert ("After" in words) == bool(diagnosis.verdict.effects)


def test_figures_without_poles_and_without_change(tmp_path: Path) -> None:
    made = unknown()
    few = replace(made, traces=made.traces[:1])
    names = {p.name for p in write_diagnosis(few, tmp_path, formats=("svg",)) if p.suffix == ".svg"}
    assert "position_velocity.svg" in names and "pole_pair.svg" not in names
    assert not figures_of_none(few, tmp_path / "bare")


def test_residuals_share_one_pdf_of_a_page_each(tmp_path: Path) -> None:
    made = identified()
    seen: list[tuple[int, int]] = []
    for processes, folder in enumerate(("one", "two"), 1):
        written = write_diagnosis(
            made, tmp_path / folder, formats=("png", "pdf"), processes=processes,
            progress=lambda done, total, stem: seen.append((done, total)),
        )  # fmt: skip
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
    return [path for path in write_diagnosis(diagnosis, folder, figures=False) if path.parent != folder]


def test_trace_figure_shows_residuals_and_two_sigma() -> None:
    diagnosis = identified()
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


def test_ranking_figure_has_a_bar_per_number() -> None:
    diagnosis = identified()
    widths = [patch.get_width() for patch in ranking_figure(diagnosis).axes[0].patches]
    expected = []
    for one in ranked(diagnosis):
        expected += [100 * x for x in (one.explained, one.closure) if np.isfinite(x)]
    assert widths == pytest.approx(expected)


def test_heavy_packages_are_imported_late() -> None:
    code = "import sys, linid.report.diagnosis_files, linid.report.diagnosis_console, linid.report.page.build; "
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
        "empty": replace(base, candidates=(), where=(), recordings=(), traces=(), ceiling=NAN),
        "odd": replace(base, recordings=rows, traces=(silent, short), where=unclear, field_wavenumber=222.0),
        "after": replace(
            base, recordings=rows, traces=(), candidates=(candidate("cogging", NAN),),
            verdict=Verdict("identified", ("cogging",), (), "s", ""),
        ),
    }  # fmt: skip
    for name, diagnosis in cases.items():
        assert {p.name for p in write_diagnosis(diagnosis, tmp_path / name)} >= {"diagnosis.json", "report.html"}
        strict((tmp_path / name / "diagnosis.json").read_text(encoding="utf-8"))
        Console(file=io.StringIO(), width=80).print(diagnosis_console(diagnosis))
