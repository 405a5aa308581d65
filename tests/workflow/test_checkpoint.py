"""A checkpoint that is damaged, foreign or made up is refused with its place; a good one goes on to the last bit."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from linid.errors import ConfigError
from linid.identification.optimise.genetic import search
from linid.identification.optimise.least_squares import LeastSquaresFit
from linid.identification.optimise.search_state import SearchState
from linid.identification.settings import SearchSettings
from linid.workflow.run.checkpoint import SCHEMA, Checkpoint, Memory

Change = Callable[[dict[str, Any]], None]
METHODS = ("genetic", "cma", "plain")


def cost(point: np.ndarray) -> np.ndarray:
    return np.asarray(((point - 0.3) ** 2).sum(axis=1))


def settings(method: str, generations: int = 6) -> SearchSettings:
    return SearchSettings(method=method, population=8, generations=generations, patience=100)


def refined() -> list[LeastSquaresFit]:
    """A first candidate of three unknowns with two start offsets, as least squares leave one."""
    none = np.zeros(0)
    return [LeastSquaresFit(np.full(3, 0.5), np.array([0.25, -1.5]), 0.1, True, "", (), 7, none, np.zeros((0, 5)))]


def saved(folder: Path, method: str) -> Path:
    """The checkpoint of a search of three unknowns after some generations."""
    checkpoint = Checkpoint(folder / "checkpoint.json", "same")
    search(cost, np.full((1, 3), 0.5), 3, settings(method, 3), starts=refined(), watch=checkpoint.save)
    checkpoint.flush()
    return checkpoint.path


@pytest.mark.parametrize("method", METHODS)
def test_a_search_goes_on_to_the_same_end(tmp_path: Path, method: str) -> None:
    state = Checkpoint(saved(tmp_path, method), "same").load()
    assert state is not None and state.generation == 3
    resumed, _ = search(cost, np.empty((0, 3)), 3, settings(method), resume=state)
    whole, _ = search(cost, np.full((1, 3), 0.5), 3, settings(method), starts=refined())
    assert vars(resumed) == vars(whole)


def state(key: str, value: Any) -> Change:
    return lambda body: body["state"].update({key: value})


def random_word(place: int, value: Any) -> Change:
    return lambda body: body["state"]["random_state"][1].__setitem__(place, value)


CHANGES: list[tuple[str, Change]] = [
    ("genetic", lambda body: body.update(schema=1)),
    ("genetic", lambda body: body.update(schema=True)),
    ("genetic", lambda body: body.update(identity="other")),
    ("genetic", lambda body: body.pop("identity")),
    ("genetic", lambda body: body.update(state=[])),
    ("genetic", lambda body: body.update(state="abc")),
    ("genetic", lambda body: body["state"].pop("costs")),
    ("genetic", state("magic", 1)),
    ("genetic", state("method", "magic")),
    ("genetic", state("generation", "3")),
    ("genetic", state("generation", -1)),
    ("genetic", state("generation", 10**30)),
    ("genetic", state("population", [])),
    ("genetic", state("population", [[0.5, 0.5]] * 8)),
    ("genetic", state("population", [[0.5, 0.5, 7.0]] * 8)),
    ("genetic", state("population", [["a", 0.5, 0.5]] * 8)),
    ("genetic", state("costs", [1.0])),
    ("genetic", state("costs", [float("nan")] * 8)),
    ("genetic", state("best", [])),
    ("genetic", state("best_cost", None)),
    ("genetic", state("history", [[1.0, 2.0]])),
    ("genetic", state("history", [[float("inf"), 2.0, 1.0, 1.0]])),
    ("genetic", state("random_state", None)),
    ("genetic", state("random_state", [3, [1, 2, 3], None])),
    ("genetic", state("start_offsets", [])),
    ("genetic", state("start_offsets", [["a", 0.0]])),
    ("genetic", state("start_offsets", [[float("inf"), 0.0]])),
    ("genetic", state("extra", {"sigma": 1.0})),
    ("genetic", random_word(0, -1)),
    ("genetic", random_word(0, 0.5)),
    ("genetic", random_word(624, 10**6)),
    ("cma", random_word(0, 2**40)),
    ("cma", lambda body: body["state"]["random_state"].__setitem__(2, 10**6)),
    ("cma", lambda body: body["state"]["extra"].update(__class__="x")),
    ("cma", lambda body: body["state"]["extra"].pop("sigma")),
    ("cma", lambda body: body["state"]["extra"].update(C=[[1.0]])),
]


@pytest.mark.parametrize(("method", "change"), CHANGES, ids=range(len(CHANGES)))
def test_a_changed_state_is_refused(tmp_path: Path, method: str, change: Change) -> None:
    path = saved(tmp_path, method)
    body = json.loads(path.read_text())
    change(body)
    path.write_text(json.dumps(body))
    with pytest.raises(ConfigError, match=r"checkpoint\.json") as caught:
        Checkpoint(path, "same").load()
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize(
    "content", [b"", b"{", b"\xff\xfe", b"[]", b"null", b'{"a":' * 10**5, b"[" * 10**6, b"9" * 5000, b"\0" * 9]
)
def test_what_is_no_checkpoint_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "checkpoint.json"
    path.write_bytes(content)
    for kept in (Checkpoint(path, "same"), Memory(path, "same")):
        with pytest.raises(ConfigError, match=r"checkpoint\.json"):
            kept.load()


def test_cut_short_at_every_byte_it_is_refused(tmp_path: Path) -> None:
    path = saved(tmp_path, "genetic")
    data = path.read_bytes()
    for end in range(0, len(data), 997):
        path.write_bytes(data[:end])
        with pytest.raises(ConfigError):
            Checkpoint(path, "same").load()


@pytest.mark.parametrize("steps", [{"a": 1}, {"a": ["x"]}, {"a": [[1.0]]}, {"a": None}, {"a": {"b": 1}}])
def test_finished_steps_are_texts_or_lists_of_numbers(tmp_path: Path, steps: Any) -> None:
    path = tmp_path / "checkpoint.json"
    path.write_text(json.dumps({"schema": SCHEMA, "identity": "same", "state": steps}))
    with pytest.raises(ConfigError, match="is not a search state"):
        Memory(path, "same").load()


@pytest.mark.parametrize(("method", "unknowns", "population"), [("genetic", 4, 8), ("cma", 3, 8), ("genetic", 3, 10)])
def test_the_state_of_another_search_is_refused(tmp_path: Path, method: str, unknowns: int, population: int) -> None:
    known: SearchState | None = Checkpoint(saved(tmp_path, "genetic"), "same").load()
    other = SearchSettings(method=method, population=population)
    with pytest.raises(ConfigError, match="of another search"):
        search(cost, np.empty((0, unknowns)), unknowns, other, resume=known)
