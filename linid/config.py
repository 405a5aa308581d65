"""YAML file -> validated pydantic model; every complaint names the file and the line."""

from __future__ import annotations

import difflib
import typing
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from linid.errors import ConfigError

Model = TypeVar("Model", bound=BaseModel)
Location = Sequence[str | int]


class YamlFile:
    """A parsed YAML file that remembers on which line each key stands."""

    def __init__(self, path: Path) -> None:
        self.path = path
        text = _read(path)
        try:
            self.root = yaml.compose(text, Loader=yaml.SafeLoader)
            self._refuse_duplicate_keys(self.root)
            self.data: Any = yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise self._syntax_error(error) from None

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

    def _refuse_duplicate_keys(self, node: yaml.Node | None) -> None:
        # PyYAML keeps the last of two equal keys without a word.
        if isinstance(node, yaml.MappingNode):
            seen: dict[str, int] = {}
            for key, value in node.value:
                line = key.start_mark.line + 1
                if isinstance(key, yaml.ScalarNode) and key.value in seen:
                    raise ConfigError(
                        f"{self.path}, line {line}",
                        f"key '{key.value}' is given twice (first in line {seen[key.value]})",
                        "Keep one of the two.",
                    )
                if isinstance(key, yaml.ScalarNode):
                    seen[key.value] = line
                self._refuse_duplicate_keys(value)
        elif isinstance(node, yaml.SequenceNode):
            for item in node.value:
                self._refuse_duplicate_keys(item)

    def _syntax_error(self, error: yaml.YAMLError) -> ConfigError:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        place = f"{self.path}, line {mark.line + 1}, column {mark.column + 1}" if mark else str(self.path)
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        return ConfigError(
            place,
            f"not valid YAML: {problem}",
            "Check indentation (spaces, no tabs), brackets, quotes and the space after each colon.",
        )


def _read(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise ConfigError(str(path), "file not found", "Check the path.") from None
    except IsADirectoryError:
        raise ConfigError(str(path), "is a folder, a YAML file is expected", "Name the file inside it.") from None
    except OSError as error:
        raise ConfigError(str(path), f"cannot be read: {error.strerror}", "Check the file's permissions.") from None
    except UnicodeDecodeError as error:
        raise ConfigError(
            str(path), f"is not UTF-8 text (byte {error.start})", "Save the file with the encoding UTF-8."
        ) from None


def load_yaml_model(path: str | Path, model: type[Model]) -> Model:
    """Read a YAML file into `model`; unknown keys, wrong types and syntax errors raise ConfigError with the line."""
    return validate_yaml(YamlFile(Path(path)), model)


def validate_yaml(file: YamlFile, model: type[Model]) -> Model:
    """Validate an already parsed YAML file (for callers that need its line numbers later)."""
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
    found = repr(first.get("input"))
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
