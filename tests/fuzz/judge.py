"""What a program may do with any input: succeed, or refuse with place, fact and remedy; soon, in little memory, and
never misread what an independent reader sees otherwise."""

from __future__ import annotations

import io
import resource
import time
import warnings
from pathlib import Path

import numpy as np

from linid.errors import LinidError
from tests.fuzz.inputs import Input, Truth

MOST_SECONDS, MOST_MEMORY = 5.0, 1 << 20  # CPU s; kB of growth


def verdict(one: Input, folder: Path) -> str:
    """Empty where all is well, else what went wrong."""
    path = folder / f"input{one.suffix}"
    path.write_bytes(one.content)
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    wrong = ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            wrong = _used(one, path)
    except LinidError as error:
        if not (error.place and error.fact and error.remedy):
            wrong = "an error without place, fact or remedy"
        elif len(str(error)) > 20_000:
            wrong = f"a message of {len(str(error))} characters"
    except Exception as error:
        wrong = f"{type(error).__name__}: {str(error)[:200]}"
    took = time.process_time() - start
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    if took > MOST_SECONDS and len(one.content) < 1 << 20:
        return f"takes {took:.1f} s"
    return f"takes {grown >> 10} MiB" if grown > MOST_MEMORY else wrong


def _used(one: Input, path: Path) -> str:
    if one.kind == "models":
        from linid.identification.model_file import load_model

        load_model(path)
    elif one.kind == "checkpoints":
        from linid.identification.optimise.genetic import search
        from linid.identification.settings import SearchSettings
        from linid.workflow.run.checkpoint import Checkpoint, Memory
        from tests.fuzz.inputs import parabola

        try:
            Memory(path, "x").load()
        except LinidError as error:
            if not error.remedy:
                return "an error without a remedy"
        state = Checkpoint(path, "x").load()
        if state is not None:
            settings = SearchSettings(method=state.method, population=8, generations=state.generation + 1, patience=100)
            search(parabola, np.empty((0, 3)), 3, settings, resume=state)
    elif one.kind == "yaml":
        return _yaml(path)
    else:
        return _reader(one, path)
    return ""


def _yaml(path: Path) -> str:
    from linid.interface.settings import make_settings
    from linid.recording import read_campaign
    from linid.workflow.batch.file import read_batch
    from linid.workflow.run.settings import read_settings

    for reads in (read_campaign, lambda p: make_settings(read_settings(p)), lambda p: read_batch(p, {}), _mapped):
        try:
            reads(path)
        except LinidError as error:
            if not (error.place and error.fact and error.remedy):
                return "an error without place, fact or remedy"
    return ""


def _mapped(path: Path) -> None:
    """A mapping or settings on a good recording."""
    from linid.recording import ChannelMapping, checks_of, inspect_file, read_recording
    from linid.workflow.run.settings import read_mapping
    from tests.fuzz.inputs import good

    recording = path.with_name("good.csv")
    recording.write_bytes(good())
    mapping = ChannelMapping.model_validate(read_mapping(path))
    if inspect_file(recording, mapping).problem is None:
        checks_of([read_recording(recording, channels=mapping)])


def _reader(one: Input, path: Path) -> str:
    """Inspect and read, and compare with what pandas sees in the true dialect."""
    from linid.recording import checks_of, inspect_file, read_recording, starter_mapping

    found = inspect_file(path)
    starter_mapping(found)
    if found.problem is not None:
        return ""
    recording = read_recording(path)
    checks_of([recording])
    if one.truth is None or any(note for note in recording.notes if not _harmless(note)):
        return ""
    expected = oracle(one.content, one.truth)
    if expected is None:
        return ""
    t, y, i = expected
    for name, seen, true in (
        ("t", recording.t, 1e-3 * t),
        ("y", recording.y, 1e-3 * y),
        ("i", recording.drive_input, i),
    ):
        if seen is None:
            continue
        if seen.size != true.size:
            return f"misread: {seen.size} samples of {name}, {true.size} in the file"
        if not np.allclose(seen, true, rtol=1e-9, atol=1e-12):
            k = int(np.argmax(np.abs(seen - true)))
            return f"misread: {name}[{k}] is {seen[k]!r}, {true[k]!r} in the file"
    return ""


def _harmless(note: str) -> bool:
    """Notes that leave every sample as it is."""
    return note.startswith(
        ("decoded as", "end-of-file", "time starts", "a free-wheel", "all currents", "i_q:", "several")
    )


def oracle(content: bytes, truth: Truth) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:  # type: ignore[type-arg]
    """Time, position and current by pandas in the true dialect; None where not every cell is a plain number."""
    import pandas as pd

    try:
        text = content.decode(truth.encoding)
        body = "\n".join(line for line in text.splitlines()[truth.header :] if line.strip() and line.strip() != "EOF")
        frame = pd.read_csv(
            io.StringIO(body),
            sep=truth.separator,
            decimal=truth.decimal,
            header=None,
            dtype=str,
            keep_default_na=False,
            quoting=3,
        )
        columns = []
        for k in truth.columns:
            cells = frame[k].str.strip()
            if truth.decimal == "," and cells.str.contains(".", regex=False).any():
                return None
            plain = cells.str.replace(",", ".", regex=False) if truth.decimal == "," else cells
            if not plain.str.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?").all():
                return None
            columns.append(plain.astype(float).to_numpy())
    except (ValueError, KeyError, UnicodeError, pd.errors.ParserError):
        return None
    return columns[0], columns[1], columns[2]
