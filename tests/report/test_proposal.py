"""A proposed term is said, written and drawn alike everywhere: headline, files, console, figures, page."""

from __future__ import annotations

import html
import io
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from linid.challenge.answers import read_answer
from linid.diagnosis.report_data import Change, Diagnosis, ShortFormula
from linid.report.diagnosis.budget import closed_words, rest_words, waterfall, waterfall_words, which_words
from linid.report.diagnosis.console import diagnosis_console
from linid.report.diagnosis.content import after_words, changed
from linid.report.diagnosis.files import diagnosis_data, write_diagnosis
from linid.report.diagnosis.markdown import diagnosis_markdown
from linid.report.diagnosis.proposal import TERM_TITLE, argument_words, headline, term_lines, term_measures
from linid.report.diagnosis.term_view import TermView, term_view, value_limits, view_words
from linid.report.diagnosis.words import in_axis_words, in_print
from linid.report.figures.diagnosis_term import term_figure
from linid.report.figures.diagnosis_where import states
from linid.report.page.build import page_html
from linid.report.page.plots_term import term_plots

from .diagnosis_samples import explained, partly, unknown
from .proposal_samples import (
    PROPOSED,
    of_direction,
    of_position,
    of_position_by_direction,
    of_velocity_and_force,
    per_recording,
    rotary_factor,
    rotary_surface,
    term,
)
from .samples import NAN
from .test_diagnosis_files import strict


def console_of(diagnosis: Diagnosis, width: int = 80) -> str:
    """What the console shows."""
    stream = io.StringIO()
    Console(file=stream, width=width, color_system=None).print(diagnosis_console(diagnosis))
    return stream.getvalue()


def view_of(diagnosis: Diagnosis) -> TermView:
    """How the term is drawn."""
    view = term_view(in_axis_words(diagnosis))
    assert view is not None
    return view


@pytest.mark.parametrize("name", PROPOSED)
def test_every_output_says_the_same(name: str) -> None:
    told = in_print(PROPOSED[name]())
    assert told.proposal is not None
    page = html.unescape(page_html(told)).replace("<wbr>", "")
    texts = (diagnosis_markdown(told), " ".join(console_of(told, 300).split()), page)
    for text in texts:
        for part in (headline(told), told.proposal.sentence, TERM_TITLE, closed_words(told)):
            assert part in text
        for line in term_lines(told):
            assert all(part in text for part in (line.title, line.lead, line.code, line.text))
        for one in term_measures(told):
            assert all(part in text for part in (one.before, one.after, one.floor, one.state))
    assert which_words(told) in texts[0] and which_words(told) in texts[2]
    assert "nan" not in texts[0] and ">nan<" not in texts[2].lower()
    assert max(map(len, console_of(told).splitlines())) <= 80 and "…" not in console_of(told)


def test_the_headline_names_what_the_term_depends_on() -> None:
    assert headline(of_velocity_and_force()) == (
        "Gap without a known cause; a term of velocity and motor force is proposed"
    )
    assert headline(of_position()).startswith("Gap partly explained; a term of position and direction of motion is")
    assert headline(rotary_factor()).endswith("a term of position and motor torque is proposed")
    assert argument_words(per_recording()) == "time in the recording, another in each recording,"
    assert argument_words(replace(unknown(), proposal=term(None, ("recording",)))) == "the recording"
    constant = replace(unknown(), proposal=term(None, ()))
    assert headline(constant) == "Gap without a known cause; a constant term is proposed"
    done = replace(of_position(), verdict=explained().verdict)
    assert headline(done) == headline(explained()) == "Gap explained"
    three = replace(unknown(), proposal=term(None, ("position", "velocity", "motor_force")))
    assert argument_words(three) == "position, velocity and motor force"


def test_without_a_proposal_nothing_is_said_of_one() -> None:
    for made in (explained(), unknown()):
        assert diagnosis_data(made)["proposal"] is None
        assert term_lines(made) == () and term_measures(made) == () and term_plots(made) == []
        assert term_view(made) is None and argument_words(made) == ""
        for text in (diagnosis_markdown(made), console_of(made), page_html(made)):
            assert TERM_TITLE not in text and "is proposed" not in text


def test_the_model_after_is_named_with_the_term_it_has() -> None:
    assert after_words(of_velocity_and_force()) == "with proposed term" and changed(of_velocity_and_force())
    assert after_words(of_position()) == "with the 4 effects + proposed term"
    assert after_words(replace(explained(), proposal=of_position().proposal)) == "with cogging + proposed term"
    left_out = of_direction()
    assert not changed(left_out) and [words for _, words, _ in states(left_out)] == ["base model"]
    assert [words for _, words, _ in states(of_velocity_and_force())] == ["before", "with proposed term"]
    assert "with proposed term" in page_html(of_velocity_and_force())
    assert after_words(per_recording()) == "with the 4 effects"


def test_whether_the_models_have_it_is_told_with_the_reason() -> None:
    def told(**changes: Any) -> str:
        made = of_position()
        assert made.proposal is not None
        lines = term_lines(replace(made, proposal=replace(made.proposal, **changes)))
        return next(line.lead for line in lines if line.title == "In the models")

    assert told().startswith("model_after.json has it as a term of its own")
    assert "each recording has its own coefficients" in told(kept=False, curve=None, effect="")
    assert "a simulation cannot know" in told(kept=False, effect="")
    assert told(kept=False, measures={}) == "Left out: no simulation with it was made."
    assert "not every held-out recording" in told(kept=False)
    worse = {"free_run": Change(0.1, 0.2, 0.0), "ahead": Change(1.0, 0.5, 0.1), "force": Change(1.0, 1.1, 0.1)}
    assert "with it the free run and the residual force get worse" in told(kept=False, measures=worse)
    assert "the prediction 0.1 s ahead gets worse" in console_of(of_direction(), 300)


def test_it_says_how_to_use_the_term() -> None:
    def uses(diagnosis: Diagnosis) -> list[str]:
        return [line.code for line in term_lines(diagnosis) if line.title in ("To use it", "Written out")]

    assert uses(of_position()) == [
        "linid fit-motor --model sine --effect learned CAMPAIGN --out motor",
        '--effect "learned: -spline(y, -0.05, 0.62, 14)*sign(v)"',
    ]
    assert uses(replace(of_position(), model="friction")) == ['--effect "learned: -spline(y, -0.05, 0.62, 14)*sign(v)"']
    assert uses(per_recording()) == []
    bare = replace(of_position(), proposal=term(None, ("position",), effect="spline(y, 0, 1, 6)"), model="friction")
    assert uses(bare) == ['--effect "learned: spline(y, 0, 1, 6)"']


def test_what_the_term_does_not_depend_on_and_how_to_test_it_are_said_once() -> None:
    titles = [line.title for line in term_lines(of_velocity_and_force())]
    assert titles.count("Nor on") == 1 and titles.count("Resembles") == 2
    (not_on,) = [line for line in term_lines(of_velocity_and_force()) if line.title == "Nor on"]
    assert not_on.lead == "acceleration, beyond chance."  # the sentence names the other one
    bare = replace(unknown(), proposal=term(None, ("position",), sentence="It depends on position."))
    assert [line.lead for line in term_lines(bare) if line.title == "Not on"] == [
        "time in the recording and acceleration, beyond chance."
    ]
    cubic = replace(unknown(), proposal=term(None, ("velocity",), short=ShortFormula("−2 N/(m/s)³ · v³", 0.8, 1)))
    assert "with 1 fitted number (v: velocity)." in [line.text for line in term_lines(cubic)][1]
    level = ShortFormula("0.23 N · sin(2π · y/15 mm − 2.15) · g(v)/F_C · sign(v)", 0.8, 3)
    balls = replace(unknown(), proposal=term(None, ("position", "direction"), short=level))
    assert [line.text for line in term_lines(balls)][1].endswith(
        "(y: position, v: velocity, g(v)/F_C: friction of steady sliding over that of fast sliding)."
    )
    made = of_position()
    assert made.proposal is not None
    same = replace(made, verdict=replace(made.verdict, next_experiment=made.proposal.next_experiment))
    assert "To test it" not in [line.title for line in term_lines(same)]
    assert diagnosis_markdown(same).count(made.proposal.next_experiment) == 1


def test_a_rotary_axis_is_told_in_its_words_and_units() -> None:
    scaled, known = in_print(rotary_factor()), in_print(rotary_surface())
    for made in (scaled, known):
        body = html.unescape(page_html(made))
        body = body[body.index("<main>") : body.index("</main>")]
        for text in (diagnosis_markdown(made), console_of(made, 300), body):
            assert not re.search(r"stroke|pole pitch|motor force", text)
    short = next(line.text for line in term_lines(scaled) if line.title == "Short formula")
    assert "(y: position, F: motor torque)" in short
    view = view_of(rotary_factor())
    assert (view.x_title, view.value_title) == ("position (rad)", "share of the motor torque (%)")
    assert np.nanmax(view.cuts[0].value) == pytest.approx(3.1, rel=0.01)
    surface = view_of(rotary_surface())
    assert surface.value_title == "proposed torque (mN m)" and surface.surface is not None
    assert surface.surface.y_title == "motor torque (mN m)"
    scaled_curve = replace(rotary_surface(), force_scale="kg m^2")
    again = view_of(scaled_curve)
    assert again.value_title == "proposed torque (mrad/s²)" and again.value_unit == "mrad/s²"
    assert diagnosis_data(scaled_curve)["proposal"]["curve"]["unit"] == "rad/s^2"


def test_quantities_of_a_formula_are_per_mass_where_no_recording_tells_it() -> None:
    for axis, scale, given, told in (
        ("linear", "kg", "0.3 N/(m/s)³ · v³ beyond 2 N", "0.3 N/kg/(m/s)³ · v³ beyond 2 N/kg"),
        ("rotary", "kg m^2", "0.3 N m/(rad/s) · v", "0.3 rad/s²/(rad/s) · v"),
        ("linear", "", "0.3 N · sin(y)", "0.3 N · sin(y)"),
    ):
        short = ShortFormula(given, 0.8, 1)
        made = replace(unknown(), axis=axis, force_scale=scale, proposal=term(None, ("velocity",), short=short))
        once = in_axis_words(made)
        assert once.proposal is not None and once.proposal.short is not None
        assert once.proposal.short.text == told and in_axis_words(once).proposal == once.proposal


def test_json_holds_the_term_and_the_challenge_reads_it(tmp_path: Path) -> None:
    source = of_velocity_and_force()
    write_diagnosis(source, tmp_path, figures="none")
    data, made = strict((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))["proposal"], source.proposal
    assert made is not None and made.curve is not None and made.short is not None
    assert list(data) == [
        "arguments",
        "not_on",
        "closed",
        "low",
        "high",
        "p_value",
        "curve",
        "short",
        "resembles",
        "refines",
        "effect",
        "kept",
        "measures",
        "sentence",
        "next_experiment",
    ]
    assert data["arguments"] == ["velocity", "motor_force"] and data["not_on"] == list(made.not_on)
    assert [data[key] for key in ("closed", "low", "high", "p_value")] == [0.83, 0.77, 0.88, 0.002]
    assert data["kept"] is True and data["effect"] == made.effect and data["sentence"] == made.sentence
    assert data["short"] == {"text": made.short.text, "closed": 0.81, "numbers": 2, "effect": made.short.effect}
    assert [one["effect"] for one in data["resembles"]] == ["load_dependent_friction", "force_ripple"]
    axes = data["curve"]["axes"]
    assert [(one["argument"], one["unit"]) for one in axes] == [("velocity", "m/s"), ("motor_force", "N")]
    for key in ("value", "low", "high"):
        stated = np.array(data["curve"][key], dtype=float)
        assert np.array_equal(stated, getattr(made.curve, key), equal_nan=True)
    assert stated.shape == (len(axes[1]["x"]), len(axes[0]["x"]))
    floor = source.measures["ahead"].floor  # that of the diagnosis, where the term has none of its own
    assert data["measures"]["ahead"] == {
        "before": 9.4e-6,
        "after": 4.1e-6,
        "floor": floor,
        "interval": [3.4e-6, 5.2e-6],
    }
    answer = read_answer(tmp_path).proposal
    assert answer is not None and (answer.arguments, answer.closed) == (("velocity", "motor_force"), 0.83)


@pytest.mark.parametrize("name", PROPOSED)
def test_json_is_strict_and_without_what_is_not_finite(name: str) -> None:
    data = strict(json.dumps(diagnosis_data(PROPOSED[name]()), allow_nan=False))["proposal"]
    assert data["arguments"] and (data["curve"] is None) == (name == "per recording")
    if name == "per recording":
        assert data["low"] is None and data["short"] is None and data["measures"] == {}


def test_the_waterfall_hatches_what_the_term_closes() -> None:
    made = of_position()
    assert waterfall(made)[-1].reach == pytest.approx(0.83 * 0.19)
    assert waterfall(partly())[-1].reach == pytest.approx(0.4 * 0.19)
    assert "the proposed term closes" in waterfall_words(made) and "smooth functions" in waterfall_words(partly())
    assert "It depends on" in rest_words(partly()) and "It depends on" not in rest_words(made)


def test_a_curve_is_a_line_with_a_band_and_its_gaps_stay() -> None:
    view = view_of(of_position())
    (cut,) = view.cuts
    assert view.surface is None and not view.points and view.x_title == "position (mm)"
    assert view.value_title == "proposed friction, positive: resists more (N)"
    assert cut.x[-1] == pytest.approx(620.0) and np.isnan(cut.value[104])
    low, high = value_limits(view)
    assert -0.35 < low < np.nanmin(cut.value) and np.nanmax(cut.value) < high < 0.6  # the band is far wider
    (plot,) = term_plots(in_axis_words(of_position()))
    bands = [one for one in plot.data if one.get("fill") == "toself"]
    assert len(bands) == 2 and max(bands[0]["x"]) < cut.x[100] <= cut.x[107] < min(bands[1]["x"])
    assert plot.data[-1]["y"][104] is None and plot.alt.startswith("The proposed term of position")


def test_a_surface_is_a_map_with_cuts_through_its_data() -> None:
    made = in_axis_words(of_velocity_and_force())
    view = view_of(of_velocity_and_force())
    assert view.surface is not None and view.surface.y_title == "motor force (N)"
    assert [cut.words for cut in view.cuts] == ["-9.8", "0", "9.8"] and view.cut_title == "motor force (N)"
    assert all(np.isfinite(cut.value).sum() >= 30 for cut in view.cuts)
    map_, lines = term_plots(made)
    drawn = map_.data[0]
    assert (len(drawn["z"]), len(drawn["z"][0])) == (len(drawn["y"]), len(drawn["x"])) == (41, 61)
    assert drawn["z"][0][0] is None and drawn["zmax"] == -drawn["zmin"] > 0.5
    assert [shape["y0"] for shape in map_.layout["shapes"]] == [cut.at for cut in view.cuts]
    assert [one["name"] for one in lines.data if one["mode"] == "lines" and "fill" not in one] == [
        cut.words for cut in view.cuts
    ]
    assert "cuts through the map" in view_words(view)


def test_directions_are_points_or_lines_of_their_own() -> None:
    view = view_of(of_direction())
    assert view.points and view.value_title == "proposed force (mN)" and view_words(view).startswith("Points")
    (plot,) = term_plots(in_axis_words(of_direction()))
    assert plot.layout["xaxis"]["ticktext"] == ["backwards", "forwards"] and plot.data[0]["mode"] == "markers"
    both = view_of(of_position_by_direction())
    assert both.surface is None and [cut.words for cut in both.cuts] == ["backwards", "forwards"]
    made = of_position_by_direction()
    assert made.proposal is not None and made.proposal.curve is not None
    curve = made.proposal.curve
    turned = replace(
        curve, axes=curve.axes[::-1], value=curve.value.T, low=curve.low.T, high=curve.high.T
    )  # the direction first
    other = view_of(replace(made, proposal=replace(made.proposal, curve=turned)))
    assert [cut.words for cut in other.cuts] == ["backwards", "forwards"]
    assert np.array_equal(other.cuts[1].value, both.cuts[1].value)


def test_small_factors_are_shown_in_thousandths() -> None:
    made = of_position()
    assert made.proposal is not None and made.proposal.curve is not None
    curve = replace(made.proposal.curve, factor="velocity", unit="N s/m")
    small = replace(curve, value=0.01 * curve.value, low=0.01 * curve.low, high=0.01 * curve.high)
    large = view_of(replace(made, proposal=replace(made.proposal, curve=curve)))
    view = view_of(replace(made, proposal=replace(made.proposal, curve=small)))
    assert large.value_title == "proposed force per velocity (N s/m)" and view.value_unit == "mN s/m"
    assert np.nanmax(view.cuts[0].value) == pytest.approx(10.0 * np.nanmax(curve.value))


@pytest.mark.parametrize("name", PROPOSED)
def test_the_figure_is_written_and_its_words_stay_apart(name: str, tmp_path: Path) -> None:
    made = in_axis_words(PROPOSED[name]())
    bare = replace(made, traces=(), where=(), pairs=(), measures={})
    written = {path.name for path in write_diagnosis(bare, tmp_path)}
    assert ("proposed_term.png" in written) == (name != "per recording")
    assert ("figures/proposed_term.png" in (tmp_path / "diagnosis.md").read_text(encoding="utf-8")) == (
        name != "per recording"
    )
    if name == "per recording":
        return
    figure = term_figure(made)
    figure.draw_without_rendering()
    assert figure._suptitle is not None
    for axes in figure.axes:
        for label in (axes.xaxis.label, axes.yaxis.label):
            box = label.get_window_extent()
            assert not label.get_text() or (box.y0 >= 0 and box.y1 < figure._suptitle.get_window_extent().y0)
        legend = axes.get_legend()
        if legend is not None:
            box = legend.get_window_extent()
            assert axes.get_window_extent().y1 <= box.y1 < figure._suptitle.get_window_extent().y0
            assert box.x1 <= figure.bbox.width


def test_what_is_missing_breaks_nothing(tmp_path: Path) -> None:
    base = of_velocity_and_force()
    assert base.proposal is not None and base.proposal.curve is not None
    curve = base.proposal.curve
    empty = np.full_like(curve.value, NAN)
    no_band = replace(curve, low=empty, high=empty)
    flat = replace(curve, value=0.0 * curve.value, low=empty, high=empty)
    cases = {
        "no data": replace(base.proposal, curve=replace(curve, value=empty, low=empty, high=empty)),
        "no band": replace(base.proposal, curve=no_band),
        "flat": replace(base.proposal, curve=flat),
        "no numbers": replace(base.proposal, closed=NAN, low=NAN, high=NAN, p_value=NAN, resembles=(), short=None),
    }
    for name, made in cases.items():
        diagnosis = replace(base, proposal=made, traces=(), measures={}, recordings=())
        written = {path.name for path in write_diagnosis(diagnosis, tmp_path / name)}
        assert ("proposed_term.png" in written) == (name != "no data")
        strict((tmp_path / name / "diagnosis.json").read_text(encoding="utf-8"))
        assert TERM_TITLE in console_of(diagnosis)


def test_plotly_accepts_every_figure_of_a_term() -> None:
    from plotly.graph_objects import Figure

    for make in PROPOSED.values():
        for plot in term_plots(in_axis_words(make())):
            Figure({"data": plot.data, "layout": plot.layout})  # raises for an unknown property
            assert plot.alt
