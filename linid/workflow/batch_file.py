"""The batch file: several jobs in one YAML, checked before anything runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from linid.config import YamlFile, validate_yaml
from linid.errors import ConfigError
from linid.workflow.settings import Settings, make_settings, resolve_channels

Model = Literal["sine", "theta", "force"]
NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"


class Job(BaseModel):
    """What every job has. name: also its folder; after: jobs that must be done before."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(pattern=NAME)
    after: tuple[str, ...] = ()


class FitFrictionJob(Job):
    """linid fit-friction."""

    command: Literal["fit-friction"]
    files: tuple[str, ...] = Field(min_length=1)
    settings: Settings = Field(default_factory=lambda: Settings())


class FitMotorJob(Job):
    """linid fit-motor; several models make one job each, called NAME_MODEL."""

    command: Literal["fit-motor"]
    files: tuple[str, ...] = Field(min_length=1)
    model: Model | tuple[Model, ...]
    friction: str | None = Field(default=None, description="name of a job, or a parameters.json")
    settings: Settings = Field(default_factory=lambda: Settings())


class ValidateJob(Job):
    """linid validate."""

    command: Literal["validate"]
    files: tuple[str, ...] = Field(min_length=1)
    model: str = Field(description="name of a fitting job, or a parameters.json")
    split: Literal["auto", "held_out", "fit", "all"] = "auto"
    settings: Settings = Field(default_factory=lambda: Settings())


class GenerateJob(Job):
    """linid generate; its campaign is CAMPAIGN.yaml in the job's folder: `files: [job:NAME]` in other jobs."""

    command: Literal["generate"]
    axis: str
    seed: int = Field(default=1, ge=0)
    layout: Literal["generic", "twincat", "elmo", "controldesk"] = "generic"
    decimal_mark: Literal[".", ","] = "."
    only: tuple[str, ...] = ()


AnyJob = Annotated[FitFrictionJob | FitMotorJob | ValidateJob | GenerateJob, Field(discriminator="command")]


class BatchFile(BaseModel):
    """A batch. defaults: settings of all jobs, under each job's own; paths are relative to this file."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str | None = None
    defaults: Settings = Field(default_factory=lambda: Settings())
    jobs: tuple[AnyJob, ...] = Field(min_length=1)


@dataclass(frozen=True)
class JobSpec:
    """One job, ready to run in a process of its own. label: unique in the batch, also its folder.

    files, model, friction: paths, or `job:LABEL` for what another job makes; after: labels.
    """

    label: str
    command: str
    files: tuple[str, ...]
    settings: Settings
    model: str = ""
    friction: str | None = None
    split: str = "auto"
    after: tuple[str, ...] = ()
    generate: dict[str, Any] = field(default_factory=dict)


def read_batch(path: Path, overrides: dict[str, Any], *, prefix: str = "") -> tuple[JobSpec, ...]:
    """The jobs of a batch file; overrides: raw settings that stand above all others; prefix: of the labels.

    Raises ConfigError with the line for anything wrong in the file, for missing files and circles.
    """
    file = YamlFile(path)
    _resolve_mappings(file.data, path.parent)
    batch = validate_yaml(file, BatchFile)
    defaults = batch.defaults.model_dump(exclude_unset=True)
    specs: list[JobSpec] = []
    for index, job in enumerate(batch.jobs):
        _Reader(file, batch, index, prefix).check(job)
        specs += _specs(job, path.parent, defaults, overrides, prefix, batch)
    labels = [spec.label for spec in specs]
    for index, spec in enumerate(specs):
        if spec.label in labels[:index]:
            raise ConfigError(str(path), f"two jobs are called '{spec.label}'", "Give each job its own name.")
    return _ordered(specs, path)


def _resolve_mappings(data: Any, folder: Path) -> None:
    if not isinstance(data, dict):
        return
    resolve_channels(data.get("defaults"), folder)
    jobs = data.get("jobs")
    for job in jobs if isinstance(jobs, list) else []:
        if isinstance(job, dict):
            resolve_channels(job.get("settings"), folder)


def _motor_labels(job: FitMotorJob) -> list[tuple[str, Model]]:
    if isinstance(job.model, str):
        return [(job.name, job.model)]
    return [(f"{job.name}_{model}", model) for model in job.model]


def _all_labels(batch: BatchFile) -> dict[str, str]:
    """Label -> command of every job."""
    found: dict[str, str] = {}
    for job in batch.jobs:
        for label in [label for label, _ in _motor_labels(job)] if isinstance(job, FitMotorJob) else [job.name]:
            found[label] = job.command
    return found


@dataclass(frozen=True)
class _Reader:
    """Checks of one job that need the file's lines and the other jobs."""

    file: YamlFile
    batch: BatchFile
    index: int
    prefix: str

    def check(self, job: Job) -> None:
        labels = _all_labels(self.batch)
        for name in job.after:
            self._known(name, labels, "after")
        if isinstance(job, GenerateJob):
            self._exists(job.axis, ("axis",))
            return
        assert isinstance(job, FitFrictionJob | FitMotorJob | ValidateJob)
        for number, text in enumerate(job.files):
            if text.startswith("job:"):
                self._known(text[4:], labels, "files")
                self._makes(text[4:], labels, ("generate",), "files")
            else:
                self._exists(text, ("files", number))
        if isinstance(job, ValidateJob):
            self._model(job.model, labels, "model")
        if isinstance(job, FitMotorJob) and job.friction is not None:
            self._model(job.friction, labels, "friction")

    def _model(self, text: str, labels: dict[str, str], key: str) -> None:
        """A job's name or a MODEL file."""
        if text in labels:
            self._makes(text, labels, ("fit-friction", "fit-motor"), key)
        elif re.search(r"[/\\]|\.json$", text):
            self._exists(text, (key,))
        else:
            self._known(text, labels, key)

    def _makes(self, name: str, labels: dict[str, str], commands: tuple[str, ...], key: str) -> None:
        if labels[name] not in commands:
            raise ConfigError(
                self._place((key,)),
                f"job '{name}' is a {labels[name]} job",
                f"'{key}' needs the result of a {' or '.join(commands)} job.",
            )

    def _known(self, name: str, labels: dict[str, str], key: str) -> None:
        if name not in labels:
            import difflib

            near = difflib.get_close_matches(name, list(labels), n=1, cutoff=0.5)
            hint = f"Did you mean '{near[0]}'? " if near else ""
            raise ConfigError(
                self._place((key,)), f"there is no job '{name}'", f"{hint}Jobs here: {', '.join(labels)}."
            )

    def _exists(self, text: str, location: tuple[str | int, ...]) -> None:
        folder = self.file.path.parent
        if not (folder / text).exists():
            raise ConfigError(
                self._place(location),
                f"file '{text}' not found",
                f"Put it there or correct the path; paths are relative to {folder.resolve()}.",
            )

    def _place(self, location: tuple[str | int, ...]) -> str:
        return self.file.place(("jobs", self.index, *location))


def _specs(
    job: Job, folder: Path, defaults: dict[str, Any], overrides: dict[str, Any], prefix: str, batch: BatchFile
) -> list[JobSpec]:
    after = tuple(prefix + name for name in job.after)
    if isinstance(job, GenerateJob):
        options = job.model_dump(include={"seed", "layout", "decimal_mark", "only"})
        return [
            JobSpec(
                prefix + job.name, job.command, (str(folder / job.axis),), Settings(), after=after, generate=options
            )
        ]
    assert isinstance(job, FitFrictionJob | FitMotorJob | ValidateJob)
    settings = make_settings(defaults, job.settings.model_dump(exclude_unset=True), overrides)
    labels = _all_labels(batch)

    def place(text: str) -> str:
        if text.startswith("job:"):
            return f"job:{prefix}{text[4:]}"
        return f"job:{prefix}{text}" if text in labels else str(folder / text)

    files = tuple(place(text) if text.startswith("job:") else str(folder / text) for text in job.files)
    if isinstance(job, FitMotorJob):
        friction = None if job.friction is None else place(job.friction)
        return [
            _with_dependencies(JobSpec(prefix + label, job.command, files, settings, model, friction, after=after))
            for label, model in _motor_labels(job)
        ]
    model = place(job.model) if isinstance(job, ValidateJob) else ""
    split = job.split if isinstance(job, ValidateJob) else "auto"
    return [
        _with_dependencies(JobSpec(prefix + job.name, job.command, files, settings, model, split=split, after=after))
    ]


def _with_dependencies(spec: JobSpec) -> JobSpec:
    from dataclasses import replace

    used = [text[4:] for text in (*spec.files, spec.model, spec.friction or "") if text.startswith("job:")]
    return replace(spec, after=tuple(dict.fromkeys([*spec.after, *used])))


def _ordered(specs: Sequence[JobSpec], path: Path) -> tuple[JobSpec, ...]:
    """The jobs as written; raises ConfigError when some wait for each other in a circle."""
    done: set[str] = set()
    waiting = list(specs)
    while waiting:
        ready = [spec for spec in waiting if set(spec.after) <= done]
        if not ready:
            names = ", ".join(spec.label for spec in waiting)
            raise ConfigError(str(path), f"these jobs wait for each other: {names}", "Remove the circle.")
        done |= {spec.label for spec in ready}
        waiting = [spec for spec in waiting if spec.label not in done]
    return tuple(specs)
