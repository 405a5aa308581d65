"""What is fed in: good files of every kind, and what random changes make of them."""

from __future__ import annotations

import io
import json
import random
import string
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

N = 120
T = np.arange(N) * 1e-3
Y = 0.1 + 0.05 * np.sin(2 * np.pi * 7 * T)
I = 0.5 * np.sin(2 * np.pi * 11 * T + 0.3)  # noqa: E741


@dataclass(frozen=True)
class Truth:
    """How a text was written, for the oracle: separator, decimal mark, lines above the samples, columns of time,
    position and current, encoding."""

    separator: str
    decimal: str
    header: int
    columns: tuple[int, int, int]
    encoding: str


@dataclass(frozen=True)
class Input:
    """One file: kind (readers, yaml, models, checkpoints), suffix, content; truth: where an oracle can judge it."""

    kind: str
    suffix: str
    content: bytes
    truth: Truth | None = None


def _cells(decimal: str, digits: int) -> list[list[str]]:
    rows = [[f"{1e3 * t:g}", f"{1e3 * y:.{digits}f}", f"{i:.{digits}f}"] for t, y, i in zip(T, Y, I, strict=True)]
    return [[cell.replace(".", decimal) for cell in row] for row in rows]


def generic(r: random.Random) -> Input:
    """One line of names, in any dialect."""
    separator = r.choice([",", ";", "\t", ";", "\t"])
    decimal = "." if separator == "," else r.choice(".,")
    rows = _cells(decimal, r.randint(2, 8))
    head = ["Time (ms)", "Position (mm)", r.choice(["Iq (A)", "Current Q [A]"])]
    encoding = r.choice(["utf-8", "utf-8", "utf-8-sig", "utf-16", "cp1252"])
    end = r.choice(["\n", "\r\n"])
    text = end.join(separator.join(row) for row in [head, *rows]) + end
    return Input("readers", ".csv", text.encode(encoding), Truth(separator, decimal, 1, (0, 1, 2), encoding))


def good() -> bytes:
    """A recording that every mapping of the fuzz could be meant for."""
    rows = ["Time (ms),Position (mm),Iq (A),Iu (A),Iv (A)"]
    rows += [f"{1e3 * t:g},{1e3 * y:.6f},{i:.5f},{i:.5f},{-i / 2:.5f}" for t, y, i in zip(T, Y, I, strict=True)]
    return "\n".join(rows).encode()


def twincat(r: random.Random) -> Input:
    """Two time groups and a header of keys."""
    separator = r.choice(["\t", ";", ",", " ", ":"])
    rows = _cells(".", 5)
    head = [["Name", "scope"], ["Starttime of export", "132959733843760000"], []]
    head += [["Name", "ActPos", "Name", "Iq"], ["Data-Type", "REAL64", "Data-Type", "REAL64"]]
    head += [["SymbolName", "A.y", "SymbolName", "A.i"], ["Unit", "mm (Length)", "Unit", "A (Current)"], []]
    body = [[t, y, t, i] for t, y, i in rows]
    text = "\n".join(separator.join(row) for row in [*head, *body]) + r.choice(["\n", "\nEOF\n"])
    truth = Truth(separator, ".", len(head), (0, 1, 3), "utf-8")
    return Input("readers", ".csv", text.encode(), None if separator == " " else truth)


def sectioned(r: random.Random) -> Input:
    """Elmo: sections, or a chart of EAS; ControlDesk; halscope; clock times."""
    rows = _cells(".", 5)
    form = r.randrange(5)
    if form == 0:
        text = "[Recorder]\nSampling Time (ms),1\n[Data]\nTime (ms),Position (mm),Iq (A),\n"
        text += "".join(",".join(row) + ",\n" for row in rows)
    elif form == 1:
        text = "Elmo txt chart ver 2.0\n[Signal Names]\n1,Time (ms),\n2,Position (mm),\n3,Iq (A),\n"
        text += "[Signals Data Group 1]\n1,2,3,\n" + "".join(",".join(row) + ",\n" for row in rows)
    elif form == 2:
        text = "path,Time,A/Position,A/Iq\nunit,ms,mm,A\ntrace_values,,,\n" + "".join(
            "," + ",".join(x) + "\n" for x in rows
        )
    elif form == 3:
        text = "Sampling period is 1000000 nSec\n" + "".join(f"pos {y} iq {i}\n" for _, y, i in rows)
    else:
        text = "Timestamp;Position (mm)\n" + "".join(
            f"2026-11-23T12:00:{t / 10:09.6f};{y[1]}\n" for t, y in zip(T, rows, strict=True)
        )
    return Input("readers", ".csv", text.encode())


def matlab(r: random.Random) -> Input:
    """A .mat file of vectors and containers."""
    import scipy.io

    stream = io.BytesIO()
    content = {"time_s": T, "pos_mm": 1e3 * Y, "data": np.stack([T, Y, I]), "s": {"y": Y, "n": 3.0}}
    scipy.io.savemat(stream, content, do_compression=r.random() < 0.3)
    return Input("readers", ".mat", stream.getvalue())


def yaml_file(r: random.Random) -> Input:
    """A campaign, a settings file or a mapping."""
    texts = [
        "name: axis\naxis: linear\nknown: {mass: 2.5}\nchannels:\n"
        "  time: {column: Time (ms), unit: ms}\n  period: 1 ms\n"
        "recordings:\n  - {file: a.csv, kind: motor, split: fit, added_mass_kg: 0.5}\n"
        "  - {file: b.csv, kind: free_wheel, window: [0.1, 0.9], repeat_of: a.csv}\n",
        "generations: 10\npopulation: 20\nseed: 3\nbounds: {mass: [0.1, 10]}\neffects: [cogging]\nknown: {mass: 1.0}\n",
        "channels:\n  time: {column: Time (ms), unit: ms}\n  position: {column: '#2', unit: mm, scale: 1.5}\n"
        "  current_u: {column: Iu (A), unit: A}\n  current_v: '#5'\n  encoding: utf-8\n  decimal: '.'\n"
        "  separator: ','\n  layout: generic\n  period: 1 ms\n  time_group: 1\n",
        "defaults: &d {seed: 1}\njobs:\n  - {name: fit, command: fit-friction, files: [a.csv], <<: *d}\n",
    ]
    return Input("yaml", ".yaml", r.choice(texts).encode())


def model(r: random.Random) -> Input:
    """A model file, made by the program once."""
    return Input("models", ".json", _model_text().encode())


def checkpoint(r: random.Random) -> Input:
    """A search state as a search leaves it, or the finished steps of a diagnosis."""
    if r.random() < 0.2:
        body = {"schema": 2, "identity": "x", "state": {"a": "text", "b": [1.0, 2.0]}}
        return Input("checkpoints", ".json", json.dumps(body).encode())
    return Input("checkpoints", ".json", _saved(r.choice(["genetic", "cma"])))


def parabola(point: Any) -> Any:
    """The cost of the fuzz's searches."""
    return ((point - 0.3) ** 2).sum(axis=1)


@cache
def _saved(method: str) -> bytes:
    import tempfile
    from pathlib import Path

    from linid.identification.optimise.genetic import search
    from linid.identification.optimise.least_squares import LeastSquaresFit
    from linid.identification.settings import SearchSettings
    from linid.workflow.run.checkpoint import Checkpoint

    with tempfile.TemporaryDirectory() as folder:
        kept = Checkpoint(Path(folder) / "checkpoint.json", "x")
        settings = SearchSettings(method=method, population=8, generations=3, patience=100)
        none = np.zeros(0)
        refined = LeastSquaresFit(np.full(3, 0.5), none, 0.1, True, "", (), 1, none, np.zeros((0, 3)))
        search(parabola, np.full((1, 3), 0.5), 3, settings, starts=[refined], watch=kept.save)
        kept.flush()
        return kept.path.read_bytes()


_MODEL: list[str] = []


def _model_text() -> str:
    if not _MODEL:
        from linid.identification.model_file import model_to_text
        from linid.identification.result import Estimate, FitResult
        from linid.physics.model import Model

        parameters = Model("friction", ()).parameters
        rows = tuple(
            Estimate(p.name, p.symbol, p.unit, p.default or 1.0, 0.1, 0.0, 2.0, "fitted", "") for p in parameters
        )
        names = tuple(p.name for p in parameters)
        _MODEL.append(
            model_to_text(
                FitResult(
                    "friction",
                    "linear",
                    (),
                    rows,
                    names,
                    np.eye(len(names)),
                    3.0,
                    (),
                    {},
                    {},
                    {},
                    (),
                    ("done",),
                    True,
                    1,
                    100,
                    2,
                    0.0,
                    covariance=np.eye(len(names)),
                )
            )
        )
    return _MODEL[0]


MAKERS: dict[str, tuple[Callable[[random.Random], Input], ...]] = {
    "readers": (generic, generic, generic, twincat, sectioned, matlab),
    "yaml": (yaml_file,),
    "models": (model,),
    "checkpoints": (checkpoint,),
}
ODD_CELLS = (
    "",
    " ",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "1e308",
    "1e-400",
    "1,234,567",
    "1.234.567",
    "250,000",
    "1'234",
    "x",
    "#N/A",
    '"',
    '"1,5"',
    "1,5",
    "1.5",
    "--3",
    "+",
    "0x1F",
    "1e5",
    "٣",
    "½",
    "12:00:01",
    "2026-11-23",
    "=1+1",
    "9" * 500,
    "\x00",
    "NaN NaN",
    "TRUE",
    "-",
    "1 000",
    "1\u00a0000",
    "1e",
    ".",
    ",",
    "1..2",
    "null",
    "\ufeff1",
    "1_000",
    "∞",
)


def mutated(one: Input, r: random.Random) -> Input:
    """The input with some random changes; an oracle knows no more where the dialect changed."""
    content, truth = one.content, one.truth
    for _ in range(r.choice([0, 1, 1, 1, 2, 3, 6])):
        if r.random() < 0.7 and one.suffix != ".mat":
            content, kept = _text_change(content, one, r)
            truth = truth if kept else None
        else:
            content, truth = _byte_change(content, r), None
    return Input(one.kind, one.suffix, content, truth)


def _byte_change(content: bytes, r: random.Random) -> bytes:
    data = bytearray(content)
    if not data:
        return content
    at = r.randrange(len(data))
    match r.randrange(7):
        case 0:
            data[at] = r.randrange(256)
        case 1:
            del data[at : at + r.choice([1, 2, 10, 1000])]
        case 2:
            data[at:at] = bytes(r.randrange(256) for _ in range(r.choice([1, 3, 50])))
        case 3:
            data = data[:at]
        case 4:
            data[at:at] = data[: r.randrange(len(data))][:5000]
        case 5:
            data[at : at + 1] = r.choice([b"\x00" * 20, b"\xff\xfe", b"\x1f\x8b", b"PK\x03\x04", b"\x1b[31m", b"\r"])
        case _:
            data[:0] = r.choice([b"\xef\xbb\xbf", b"\xff\xfe", b"sep=;\n", b"\n\n", b"# comment\n", b"\x89HDF\r\n"])
    return bytes(data)


def _text_change(content: bytes, one: Input, r: random.Random) -> tuple[bytes, bool]:
    """The text with a change that belongs to its kind, and whether its dialect is still the written one."""
    encoding = one.truth.encoding if one.truth else "utf-8"
    text = content.decode(encoding, "replace")
    lines = text.splitlines()
    if not lines:
        return content, False
    changed, kept = (_tree_change(text, r), False) if one.kind in ("models", "checkpoints") else (None, True)
    if changed is None:
        changed, kept = _line_change(lines, one, r)
    return changed.encode(encoding, "replace"), kept


def _line_change(lines: list[str], one: Input, r: random.Random) -> tuple[str, bool]:
    at = r.randrange(len(lines))
    separator = one.truth.separator if one.truth else r.choice(",;\t: ")
    cells = lines[at].split(separator)
    kept = one.truth is None or at >= one.truth.header  # an oracle counts the lines above the samples
    match r.randrange(12):
        case 0 | 1:
            cells[r.randrange(len(cells))] = r.choice(ODD_CELLS)
            lines[at] = separator.join(cells)
        case 2:
            del cells[r.randrange(len(cells))]
            lines[at] = separator.join(cells)
        case 3:
            lines[at] = separator.join([*cells, r.choice(ODD_CELLS)])
        case 4:
            lines.insert(at, r.choice(["", lines[at], "-----", "[Section]", "EOF", ";;;;", "\t\t", lines[0]]))
        case 5:
            del lines[at : at + r.choice([1, 1, 3, 30])]
        case 6:
            other = r.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
            kept = kept and (one.truth is None or other >= one.truth.header)
        case 7:
            lines[at] = lines[at][: r.randrange(len(lines[at]) + 1)]
        case 8:
            lines[at] = "".join(r.choice([c, c, c, r.choice(string.printable)]) for c in lines[at])
        case 9:
            lines = [line.replace(separator, r.choice([",", ";", "\t", "|", "  "])) for line in lines]
            kept = False
        case 10:
            lines = [_grouped(line, separator, r) for line in lines]
        case _:
            lines[at] = lines[at].replace(r.choice(".,;e1"), r.choice([",", ".", "", "e", "\u2212"]), 1)
    return "\n".join(lines) + "\n", kept


def _grouped(line: str, separator: str, r: random.Random) -> str:
    """Numbers of four digits and more with grouping, as spreadsheets write them."""
    mark = "," if separator != "," else "'"
    return separator.join(
        f"{cell[:-3]}{mark}{cell[-3:]}" if cell.isdigit() and len(cell) > 3 else cell for cell in line.split(separator)
    )


def _tree_change(text: str, r: random.Random) -> str | None:
    """JSON with another value somewhere."""
    try:
        body = json.loads(text)
    except (ValueError, RecursionError):
        return None
    values = [None, True, -1, 0, 1e308, 2_000_000_000, "x", "", [], {}, [[]], "=1", -1e-300, 10**30, "\u0000", [None]]
    node, parent, key = body, None, None
    for _ in range(r.randint(1, 6)):
        if isinstance(node, dict) and node:
            parent, key = node, r.choice(sorted(node))
        elif isinstance(node, list) and node:
            parent, key = node, r.randrange(len(node))
        else:
            break
        node = parent[key]
    if parent is not None:
        if r.random() < 0.3:
            del parent[key]
        else:
            parent[key] = r.choice(values)
    return json.dumps(body)


def made(kind: str, seed: int) -> Input:
    """The input of a seed: the same everywhere."""
    r = random.Random(seed)
    return mutated(r.choice(MAKERS[kind])(r), r)
