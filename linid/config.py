"""YAML and JSON files -> plain data, bounded in size, depth and kind; YAML -> validated pydantic model.

Every complaint names the file and the line.
"""

from __future__ import annotations

import difflib
import json
import os
import stat
import typing
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from linid.errors import ConfigError

Model = TypeVar("Model", bound=BaseModel)
Location = Sequence[str | int]
MOST_BYTES = 1 << 22  # of a YAML file that somebody wrote
MOST_JSON_BYTES = 1 << 28  # of a JSON file that a run wrote
_MOST_VALUES = 200_000  # with all aliases written out
_DEEPEST = 60


class _Loader(yaml.SafeLoader):
    """YAML's plain values; what looks like a date stays text, and tags for other kinds of values are errors."""


_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:timestamp"]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


def parse_yaml(text: str, place: str) -> Any:
    """The data of a YAML text; raises ConfigError for bad syntax, repeated keys, and what would never end."""
    return _parsed(text, place)[1]


def _parsed(text: str, place: str) -> tuple[yaml.Node | None, Any]:
    """The nodes of a YAML text and its data."""
    try:
        root = yaml.compose(text, Loader=_Loader)
        _bounded(root, place)
        _refuse_duplicate_keys(root, place)
        return root, yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise _syntax_error(error, place) from None
    except RecursionError:
        raise ConfigError(place, f"is nested deeper than {_DEEPEST} levels", "Flatten it.") from None
    except (ValueError, OverflowError, TypeError, AttributeError) as error:
        raise ConfigError(place, f"holds a value that cannot be: {str(error)[:120]}", "Correct the value.") from None


def _bounded(root: yaml.Node | None, place: str) -> None:
    """ConfigError for an alias that holds itself, too many values with all aliases written out, or too deep ones."""
    sizes: dict[int, int] = {}
    open_nodes: set[int] = set()

    def size(node: yaml.Node, depth: int) -> int:
        line = node.start_mark.line + 1
        if id(node) in open_nodes:
            raise ConfigError(f"{place}, line {line}", "an alias that holds itself", "Write the value out.")
        if id(node) in sizes:
            return sizes[id(node)]
        if depth > _DEEPEST:
            raise ConfigError(f"{place}, line {line}", f"is nested deeper than {_DEEPEST} levels", "Flatten it.")
        open_nodes.add(id(node))
        total = 1
        if isinstance(node, yaml.MappingNode):
            total += sum(size(key, depth + 1) + size(value, depth + 1) for key, value in node.value)
        elif isinstance(node, yaml.SequenceNode):
            total += sum(size(item, depth + 1) for item in node.value)
        open_nodes.remove(id(node))
        if total > _MOST_VALUES:
            raise ConfigError(
                f"{place}, line {line}", f"holds more than {_MOST_VALUES} values (aliases written out)", "Shorten it."
            )
        sizes[id(node)] = total
        return total

    if root is not None:
        size(root, 0)


def _refuse_duplicate_keys(node: yaml.Node | None, place: str) -> None:
    """PyYAML keeps the last of two equal keys without a word."""
    waiting, seen_nodes = [node], set()
    while waiting:
        one = waiting.pop()
        if one is None or id(one) in seen_nodes:
            continue
        seen_nodes.add(id(one))
        if isinstance(one, yaml.SequenceNode):
            waiting += one.value
        if not isinstance(one, yaml.MappingNode):
            continue
        seen: dict[str, int] = {}
        for key, value in one.value:
            waiting.append(value)
            if not isinstance(key, yaml.ScalarNode):
                continue
            line = key.start_mark.line + 1
            if key.value in seen:
                raise ConfigError(
                    f"{place}, line {line}",
                    f"key '{key.value}' is given twice (first in line {seen[key.value]})",
                    "Keep one of the two.",
                )
            seen[key.value] = line


def _syntax_error(error: yaml.YAMLError, place: str) -> ConfigError:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    place = f"{place}, line {mark.line + 1}, column {mark.column + 1}" if mark else place
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    return ConfigError(
        place,
        f"not valid YAML: {problem[:200]}",
        "Check indentation (spaces, no tabs), brackets, quotes and the space after each colon.",
    )


class YamlFile:
    """A parsed YAML file that remembers on which line each key stands."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.root, self.data = _parsed(_read(path, MOST_BYTES), str(path))

    def line(self, location: Location) -> int:
        """Line number (from 1) of the key or item at `location`, or of its closest parent."""
        node, line = self.root, 1
        for step in location:
            if isinstance(node, yaml.MappingNode):
                for key, value in node.value:
                    if key.value == str(step):
                        node, line = value, key.start_mark.line + 1
                        break
            elif isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
                node = node.value[step]
                line = node.start_mark.line + 1
        return line

    def place(self, location: Location = ()) -> str:
        """`file, line N` for an error message."""
        return f"{self.path}, line {self.line(location)}"


def _read(path: Path, most: int) -> str:
    """The text of a regular file of at most so many bytes; raises ConfigError otherwise."""
    place = str(path) if len(str(path)) <= 300 else f"{str(path)[:150]}...{str(path)[-100:]}"
    try:
        about = os.stat(path)
        if stat.S_ISDIR(about.st_mode):
            raise ConfigError(place, "is a folder, a file is expected", "Name the file inside it.")
        if not stat.S_ISREG(about.st_mode):
            raise ConfigError(place, "is a pipe or a device, a file is expected", "Write it to a file first.")
        if about.st_size > most:
            raise ConfigError(place, f"is larger than {most >> 20} MiB", "Check that this is the right file.")
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise ConfigError(place, "file not found", "Check the path.") from None
    except OSError as error:
        raise ConfigError(place, f"cannot be read: {error.strerror}", "Check path and permissions.") from None
    except UnicodeDecodeError as error:
        raise ConfigError(
            place, f"is not UTF-8 text (byte {error.start})", "Save the file with the encoding UTF-8."
        ) from None
    except ValueError as error:  # a NUL in the path
        raise ConfigError(place, f"is no path: {error}", "Check the path.") from None


def read_json(path: str | Path, remedy: str, *, finite: bool = True) -> Any:
    """The data of a JSON file of this program; raises ConfigError for what is none, damaged or endless.

    remedy: what to do about a file that is not what it should be.
    """
    return parse_json(_read(Path(path), MOST_JSON_BYTES), str(path), remedy, finite=finite)


def json_text(data: Any) -> str:
    """Data as the text of a JSON file of this program, whose numbers are finite; raises ValueError for others."""
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def parse_json(text: str, place: str, remedy: str, *, finite: bool = True) -> Any:
    """The data of a JSON text; raises ConfigError for what is none, and (finite) for NaN and Infinity."""

    def refuse(name: str) -> Any:
        if not finite:
            return float(name)
        raise ValueError(f"{name} is no number")

    def number(literal: str) -> float:
        value = float(literal)
        return refuse(literal[:40]) if value in (float("inf"), float("-inf")) else value

    try:
        return json.loads(text, parse_constant=refuse, parse_float=number)
    except json.JSONDecodeError as error:
        raise ConfigError(f"{place}:{error.lineno}", f"is not JSON ({error.msg})", remedy) from None
    except (ValueError, RecursionError) as error:
        raise ConfigError(place, f"is a damaged JSON file ({str(error)[:120]})", remedy) from None


def load_yaml_model(path: str | Path, model: type[Model]) -> Model:
    """Read a YAML file into `model`; unknown keys, wrong types and syntax errors raise ConfigError with the line."""
    return validate_yaml(YamlFile(Path(path)), model)


def validate_yaml(file: YamlFile, model: type[Model]) -> Model:
    """Validate an already parsed YAML file (for callers that need its line numbers later); raises ConfigError where it
    does not fit.
    """
    if not isinstance(file.data, dict):
        found = "nothing" if file.data is None else f"a {type(file.data).__name__}"
        raise ConfigError(
            file.place(), f"found {found}, expected `key: value` lines", f"Known keys: {', '.join(model.model_fields)}."
        )
    try:
        return model.model_validate(file.data)
    except ValidationError as error:
        raise _config_error(file, model, error) from None


def json_schema(model: type[BaseModel]) -> dict[str, Any]:
    """JSON schema of a configuration model (for editors and documentation)."""
    return model.model_json_schema()


def _config_error(file: YamlFile, model: type[BaseModel], error: ValidationError) -> ConfigError:
    errors = error.errors(include_url=False)
    # Of several complaints about one value (union members), the deepest tells most; an unknown key is clearest.
    first = max(errors, key=lambda e: (e["type"] == "extra_forbidden", len(e["loc"])))
    location = first["loc"]
    key = _readable(file, location)
    keys = {".".join(map(str, _real_steps(file, e["loc"]))) for e in errors}
    more = f" ({len(keys) - 1} more problem{'s' if len(keys) > 2 else ''} in this file)" if len(keys) > 1 else ""
    if first["type"] == "extra_forbidden":
        known = list(_fields_at(model, location[:-1]))
        near = difflib.get_close_matches(str(location[-1]), known, n=1, cutoff=0.5)
        hint = f"Did you mean '{near[0]}'? " if near else ""
        return ConfigError(
            file.place(location), f"unknown key '{key}'{more}", f"{hint}Known keys here: {', '.join(known)}."
        )
    if first["type"] == "missing":
        return ConfigError(file.place(location[:-1]), f"key '{key}' is missing{more}", f"Add '{location[-1]}: ...'.")
    try:
        found = repr(first.get("input"))
    except (ValueError, RecursionError):
        found = f"a {type(first.get('input')).__name__}"
    found = found if len(found) <= 60 else found[:57] + "..."
    message = first["msg"].removeprefix("Value error, ")
    return ConfigError(
        file.place(location), f"'{key}' is {found}: {message[0].lower()}{message[1:]}{more}", "Correct the value."
    )


def _real_steps(file: YamlFile, location: Location) -> list[str | int]:
    """The location without pydantic's tags for union members; a missing last key is kept."""
    node, steps = file.root, []
    for position, step in enumerate(location):
        if isinstance(node, yaml.MappingNode):
            match = [value for key, value in node.value if key.value == str(step)]
            if match:
                node = match[0]
                steps.append(step)
            elif position == len(location) - 1:
                steps.append(step)
        elif isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
            node = node.value[step]
            steps.append(step)
    return steps


def _readable(file: YamlFile, location: Location) -> str:
    text = ""
    for step in _real_steps(file, location):
        text += f"[{step + 1}]" if isinstance(step, int) else f".{step}"
    return text.lstrip(".") or "the file"


def _fields_at(model: type[BaseModel], location: Location) -> Iterator[str]:
    """Names of the keys allowed at `location` inside `model`."""
    models = [model]
    for step in location:
        inner = [m for owner in models if step in owner.model_fields for m in _models_in(owner, str(step))]
        models = inner or models
    for owner in models:
        yield from owner.model_fields


def _models_in(owner: type[BaseModel], name: str) -> list[type[BaseModel]]:
    found: list[type[BaseModel]] = []

    def walk(annotation: Any) -> None:
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            found.append(annotation)
        for part in typing.get_args(annotation):
            walk(part)

    walk(owner.model_fields[name].annotation)
    return found
