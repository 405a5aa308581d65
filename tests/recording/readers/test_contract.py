"""What every reader keeps to, those of other packages too."""

from __future__ import annotations

import random
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from linid.errors import ConfigError, LinidError
from linid.recording import ChannelMapping
from linid.recording.readers import registry
from linid.recording.readers.reader import Reader
from linid.recording.readers.registry import BUILT_IN, GROUP, collect, read_table, readers
from linid.recording.source import open_source

from ..exports import lines, write

MODULE = "tests.recording.readers.example_reader"
PAGE = Path(__file__).parents[3] / "docs" / "readers.md"


def point(name: str) -> EntryPoint:
    """An entry point of the example package."""
    return EntryPoint("kv", f"{MODULE}:{name}", GROUP)


@pytest.mark.parametrize("reader", BUILT_IN, ids=lambda r: r.name)
def test_names_and_words(reader: Reader) -> None:
    assert len(reader.about) <= 120 and reader.about == reader.about.strip()
    assert f"| `{reader.name}` |" in PAGE.read_text(encoding="utf-8")
    assert ChannelMapping(layout=reader.name).layout == reader.name


@pytest.mark.parametrize("reader", BUILT_IN, ids=lambda r: r.name)
def test_recognising_raises_nothing_but_refusals(reader: Reader, tmp_path: Path) -> None:
    r = random.Random(3)
    for k in range(60):
        size = r.choice([1, 3, 20, 300, 5000])
        content = (
            bytes(r.randrange(256) for _ in range(size))
            if k % 2
            else "".join(r.choice("Name,;:\t[]=.0123456789 \nMDF") for _ in range(size)).encode()
        )
        path = write(tmp_path, content, name=f"x{r.choice(['.csv', '.mat', '.svb', '.mf4', ''])}")
        try:
            assert reader.recognises(open_source(path)) in (True, False)
        except LinidError:
            assert reader.name in ("twincat", "controldesk", "elmo", "halscope", "codesys", "generic")


@pytest.mark.parametrize("reader", BUILT_IN[:-1], ids=lambda r: r.name)
def test_a_format_that_is_named_wrongly_is_refused(reader: Reader, tmp_path: Path) -> None:
    path = write(tmp_path, lines())
    try:
        table = read_table(path, ChannelMapping(layout=reader.name))
    except LinidError as error:
        assert error.place and error.fact and error.remedy
    else:
        assert reader.name == "elmo" and table.columns  # whose plain form is a header line, too


def test_a_reader_of_another_package_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = collect(BUILT_IN, [point("READER")])
    assert found[0].name == "kv" and found[1:] == BUILT_IN
    monkeypatch.setattr(registry, "readers", lambda: found)
    path = tmp_path / "run.kv"
    path.write_text("#kv\n" + "".join(f"t_s={k / 1e3} pos_mm={k % 7}\n" for k in range(60)), encoding="utf-8")
    table = read_table(path, ChannelMapping())
    assert table.layout == "kv" and [c.name for c in table.columns] == ["t", "pos"]
    np.testing.assert_array_equal(table.columns[1].values, np.arange(60) % 7)
    assert ChannelMapping(layout="kv").layout == "kv"


@pytest.mark.parametrize(
    ("name", "said"),
    [("NO_READER", "expected a linid Reader"), ("RIVAL", "is taken by linid"), ("ABSENT", "cannot be loaded")],
)
def test_malformed_readers_are_refused(name: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        collect(BUILT_IN, [point(name)])


def test_what_nothing_marks_is_generic(tmp_path: Path) -> None:
    source = open_source(write(tmp_path, lines()))
    assert next(r.name for r in readers() if r.recognises(source)) == "generic"
