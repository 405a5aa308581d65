"""What an entrant hands in: one JSON file with an answer for each campaign of a suite."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    WithJsonSchema,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from linid.challenge.catalogue import LISTED
from linid.challenge.hidden_axis import LAWS, Law
from linid.challenge.outside import ARGUMENTS
from linid.config import json_text, read_json
from linid.errors import ConfigError

EXPLAINED = "The suite's README.md explains the format."
_MOST_NAMED = 5  # of names that a message lists
Number = Annotated[float, Field(allow_inf_nan=False)]


def _fault(fact: str, remedy: str) -> PydanticCustomError:
    return PydanticCustomError("fault", "{fact}", {"fact": fact, "remedy": remedy})


def _known(name: str, names: Sequence[str], what: str) -> str:
    if name in names:
        return name
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    raise _fault(f"{name!r} is no {what}", f"Did you mean {near[0]!r}?" if near else f"Known: {', '.join(names)}.")


def _listed(name: str) -> str:
    return _known(name, tuple(LISTED), "effect of the list")


def _argument(name: str) -> str:
    return _known(name, tuple(ARGUMENTS), "argument")


def _once(names: tuple[str, ...]) -> tuple[str, ...]:
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise _fault(f"{', '.join(twice)} stands there more than once", "Name each once.")
    return names


EffectName = Annotated[str, AfterValidator(_listed), WithJsonSchema({"type": "string", "enum": list(LISTED)})]
ArgumentName = Annotated[str, AfterValidator(_argument), WithJsonSchema({"type": "string", "enum": list(ARGUMENTS)})]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class StatedShare(_Strict):
    """A share of the gap, with its 95 % interval from low to high where there is one."""

    share: Number = Field(description="share of the gap, 1 is all of it")
    low: Number | None = Field(default=None, description="lower end of its 95 % interval")
    high: Number | None = Field(default=None, description="upper end of its 95 % interval")

    @model_validator(mode="after")
    def _ordered(self) -> StatedShare:
        if (self.low is None) != (self.high is None):
            raise _fault("has one end of an interval only", "Give both low and high, or neither.")
        if self.low is not None and self.high is not None and self.low > self.high:
            raise _fault(f"low {self.low:g} lies above high {self.high:g}", "Exchange the two.")
        return self


class CampaignAnswer(_Strict):
    """What an entrant says of one campaign; all left out: nothing is hidden in it."""

    effects: Annotated[tuple[EffectName, ...], AfterValidator(_once)] = Field(
        default=(), description="hidden effects, the largest first"
    )
    shares: dict[EffectName, StatedShare] = Field(default_factory=dict, description="share of the gap of named effects")
    unknown: bool = Field(default=False, description="whether a cause that is not on the list is at work")
    arguments: Annotated[tuple[ArgumentName, ...], AfterValidator(_once)] = Field(
        default=(), description="what the unlisted cause depends on"
    )
    law: Law | None = Field(default=None, description="friction law of the axis")

    @field_validator("law", mode="before")
    @classmethod
    def _known_law(cls, law: Any) -> Any:
        return _known(law, LAWS, "friction law") if isinstance(law, str) else law

    @model_validator(mode="after")
    def _consistent(self) -> CampaignAnswer:
        stray = [name for name in self.shares if name not in self.effects]
        if stray:
            raise _fault(f"shares of {', '.join(stray)}, which effects does not name", "Name them there, too.")
        if self.arguments and not self.unknown:
            raise _fault("arguments of an unlisted cause, but unknown is false", "Set unknown to true.")
        return self


class Submission(_Strict):
    """Answers to a suite. suite: its version; entrant: who answers; answers: by campaign."""

    suite: str = Field(description="version of the suite, from suite.json")
    entrant: Annotated[str, Field(min_length=1, max_length=200)] = Field(description="who answers")
    answers: dict[str, CampaignAnswer] = Field(description="answers by name of the campaign")


def read_submission(path: Path) -> Submission:
    """A submission from its file; raises ConfigError naming the place in it."""
    return parse_submission(read_json(path, f"Write a JSON object. {EXPLAINED}"), str(path))


def parse_submission(data: Any, place: str) -> Submission:
    """A submission from plain data; place: where it comes from. Raises ConfigError naming the place in it."""
    if not isinstance(data, dict):
        raise ConfigError(place, f"holds a {type(data).__name__}, not an object", EXPLAINED)
    try:
        return Submission.model_validate(data)
    except ValidationError as error:
        raise _config_error(place, error) from None


def _config_error(place: str, error: ValidationError) -> ConfigError:
    every = error.errors(include_url=False)
    first = every[0]
    steps = [step for step in first["loc"] if step != "[key]"]
    where = "".join(f"[{step + 1}]" if isinstance(step, int) else f".{step}" for step in steps).lstrip(".")
    more = f" ({len(every) - 1} more fault{'s' if len(every) > 2 else ''})" if len(every) > 1 else ""
    message = first["msg"]
    fact, remedy = message[0].lower() + message[1:], "Correct the value."
    if first["type"] == "fault":
        fact, remedy = message, str(first["ctx"]["remedy"])
    elif first["type"] == "extra_forbidden":
        fact, remedy = "is a key that does not belong here", f"Remove it. {EXPLAINED}"
    elif first["type"] == "missing":
        fact, remedy = "is missing", f"Add it. {EXPLAINED}"
    return ConfigError(f"{place}, {where}" if where else place, fact + more, remedy)


def check_campaigns(submission: Submission, suite: str, campaigns: Collection[str], place: str) -> tuple[str, ...]:
    """Campaigns of a suite that a submission leaves out, in order.

    place: where it comes from. Raises ConfigError for answers to another suite, or to campaigns that it has not.
    """
    if submission.suite != suite:
        raise ConfigError(
            f"{place}, suite", f"answers the suite {submission.suite!r}, these keys are of {suite!r}", "Take its keys."
        )
    odd = [name for name in submission.answers if name not in campaigns]
    if odd:
        near = difflib.get_close_matches(odd[0], list(campaigns), n=1, cutoff=0.6)
        hint = f"Did you mean {near[0]!r}? " if near and near[0] not in submission.answers else ""
        raise ConfigError(
            f"{place}, answers", f"the suite has no campaign {some_of(odd)}", f"{hint}suite.json lists the campaigns."
        )
    return tuple(name for name in campaigns if name not in submission.answers)


def some_of(names: Sequence[str]) -> str:
    """The first few names, and how many more there are."""
    rest = len(names) - _MOST_NAMED
    return ", ".join(names[:_MOST_NAMED]) + (f" and {rest} more" if rest > 0 else "")


def submission_schema(suite: str, campaigns: Sequence[str]) -> dict[str, Any]:
    """JSON schema of the submissions to a suite with these campaigns."""
    schema = Submission.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["properties"]["suite"]["const"] = suite
    schema["properties"]["answers"]["propertyNames"] = {"enum": list(campaigns)}
    return schema


def submission_text(suite: str, entrant: str, answers: Mapping[str, CampaignAnswer]) -> str:
    """A submission as JSON text, campaigns in order of their names."""
    body = {
        "suite": suite,
        "entrant": entrant,
        "answers": {name: answers[name].model_dump(exclude_defaults=True) for name in sorted(answers)},
    }
    return json_text(body)
