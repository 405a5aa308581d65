"""Settings: everything that decides a result apart from the files, the model and the start, as keys with defaults."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    WithJsonSchema,
    model_validator,
)

from linid.errors import ConfigError
from linid.former_names import present_name, with_present_keys
from linid.identification.settings import HORIZON, Ending, SearchSettings
from linid.physics.laws.names import LAW_CHOICES
from linid.physics.own_terms.own_term import is_own, own_text, parse_term
from linid.recording.mapping import ChannelMapping
from linid.recording.recording import Axis, Kind

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Rate = Annotated[float, Field(ge=0, le=1)]


def _masses(value: Any) -> Any:
    """One number means: the same for every file."""
    return {"*": value} if isinstance(value, int | float) and not isinstance(value, bool) else value


Masses = Annotated[dict[str, Annotated[float, Field(ge=0, allow_inf_nan=False)]], BeforeValidator(_masses)]


def _effect_names(value: Any) -> Any:
    """Names of effects from a list of names, a mapping of own terms, or a list that holds both."""
    if isinstance(value, str) and not is_own(value):
        return value
    out: list[Any] = []
    try:
        for one in value if isinstance(value, list | tuple) else [value]:
            texts = [own_text(str(k), v) for k, v in one.items()] if isinstance(one, Mapping) else [one]
            out += [parse_term(x).text if isinstance(x, str) and is_own(x) else x for x in texts]
    except ConfigError as error:
        raise ValueError(str(error)) from None
    return tuple(out)


def _law_choice(name: str) -> str:
    if name not in LAW_CHOICES:
        raise ValueError(f"there is no such friction law; known: {', '.join(LAW_CHOICES)}")
    return name


def _how_many(value: Any) -> Any:
    """Yes and no, as settings files said it before there was a choice."""
    return ("few" if value else "none") if isinstance(value, bool) else value


HowMany = Annotated[
    Literal["few", "all", "none"],
    BeforeValidator(_how_many),
    WithJsonSchema({"enum": ["few", "all", "none", True, False]}),
]
LawChoice = Annotated[str, AfterValidator(_law_choice), WithJsonSchema({"type": "string", "enum": list(LAW_CHOICES)})]
_OWN_SCHEMA = {"type": "object", "description": "own terms, NAME: formula"}
Effects = Annotated[
    tuple[str, ...],
    BeforeValidator(_effect_names),
    WithJsonSchema({"anyOf": [{"type": "array", "items": {"anyOf": [{"type": "string"}, _OWN_SCHEMA]}}, _OWN_SCHEMA]}),
]


def _present(data: Any) -> Any:
    """Raw keys of settings, and the parameters that they name, as they are called today."""
    data = with_present_keys(data)
    if isinstance(data, dict):
        data |= {key: with_present_keys(data[key]) for key in ("known", "bounds") if key in data}
        if isinstance(data.get("profiles"), list | tuple):
            data["profiles"] = [present_name(name) for name in data["profiles"]]
    return data


class Settings(BaseModel):
    """Everything that decides a result apart from the files, the model and the start."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    _names = model_validator(mode="before")(_present)

    # The recordings.
    axis: Axis | None = Field(
        default=None, description="linear (m, N, kg) or rotary (rad, N m, kg m^2); default: the campaign's"
    )
    channels: ChannelMapping | None = Field(
        default=None, description="column mapping for bare files: inline, or a YAML file"
    )
    kind: Kind | None = Field(default=None, description="kind of bare files; default: free_wheel if no current flows")
    window: tuple[Finite, Finite] | None = Field(default=None, description="[t0, t1] in s, for bare files")
    period: Positive | None = Field(
        default=None, description="sampling period in s of bare files without a time column"
    )
    added_mass: Masses = Field(
        default_factory=dict, description="known added mass of bare files in kg: one number, or file name: number"
    )
    find_coast_down: bool = Field(default=True, description="cut manual pushes from free wheels that have no window")
    # The model.
    effects: Effects = Field(
        default=(), description="effects to identify together with the model: names, and own terms as NAME: formula"
    )
    without: tuple[str, ...] = Field(
        default=(), description="effects of the library that a diagnosis leaves out of consideration"
    )
    mass: Positive | None = Field(default=None, description="known moving mass in kg (rotary: kg m^2)")
    known: dict[str, Finite] = Field(default_factory=dict, description="parameter: SI value that is not identified")
    bounds: dict[str, tuple[Finite, Finite]] = Field(default_factory=dict, description="parameter: [low, high] in SI")
    proportions: dict[str, Finite] = Field(
        default_factory=dict,
        description="coefficient of an own term: SI value; those of a term keep their ratios, one size is identified",
    )
    free_exponent: bool = Field(default=False, description="identify the Stribeck exponent alpha too")
    stribeck: bool = Field(default=True, description="false: F_S is tied to F_C, Coulomb and viscous friction only")
    law: LawChoice | None = Field(
        default=None,
        description="friction law; auto: the one that the recordings prefer; default: of the start, else lugre",
    )
    # The search.
    objective: Literal["auto", "free_run", "ahead", "acceleration"] = Field(
        default="auto", description="auto: free_run for free wheels, ahead for driven recordings"
    )
    horizon: Positive = Field(default=HORIZON, description="how far `ahead` looks, in s")
    method: Literal["genetic", "cma", "plain", "scratch"] = Field(
        default="genetic",
        description="genetic algorithm, CMA-ES, a genetic algorithm from random candidates, or these in stages",
    )
    verify_search: bool = Field(
        default=False, description="say whether a search from random candidates finds the same minimum"
    )
    population: int = Field(
        default=SearchSettings.population, ge=8, le=100_000, description="candidates per generation"
    )
    generations: int = Field(
        default=SearchSettings.generations, ge=1, le=10**9, description="largest number of generations"
    )
    patience: int = Field(
        default=SearchSettings.patience, ge=1, le=10**9, description="generations without gain before the search stops"
    )
    tolerance: Positive = Field(
        default=SearchSettings.tolerance, description="relative gain below which a generation counts as none"
    )
    selection: Literal["tournament", "roulette"] = Field(
        default="tournament", description="genetic, plain: how parents are chosen"
    )
    tournament: int = Field(default=SearchSettings.tournament, ge=1, le=1000, description="candidates in a tournament")
    crossover: Literal["simulated_binary", "blend", "two_point", "uniform"] = Field(
        default="simulated_binary", description="genetic, plain: DEAP's operator on pairs"
    )
    crossover_rate: Rate = Field(default=SearchSettings.crossover_rate, description="share of the pairs that cross")
    mutation: Literal["polynomial", "gaussian"] = Field(
        default="polynomial", description="genetic, plain: DEAP's operator on children"
    )
    mutation_rate: Rate | None = Field(
        default=None, description="probability that a coordinate mutates; default: 1.5 over their number"
    )
    elite: int = Field(default=SearchSettings.elite, ge=0, le=7, description="best candidates that live on")
    least_squares_steps: int | None = Field(
        default=None,
        ge=0,
        le=10**6,
        description=f"largest number of steps of the local least squares, 0: none; default: {Ending.steps}, plain: 0",
    )
    substeps: int | None = Field(
        default=None, ge=1, le=1000, description="internal steps per sample; default: from the data"
    )
    profiles: tuple[str, ...] = Field(default=(), description="parameters whose profile likelihood is computed")
    seed: int = Field(default=1, ge=0, lt=2**63, description="seed of the search")
    # The output.
    figures: HowMany = Field(
        default="few", description="few: overviews and the worst recordings; all: every recording too; none"
    )
    figure_formats: tuple[Literal["png", "pdf", "svg"], ...] = Field(default=("png",), min_length=1)

    def known_values(self, campaign: Mapping[str, float]) -> dict[str, float]:
        """All known SI values; the settings' own stand above the campaign's."""
        own = dict(self.known) if self.mass is None else {**self.known, "mass": self.mass}
        return {**campaign, **own}

    def given(self) -> dict[str, Any]:
        """The keys that were given, as `make_settings` and the public functions take them."""
        return self.model_dump(exclude_unset=True)


def make_settings(*layers: Mapping[str, Any]) -> Settings:
    """Settings from layers of raw keys, later ones on top; mappings such as `known` are merged key by key.

    Raises ConfigError naming the key (files are checked before, with their lines).
    """
    merged: dict[str, Any] = {}
    for layer in layers:
        for key, value in _present_layer(layer).items():
            below = merged.get(key)
            if key == "added_mass":
                below, value = _masses(below), _masses(value)
            if isinstance(below, dict) and isinstance(value, dict) and key != "channels":
                value = {**below, **value}
            merged[key] = value
    try:
        return Settings.model_validate(merged)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = str(first["loc"][0])
        if first["type"] == "extra_forbidden":
            near = difflib.get_close_matches(key, list(Settings.model_fields), n=1, cutoff=0.5)
            hint = f"Did you mean '{near[0]}'? " if near else ""
            raise ConfigError(
                f"setting '{key}'", "there is no such key", f"{hint}Known keys: {', '.join(Settings.model_fields)}."
            ) from None
        where = ".".join(str(step) for step in first["loc"])
        raise ConfigError(f"setting '{where}'", f"found {first['input']!r}: {first['msg']}", "Correct it.") from None


def _present_layer(layer: Mapping[str, Any]) -> dict[str, Any]:
    try:
        return dict(_present(dict(layer)))
    except ValueError as error:
        raise ConfigError("settings", str(error), "Give one of them.") from None
