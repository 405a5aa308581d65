"""The batch file: several jobs in one YAML, checked before anything runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from linid.config import YamlFile, validate_yaml
from linid.errors import ConfigError
from linid.interface.settings import Settings, make_settings
from linid.physics.motors.names import driven_motors
from linid.workflow.run.model_path import model_path
from linid.workflow.run.settings import resolve_channels


def _motor_name(name: str) -> str:
    if name not in driven_motors():
        raise ValueError(f"there is no motor {name!r}; known: {', '.join(driven_motors())}")
    return name


def _base_name(name: str) -> str:
    return name if name == "friction" else _motor_name(name)


MotorModel = Annotated[str, AfterValidator(_motor_name)]
BaseModelKind = Annotated[str, AfterValidator(_base_name)]
Files = Annotated[tuple[str, ...], Field(min_length=1)]
MODEL = "name of a fitting or diagnosing job, a MODEL.json, or the folder of a fit or diagnosis"
NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"


class Job(BaseModel):
    """What every job has. name: also its folder; after: jobs that must be done before.

    CAMPAIGNS, MODELS, PATHS: keys that name recordings, a MODEL (or the fitting job that makes it), other files.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    CAMPAIGNS: ClassVar[tuple[str, ...]] = ("files",)
    MODELS: ClassVar[tuple[str, ...]] = ()
    PATHS: ClassVar[tuple[str, ...]] = ()

    name: str = Field(pattern=NAME)
    after: tuple[str, ...] = ()


class FitFrictionJob(Job):
    """linid fit-friction."""

    MODELS = ("friction",)

    command: Literal["fit-friction"]
    files: Files
    friction: str | None = Field(default=None, description=MODEL)
    settings: Settings = Field(default_factory=lambda: Settings())


class FitMotorJob(Job):
    """linid fit-motor; several models make one job each, called NAME_MODEL."""

    MODELS = ("friction",)

    command: Literal["fit-motor"]
    files: Files
    model: MotorModel | tuple[MotorModel, ...]
    friction: str | None = Field(default=None, description=MODEL)
    input: Literal["current", "voltage"] = "current"
    connection: Literal["star", "separate"] = "star"
    settings: Settings = Field(default_factory=lambda: Settings())


class ValidateJob(Job):
    """linid validate."""

    MODELS = ("model",)

    command: Literal["validate"]
    files: Files
    model: str = Field(description=MODEL)
    split: Literal["auto", "held_out", "fit", "all"] = "auto"
    settings: Settings = Field(default_factory=lambda: Settings())


class DiagnoseJob(Job):
    """linid diagnose."""

    MODELS = ("since",)

    command: Literal["diagnose"]
    files: Files
    since: str | None = Field(default=None, description=f"base as it stands: {MODEL}")
    model: BaseModelKind | None = Field(default=None, description="base model; default: what the recordings allow")
    settings: Settings = Field(default_factory=lambda: Settings())


class GenerateJob(Job):
    """linid generate; its campaign is CAMPAIGN.yaml in the job's folder: `files: [job:NAME]` in other jobs."""

    CAMPAIGNS = ()
    PATHS = ("axis",)

    command: Literal["generate"]
    axis: str
    seed: int = Field(default=1, ge=0)
    layout: Literal["generic", "twincat", "elmo", "controldesk"] = "generic"
    decimal_mark: Literal[".", ","] = "."
    only: tuple[str, ...] = ()


class FieldJob(Job):
    """linid field."""

    CAMPAIGNS = ()
    MODELS = ("model", "friction")
    PATHS = ("geometry",)

    command: Literal["field"]
    geometry: str | None = None
    k: float | None = Field(default=None, gt=0.0)
    model: str | None = Field(default=None, description=MODEL)
    friction: str | None = Field(default=None, description=MODEL)
    settings: Settings = Field(default_factory=lambda: Settings())


class ReproduceJob(Job):
    """The paper's tables and figures from fits of a stand, and its claims beside what was found.

    narrow_*: the same fits of a stand whose field a sine cannot follow; voltage_*: recordings driven by their phase
    voltages and a model that knows the windings, which may be left out.
    """

    CAMPAIGNS = ("files", "narrow_files", "voltage_files")
    MODELS = ("friction", "sine", "theta", "narrow_sine", "narrow_theta", "voltage_model")
    PATHS = ("geometry",)

    command: Literal["reproduce"]
    files: Files
    geometry: str
    friction: str = Field(description=f"{MODEL}; so are the following")
    sine: str
    theta: str
    narrow_files: Files
    narrow_sine: str
    narrow_theta: str
    voltage_files: tuple[str, ...] = ()
    voltage_model: str | None = None
    settings: Settings = Field(default_factory=lambda: Settings())

    @model_validator(mode="after")
    def _both_by_voltage(self) -> ReproduceJob:
        if bool(self.voltage_files) != (self.voltage_model is not None):
            raise ValueError("voltage_files and voltage_model belong together: give both or neither")
        return self


AnyJob = Annotated[
    FitFrictionJob | FitMotorJob | ValidateJob | DiagnoseJob | GenerateJob | FieldJob | ReproduceJob,
    Field(discriminator="command"),
]


class BatchFile(BaseModel):
    """A batch. defaults: settings of all jobs, under each job's own; paths are relative to this file."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str | None = None
    defaults: Settings = Field(default_factory=lambda: Settings())
    jobs: tuple[AnyJob, ...] = Field(min_length=1)


@dataclass(frozen=True)
class JobSpec:
    """One job, ready to run in a process of its own. label: unique in the batch, also its folder.

    campaigns, models: what stands under the keys that name them, paths or `job:LABEL` for what another job makes;
    options: the other keys, with paths resolved; paths: the options that are paths; after: labels.
    """

    label: str
    command: str
    settings: Settings
    campaigns: dict[str, tuple[str, ...]] = field(default_factory=dict)
    models: dict[str, str] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)
    paths: tuple[str, ...] = ()
    after: tuple[str, ...] = ()

    @property
    def files(self) -> tuple[str, ...]:
        """The recordings and campaigns of the job."""
        return self.campaigns.get("files", ())

    @property
    def inputs(self) -> tuple[str, ...]:
        """All files that the job reads and no other job makes."""
        named = [*(text for texts in self.campaigns.values() for text in texts), *self.models.values()]
        return tuple([text for text in named if not _is_job(text)] + [self.options[key] for key in self.paths])


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


def _motor_labels(job: FitMotorJob) -> list[tuple[str, MotorModel]]:
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
        for key in job.PATHS:
            path = getattr(job, key)
            if path is not None:
                self._exists(path, (key,))
        for key in job.CAMPAIGNS:
            for number, text in enumerate(getattr(job, key)):
                if _is_job(text):
                    self._known(text[4:], labels, key)
                    self._makes(text[4:], labels, ("generate",), key)
                else:
                    self._exists(text, (key, number))
        for key in job.MODELS:
            model = getattr(job, key)
            if model is not None:
                self._model(model, labels, key)

    def _model(self, text: str, labels: dict[str, str], key: str) -> None:
        """A job's name, a MODEL file, or a folder with one."""
        path = self.file.path.parent / text
        if text in labels:
            self._makes(text, labels, ("fit-friction", "fit-motor", "diagnose"), key)
        elif re.search(r"[/\\]|\.json$", text) or path.is_dir():
            self._exists(text, (key,))
            model_path(path, self._place((key,)))
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
    labels = _all_labels(batch)

    def campaign(text: str) -> str:
        return f"job:{prefix}{text[4:]}" if _is_job(text) else str(folder / text)

    def model(text: str) -> str:
        return f"job:{prefix}{text}" if text in labels else str(model_path(folder / text, str(folder)))

    own = job.settings.model_dump(exclude_unset=True) if hasattr(job, "settings") else None
    campaigns = {key: tuple(campaign(text) for text in getattr(job, key)) for key in job.CAMPAIGNS}
    models = {key: model(getattr(job, key)) for key in job.MODELS if getattr(job, key) is not None}
    options = job.model_dump(exclude={"name", "command", "after", "settings", *job.CAMPAIGNS, *job.MODELS})
    paths = tuple(key for key in job.PATHS if options[key] is not None)
    options |= {key: str(folder / options[key]) for key in paths}
    used = [text[4:] for text in (*(t for c in campaigns.values() for t in c), *models.values()) if _is_job(text)]
    after = tuple(dict.fromkeys([*(prefix + name for name in job.after), *used]))
    settings = Settings() if own is None else make_settings(defaults, own, overrides)
    variants = _motor_labels(job) if isinstance(job, FitMotorJob) else [(job.name, "")]
    return [
        JobSpec(
            prefix + label,
            labels[label],
            settings,
            campaigns,
            models,
            {**options, "model": kind} if kind else options,
            paths,
            after,
        )
        for label, kind in variants
    ]


def _is_job(text: str) -> bool:
    return text.startswith("job:")


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
