"""The page of a diagnosis in a real browser: it draws every figure, fits its width, prints, and stays silent."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from linid.diagnosis.report_data import Diagnosis
from linid.recording.check_findings import Finding
from linid.report.diagnosis.budget import budget_lines
from linid.report.diagnosis.content import STATUS_WORDS, coordinate_display
from linid.report.diagnosis.words import in_print
from linid.report.page.build import page_html
from linid.report.page.pieces import log_axis, wrapped
from linid.report.symbols import typeset

from .diagnosis_parts import recordings, traces
from .diagnosis_samples import SAMPLES, explained
from .proposal_samples import of_position, of_velocity_and_force

CHROMIUM = shutil.which("chromium")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
HOSTILE = "a<b> & \"c'</script><script>throw 1</script>"
WIDTHS = (1280, 400)
# Reports what a reader would see, after trying every recording of the choice.
PROBE = """<script>
window.addEventListener("load", () => setTimeout(() => {
  const choose = document.getElementById("choose-trace");
  for (const option of choose.options) { choose.value = option.value; choose.dispatchEvent(new Event("change")); }
  setTimeout(() => parent.postMessage({
    name: new URLSearchParams(location.search).get("is"),
    overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    drawn: Array.from(document.querySelectorAll(".plot")).map((plot) => plot.querySelectorAll(".main-svg").length),
    wide: Array.from(document.querySelectorAll(".plot")).filter((plot) =>
      plot.querySelector(".main-svg").getBoundingClientRect().width > plot.clientWidth + 1).length,
  }, "*"), 500);
}, 500));
window.addEventListener("beforeprint", () => {
  const widths = Array.from(document.querySelectorAll(".main-svg")).map((svg) => svg.getBoundingClientRect().width);
  console.log("PRINT " + Math.max(...widths) + " of " + document.querySelector("main").clientWidth);
});
</script>"""
FRAMES = """<!DOCTYPE html><body><script>
const found = [];
window.addEventListener("message", (event) => {
  found.push(event.data);
  document.getElementById("found").textContent = JSON.stringify(found);
});
</script><pre id="found"></pre>"""


def hostile() -> Diagnosis:
    """The sample with a recording whose name is a script."""
    made = traces(lambda t, y, v: np.sin(222.0 * y))
    made = (*made[:2], replace(made[2], recording=HOSTILE), *made[3:])
    return explained(traces=made, recordings=recordings(made), name=HOSTILE, where=explained().where)


PAGES = {
    "explained": explained,
    "partly": SAMPLES["partly"],
    "unknown": SAMPLES["unknown"],
    "hostile": hostile,
    "curve": of_position,
    "surface": of_velocity_and_force,
}


@cache
def page_of(name: str) -> str:
    """The page of a sample, made once."""
    return page_html({**SAMPLES, **PAGES}[name]())


def chromium(page: Path, *arguments: str) -> tuple[str, list[str]]:
    """Standard output, and the console's messages, of a headless run."""
    assert CHROMIUM is not None
    command = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-logging=stderr",
        "--v=0",
        f"--user-data-dir={page.parent / 'profile'}",
        "--virtual-time-budget=15000",
        *arguments,
        page.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Copies of the pages with the probe."""
    folder = tmp_path_factory.mktemp("page")
    paths = {}
    for name in PAGES:
        paths[name] = folder / f"{name}.html"
        paths[name].write_text(page_of(name).replace("</body>", PROBE + "</body>"), encoding="utf-8")
    return paths


@pytest.fixture(scope="module")
def seen(pages: dict[str, Path]) -> tuple[dict[str, Any], list[str]]:
    """What the probe found of each page at each width, and the console's messages."""
    frames = "".join(
        f'<iframe src="{name}.html?is={name}-{width}" style="width:{width}px;height:900px;border:0"></iframe>'
        for name in pages
        for width in WIDTHS
    )
    path = pages["explained"].with_name("frames.html")
    path.write_text(FRAMES + frames, encoding="utf-8")
    dom, console = chromium(path, "--window-size=1400,1000", "--dump-dom")
    found = re.search(r'<pre id="found">(.*?)</pre>', dom, re.S)
    assert found is not None
    return {one["name"]: one for one in json.loads(html.unescape(found[1]) or "[]")}, console


@needs_chromium
def test_every_figure_is_drawn_and_nothing_overflows(seen: tuple[dict[str, Any], list[str]]) -> None:
    found, _ = seen
    assert set(found) == {f"{name}-{width}" for name in PAGES for width in WIDTHS}
    for name, one in found.items():
        assert len(one["drawn"]) >= 8 and min(one["drawn"]) >= 1, name
        assert (one["overflow"], one["wide"]) == (0, 0), name


@needs_chromium
def test_the_console_stays_silent(seen: tuple[dict[str, Any], list[str]]) -> None:
    assert seen[1] == []


@needs_chromium
def test_an_error_would_be_seen(tmp_path: Path) -> None:
    path = tmp_path / "broken.html"
    path.write_text("<!DOCTYPE html><script>missing()</script>")
    assert len(chromium(path, "--dump-dom")[1]) == 1


@needs_chromium
def test_it_prints_within_the_paper(pages: dict[str, Path]) -> None:
    pdf = pages["explained"].with_name("page.pdf")
    _, console = chromium(
        pages["explained"], "--window-size=1280,1000", "--no-pdf-header-footer", f"--print-to-pdf={pdf}"
    )
    assert pdf.read_bytes().startswith(b"%PDF") and 2 <= len(re.findall(rb"/Type\s*/Page\b", pdf.read_bytes())) <= 12
    (message,) = console  # the probe's own, and no error
    widest, paper = map(float, re.findall(r"PRINT ([\d.]+) of ([\d.]+)", message)[0])
    assert widest <= paper <= 690  # A4 between margins of 14 mm is 688 px wide


def test_the_page_needs_no_network_and_is_reproducible() -> None:
    text = page_of("explained")
    assert text == page_html(explained())
    without_plotly = re.sub(r"<script>/\*\*\n\* plotly\.js.*?</script>", "", text, flags=re.S)
    assert len(without_plotly) < len(text) - 1e6
    assert not re.search(r"(?:src|href)\s*=|url\(|@import|https?:", without_plotly)
    assert "default-src 'none'" in text


def test_the_page_says_what_the_diagnosis_says() -> None:
    for name, make in SAMPLES.items():
        diagnosis, text = in_print(make()), html.unescape(page_of(name)).replace("<wbr>", "")
        verdict = diagnosis.verdict
        for part in (diagnosis.name, verdict.sentence, verdict.next_experiment, *diagnosis.warnings):
            assert part in text
        for part in (*diagnosis.assumptions, *diagnosis.combinations, *(one.effect for one in diagnosis.tried)):
            assert part in text
        for line in budget_lines(diagnosis):
            for part in (line.label, line.share, line.interval, line.alone, line.missed, line.worsens, line.note):
                assert part in text
            assert all(one in text for one in line.combinations)
        assert all(typeset(finding.text) in text for one in diagnosis.checks for finding in one.findings)
        assert ">nan<" not in text.lower()
    assert "0.828 ± 0.011" in page_of("explained")


def test_texts_have_the_signs_of_print() -> None:
    """No power, plus-minus or prime as it is typed, beside those of units and tables."""
    partly = SAMPLES["partly"]()
    late = Finding("moves_1", "shift", "note", "the acceleration comes 2 +- 0.3 ms after the input")
    first = replace(partly.checks[0], findings=(late,))
    verdict = replace(partly.verdict, next_experiment="Record moves: a tenth of it shows there with 0.1 m/s^2 RMS.")
    made = replace(partly, checks=(first, *partly.checks[1:]), verdict=verdict)
    text = page_html(made)
    body = html.unescape(text[text.index("<main>") : text.index("</main>")])
    for right in ("0.73 m/s² is known", "2 ± 0.3 ms", "0.1 m/s² RMS", "z′ = (v - |v| z)/L"):
        assert right in body
    for typed in ("^", "+-", "z'"):
        assert typed not in body


def test_the_first_screen_names_axis_status_and_answers() -> None:
    text = html.unescape(page_of("partly")).replace("<wbr>", "")
    order = [
        text.index(part, text.index("<body>"))
        for part in (
            "axis_07",
            STATUS_WORDS["partly explained"],
            "Four effects explain 81 %",
            "<dt>Where</dt>",
            "<dt>Which</dt>",
            "<dt>How far</dt>",
            'id="waterfall"',
            "Budget of the gap",
            "Data checks",
            "Where the gap lies",
            "Which effects were tried",
            "Traces",
            "Recording by recording",
            "Assumptions and terms",
        )
    ]
    assert order == sorted(order)


def test_the_waterfall_steps_from_the_whole_gap_to_what_is_left() -> None:
    (plot,) = [one for one in figures_of(page_of("partly")) if one["id"] == "waterfall"]
    bars, whiskers = plot["data"][0], plot["data"][-1]
    entries = SAMPLES["partly"]().budget.entries
    assert bars["x"] == pytest.approx([100, *(100 * e.share for e in entries), 19])
    tops = np.add(bars["base"], bars["x"])
    assert tops[1:-1] == pytest.approx([100, *bars["base"][1:-2]])  # each begins where the one before ends
    assert bars["base"][-1] == 0 and tops[-1] == pytest.approx(bars["base"][-2])
    assert whiskers["error_x"]["array"][1:] == pytest.approx([3, 5, 3, 4, 2])
    assert "cable_force or" in bars["y"][2] and "5 % [1, 9] %" in bars["y"][4]
    assert not [one for one in figures_of(page_of("none")) if one["id"] == "waterfall"]


def test_pairs_are_maps_or_lines() -> None:
    plots = [one for one in figures_of(page_of("partly")) if one["id"].startswith("pair-")]
    assert [one["data"][0]["type"] for one in plots] == ["heatmap", "scatter"]
    pair = SAMPLES["partly"]().pairs[0]
    drawn = plots[0]["data"][0]
    assert len(drawn["z"]) == pair.mean.shape[0] and len(drawn["x"]) == pair.mean.shape[1] + 1
    assert "(N/A)" in plots[1]["layout"]["yaxis"]["title"]["text"]


def test_an_angle_of_a_linear_axis_is_drawn_in_rad() -> None:
    """Where in the field a linear axis is goes from 0 to 2 pi rad, and no length does."""
    plots = [one["layout"]["xaxis"] for one in figures_of(page_of("partly")) if one["id"].startswith("curve-")]
    titles = [axis["title"]["text"] for axis in plots]
    assert "position within two pole pitches (rad)" in titles and "position (mm)" in titles
    at_rest = coordinate_display(np.array([0.1, 6.2]), "rad")
    assert (at_rest.factor, at_rest.unit) == (1.0, "rad")
    assert coordinate_display(np.array([-0.02, 0.05]), "rad/s").unit == "mrad/s"
    assert coordinate_display(np.array([0.1, 0.7]), "m").unit == "mm"


def test_maps_say_what_their_colours_are() -> None:
    maps = [one["data"][0] for one in figures_of(page_of("partly")) if one["data"][0]["type"] == "heatmap"]
    assert len(maps) == 3 and {one["colorbar"]["title"]["text"] for one in maps} == {"mean residual (N)"}


@pytest.mark.parametrize("decades", [1, 2, 3, 5, 8, 12, 20])
def test_a_logarithmic_axis_has_few_level_labels(decades: int) -> None:
    axis = log_axis([1e-5, 1e-5 * 10.0**decades])
    assert 2 <= len(axis["tickvals"]) <= 7 and axis["tickangle"] == 0
    assert [float(text) for text in axis["ticktext"]] == pytest.approx(axis["tickvals"])
    low, high = axis["range"]
    shown = np.log10(axis["tickvals"])
    assert np.sum((shown >= low) & (shown <= high)) >= 2


def test_no_name_becomes_markup() -> None:
    text = page_of("hostile")
    assert HOSTILE not in text and "<script>throw" not in text
    assert wrapped("a<b>_c & d") == "a&lt;b>_c &amp; d"
    assert wrapped("position_dependent_friction", 20) == "position_dependent_<br>friction"


def figures_of(text: str) -> list[dict[str, Any]]:
    """The plotly descriptions inside a page."""
    blocks = re.findall(r'<script type="application/json" id="(?:figures|traces)">(.*?)</script>', text, re.S)
    figures, by_name = (json.loads(block) for block in blocks)
    return [*figures, *by_name.values()]


def test_plotly_accepts_every_figure() -> None:
    from plotly.graph_objects import Figure

    for name in SAMPLES:
        for one in figures_of(page_of(name)):
            Figure({"data": one["data"], "layout": one["layout"]})  # raises for an unknown property
            assert one["alt"]


def test_a_large_campaign_stays_small_and_keeps_its_peaks() -> None:
    made = tuple(
        replace(
            one,
            recording=f"moves_{number}",
            t=np.arange(40_000) * 1e-3,
            deviation=0.1,
            **{name: np.resize(getattr(one, name), 40_000) for name in ("y", "v", "before", "after")},
        )
        for number, one in enumerate(traces(lambda t, y, v: np.sin(222.0 * y)) * 5)
    )
    made[7].before[12_345] = 77.0
    text = page_html(explained(traces=made, recordings=recordings(made)))
    assert len(text.encode()) < 8e6
    lines = [line for one in figures_of(text) for line in one["data"] if line["type"] == "scatter"]
    assert max(len(line["x"]) for line in lines) <= 3000
    forces = [line for line in lines if line.get("yaxis") != "y2"]
    assert max(y for line in forces for y in line["y"] if isinstance(y, float)) == 77.0
