"""Tables say what the result says, in every medium."""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from linid.report.symbols import latex_escape, symbol_label, symbol_math, unit_label, unit_math
from linid.report.tables import (
    GAP_COLUMNS,
    PARAMETER_COLUMNS,
    BatchRow,
    batch_table_console,
    gap_latex,
    gap_table_console,
    parameter_csv,
    parameter_latex,
    parameter_table_console,
    table_text,
    write_csv,
    write_gap_csv,
)

from .samples import ESTIMATES, NAN, estimate, fit_result, gap


@pytest.mark.parametrize("width", [80, 100, 140])
def test_parameter_table_fits_and_shows_every_parameter(width: int) -> None:
    text = table_text(parameter_table_console(fit_result()), width)
    lines = text.splitlines()
    assert max(map(len, lines)) <= width
    assert "\x1b" not in text  # plain without a terminal
    for one in ESTIMATES:
        row = next(line for line in lines if line.startswith(one.name + " "))
        assert one.symbol in row
    assert "1.720 ± 0.021" in text and "[1.679, 1.762]" in text
    assert "1.7204" not in text
    assert "pole_pitch" in text and "force_constant and winding_displacement (-0.994)" in " ".join(text.split())
    assert re.search(r"bristle_stiffness +sigma_0 +not\b", text) and "identifiable," in text
    assert "~1e4" in text and "31234" not in text


def test_notes_are_numbered_as_in_the_rows() -> None:
    text = table_text(parameter_table_console(fit_result()), 140)
    row = next(line for line in text.splitlines() if line.startswith("bristle_damping"))
    assert row.endswith("3)")
    assert "3) at its upper bound" in text


def test_brackets_in_notes_are_not_markup() -> None:
    result = fit_result(estimates=(estimate("mass", "m", "kg", 1, 0.1, note="see [bold]file[/bold] [1]"),), derived=())
    assert "see [bold]file[/bold] [1]" in table_text(parameter_table_console(result))


def test_unfinished_search_is_named() -> None:
    text = table_text(parameter_table_console(fit_result(converged=False, warnings=("few data",))), 120)
    assert "The search did not converge: least squares: 60 steps used" in text and "Warning: few data" in text


def test_parameter_csv(tmp_path: Path) -> None:
    path = tmp_path / "parameters.csv"
    path.write_text(parameter_csv(fit_result()), encoding="utf-8")
    with path.open(newline="", encoding="utf-8") as stream:
        rows = {row["name"]: row for row in csv.DictReader(stream)}
    assert path.read_text().splitlines()[0] == ",".join(PARAMETER_COLUMNS)
    assert list(rows) == [e.name for e in ESTIMATES] + ["pole_pitch"]
    assert rows["bristle_stiffness"]["std"] == ""
    assert rows["pole_pitch"]["status"] == "derived"
    for one in ESTIMATES:  # to the last bit: rounding is for people, not for files
        assert float(rows[one.name]["value"]) == one.value
        if one.status == "fitted":
            assert tuple(float(rows[one.name][end]) for end in ("std", "low", "high")) == (one.std, one.low, one.high)
    assert list(tmp_path.iterdir()) == [path]  # no temporary file left


def test_gap_table_has_every_measure_with_its_floor() -> None:
    gaps = [gap(), gap("freewheel_[1]", kind="free_wheel", split="fit", free_run=NAN, ahead=1.234e-3)]
    text = table_text(gap_table_console(gaps))
    assert max(map(len, text.splitlines())) <= 80
    for part in ("0.523", "0.00012", "12.3   0.4", "0.112 0.051", "2.13", "1230", "held out", "freewheel_[1]", "µm"):
        assert part in text
    assert "nan" not in text
    rotary = table_text(gap_table_console([gap()], "rotary"))
    assert "µrad" in rotary and "N m" in rotary


def test_gap_csv_is_in_si(tmp_path: Path) -> None:
    path = write_gap_csv([gap()], tmp_path / "gaps.csv", "rotary")
    with path.open(newline="") as stream:
        (row,) = csv.DictReader(stream)
    assert tuple(row) == GAP_COLUMNS
    assert float(row["ahead"]) == gap().ahead and float(row["force_share"]) == gap().force_share
    assert (row["unit_ahead"], row["unit_force"]) == ("rad", "N m")


def test_batch_table() -> None:
    rows = [
        BatchRow("axis_01", "done", 12.34, "free run 0.52 %", "out/a"),
        {"job": "axis_02", "status": "failed", "seconds": 1.0, "key_figure": "-", "folder": "out/b"},
    ]
    text = table_text(batch_table_console(rows))
    for part in ("axis_01", "done", "12.3", "free run 0.52 %", "out/a", "axis_02", "failed", "out/b"):
        assert part in text


@pytest.mark.parametrize("latex", [parameter_latex(fit_result()), gap_latex([gap("a_b&c"), gap(free_run=NAN)])])
def test_latex_structure(latex: str) -> None:
    columns = len(re.findall(r"[lr]", re.search(r"\\begin\{tabular\}\{@\{\}([lr]+)@\{\}\}", latex)[1]))  # type: ignore[index]
    body = latex.split(r"\midrule", 1)[1].split(r"\bottomrule")[0]
    rows = [line for line in body.splitlines() if line.endswith(r"\\")]
    assert rows
    for row in rows:
        assert len(re.findall(r"(?<!\\)&", row)) == columns - 1
        assert row.count("$") % 2 == 0
        assert not re.search(r"(?<!\\)_", re.sub(r"\$[^$]*\$", "", row))  # no bare underscore outside mathematics
    assert [latex.count(rule) for rule in (r"\toprule", r"\bottomrule", r"\end{tabular}")] == [1, 1, 1]
    depth = 0
    for char in re.sub(r"\\[{}]", "", latex):
        depth += (char == "{") - (char == "}")
        assert depth >= 0
    assert depth == 0
    assert latex.isascii()


def test_latex_values() -> None:
    latex = parameter_latex(fit_result())
    assert r"coulomb force & $F_{C}$ & $1.720 \pm 0.021$ & $[1.679,\ 1.762]$ & $\mathrm{N}$ \\" in latex
    assert r"$\sigma_{0}$ & not identifiable, ${\sim}1 \times 10^{4}$" in latex
    assert r"$2$ (fixed)" in latex


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_latex_compiles(tmp_path: Path) -> None:
    (tmp_path / "p.tex").write_text(parameter_latex(fit_result()))
    (tmp_path / "g.tex").write_text(gap_latex([gap("a_b&c")]))
    main = r"\documentclass{article}\usepackage{booktabs}\begin{document}\input{p}\par\input{g}\end{document}"
    (tmp_path / "main.tex").write_text(main)
    command = ["pdflatex", "-halt-on-error", "-interaction=batchmode", "main"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True, check=False).returncode == 0


@pytest.mark.parametrize(
    ("symbol", "latex"),
    [
        ("F_C", "F_{C}"),
        ("sigma_0", r"\sigma_{0}"),
        ("omega_g", r"\omega_{g}"),
        ("alpha", r"\alpha"),
        ("alpha_S", r"\alpha_{S}"),
        ("m", "m"),
        ("K_f'", "K_{f}'"),
        ("a_12", "a_{12}"),
        ("k_cog", r"k_{\mathrm{cog}}"),
        ("z0", "z_{0}"),
        ("F_C_plus", r"F_{C,\mathrm{plus}}"),
        ("phi_theta", r"\phi_{\theta}"),
    ],
)
def test_symbols(symbol: str, latex: str) -> None:
    assert symbol_math(symbol) == latex


@pytest.mark.parametrize(
    ("symbol", "drawn"), [("F_C", 2), ("sigma_0", 2), ("weird $x_", 6), ("a-b", 2), ("F_C_plus", 7), ("K_f'", 3)]
)
def test_odd_symbols_survive_mathtext(symbol: str, drawn: int) -> None:
    """As many letters are drawn as there are: no command shows as text, and nothing gets lost."""
    from matplotlib.mathtext import MathTextParser

    assert len(MathTextParser("path").parse(symbol_label(symbol)).glyphs) == drawn


def test_units() -> None:
    assert unit_math("N s^2/m^2") == r"\mathrm{N\,s^{2}/m^{2}}"
    assert unit_label("kg m^2") == "kg m²"
    assert latex_escape("50 % of a_b & {c}") == r"50 \% of a\_b \& \{c\}"


@pytest.mark.parametrize("name", ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "\t=1"])
def test_foreign_names_are_no_formulas(tmp_path: Path, name: str) -> None:
    path = write_csv(tmp_path / "x.csv", ["a", "b"], [[name, "-1.5"]])
    ((cell, number),) = list(csv.reader(path.open(encoding="utf-8")))[1:]
    assert cell == f"'{name}" and float(number) == -1.5


def test_control_characters_leave_names(tmp_path: Path) -> None:
    from linid.recording import inspect_file, read_recording

    text = ["Time (ms),Position\x1b[31m (mm)", *(f"{k},{k * k % 17}.5" for k in range(60))]
    path = tmp_path / "a\nb\x07.csv"
    path.write_text("\n".join(text), encoding="utf-8")
    assert read_recording(path, kind="free_wheel").name == "a b"
    assert all("\x1b" not in column.header for column in inspect_file(path).columns)
