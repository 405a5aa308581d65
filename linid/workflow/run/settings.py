"""Settings as files and as `key=value`: what `--config FILE`, `--set`, mapping files and run folders hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from linid.config import YamlFile, parse_yaml, validate_yaml
from linid.errors import ConfigError
from linid.interface.settings import Settings
from linid.recording.mapping import ChannelMapping


def read_settings(path: Path) -> dict[str, Any]:
    """The keys of a settings file, checked; `channels:` may name a mapping file relative to it."""
    file = YamlFile(path)
    if file.data is None:
        return {}
    resolve_channels(file.data, path.parent)
    validate_yaml(file, Settings)
    return dict(file.data)


def resolve_channels(data: Any, folder: Path) -> None:
    """Replace the name of a mapping file by its content."""
    if isinstance(data, dict) and isinstance(data.get("channels"), str):
        data["channels"] = read_mapping(folder / data["channels"])


class _MappingFile(BaseModel):
    """A mapping file with the heading that `linid inspect` writes."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    channels: ChannelMapping


def read_mapping(path: Path) -> dict[str, Any]:
    """The content of a column-mapping file, with or without the heading `channels:`; raises ConfigError."""
    file = YamlFile(path)
    headed = isinstance(file.data, dict) and "channels" in file.data
    mapping = validate_yaml(file, _MappingFile).channels if headed else validate_yaml(file, ChannelMapping)
    return mapping.model_dump(exclude_unset=True)


def parse_assignment(text: str) -> dict[str, Any]:
    """`key=value` -> {key: value}, `known.mass=2` -> {known: {mass: 2}}; the value is read as YAML.

    Raises ConfigError where there is no `=`, or no YAML after it.
    """
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise ConfigError(f"--set {text}", "found no `=`", "Write --set key=value, such as --set population=48.")
    parsed: Any = parse_yaml(value, f"--set {text[:100]}")
    if isinstance(parsed, str):
        parsed = _number(parsed)
    for step in reversed(key.strip().split(".")):
        parsed = {step: parsed}
    return dict(parsed)


def _number(text: str) -> float | str:
    # YAML 1.1 takes 1e-3 for a string.
    try:
        return float(text)
    except ValueError:
        return text


def settings_yaml(settings: Settings, heading: str) -> str:
    """The resolved settings as YAML that `--config` reads back; heading: comment above them."""
    import yaml

    body = settings.model_dump(mode="json", exclude_none=True)
    if settings.channels is not None:
        body["channels"] = settings.channels.model_dump(mode="json", exclude_none=True)
    comment = "".join(f"# {line}\n" for line in heading.splitlines())
    return comment + str(yaml.safe_dump(body, sort_keys=False, allow_unicode=True))
