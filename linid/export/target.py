"""What a target of `linid export` is: files from a model, and the model that its form really holds."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from linid.errors import ConfigError
from linid.identification.result import Estimate, FitResult

if TYPE_CHECKING:
    from linid.arrays import Array
    from linid.physics.model import Model
    from linid.recording.recording import Recording

DEFAULT_STEP = 1.25e-4  # s, where no recording tells the step that the model was identified with
_NO_WORD = re.compile(r"[^A-Za-z0-9_]+")


@dataclass(frozen=True, eq=False)  # each one is itself: what is worked out for it can be kept
class Exported:
    """A model on its way to a target.

    result: the MODEL in SI; name: a word for files and types; step: internal step in s, of which a stiff bristle takes
    less by itself; recordings: those that were given with it, from which a simpler form may take what matters (speeds,
    positions), () where none were; options: of single targets by name, as text.
    """

    result: FitResult
    name: str
    step: float = DEFAULT_STEP
    recordings: tuple[Recording, ...] = ()
    options: Mapping[str, str] = field(default_factory=dict)

    @property
    def model(self) -> Model:
        """Which motor, effects and friction law act."""
        from linid.physics.model import Model

        return Model(self.result.model, self.result.effects, law=self.result.law)

    @property
    def values(self) -> dict[str, float]:
        """Parameters in SI by name."""
        return {e.name: e.value for e in self.result.estimates}

    @property
    def vector(self) -> Array:
        """The flat vector (size,) in SI of the parameters, as the simulation takes it."""
        return self.model.vector(self.values)


def step_of(result: FitResult, recordings: Sequence[Recording]) -> float:
    """The internal step in s with which a model was identified on recordings; the usual one without any."""
    if not recordings:
        return DEFAULT_STEP
    return min(r.duration / (r.t.size - 1) for r in recordings) / result.substeps


def unchanged(exported: Exported) -> FitResult:
    """The model itself: of a target that holds all of it."""
    return exported.result


def nothing(exported: Exported) -> tuple[str, ...]:
    """What a target lacks that holds the whole model."""
    return ()


@dataclass(frozen=True)
class Target:
    """One form that a model can be exported to.

    name: as in `--to`; purpose: one sentence; files(exported) -> content by file name, relative to the target's folder;
    raises UsageError for a model that it cannot be made of. simplified(exported) -> the MODEL that the target's form
    equals, whose gap is measured on held-out recordings; lacks(exported) -> what the form cannot hold, a sentence each;
    extra: of linid with the libraries that it needs, empty where none.
    """

    name: str
    purpose: str
    files: Callable[[Exported], dict[str, bytes]]
    simplified: Callable[[Exported], FitResult] = unchanged
    lacks: Callable[[Exported], tuple[str, ...]] = nothing
    extra: str = ""

    @property
    def whole(self) -> bool:
        """Whether it holds every model whole."""
        return self.simplified is unchanged


def check_target(target: Any, place: str) -> Target:
    """The target itself if it is well formed; raises ConfigError that names what is not."""
    remedy = "Correct the target's file (see linid/export/target.py), or uninstall its package"
    if not isinstance(target, Target):
        raise ConfigError(place, f"found {type(target).__name__}, a Target is expected", remedy)
    if not re.fullmatch(r"[a-z][a-z0-9_]*", target.name):
        raise ConfigError(place, f"its name {target.name!r} is no word of small letters and digits", remedy)
    if not target.purpose:
        raise ConfigError(f"{place}, target {target.name!r}", "it does not say its purpose", remedy)
    return target


def word_of(text: str) -> str:
    """A text as a name that every language takes, such as `motor_7` of `motor 7`."""
    word = _NO_WORD.sub("_", text).strip("_") or "axis"
    return word if word[0].isalpha() else f"axis_{word}"


def reshaped(
    result: FitResult,
    *,
    effects: tuple[str, ...] | None = None,
    law: str | None = None,
    values: Mapping[str, float] | None = None,
) -> FitResult:
    """A MODEL of a simpler form: with these effects and this friction law (None: its own).

    values: SI by parameter name, in place of its own. What it does not have yet takes its default. Intervals and all
    that tells of the fit stay out, for no fit found this model.
    """
    from linid.physics.model import Model

    model = Model(
        result.model, result.effects if effects is None else effects, result.winding, result.law if law is None else law
    )
    known = {e.name: e.value for e in result.estimates} | dict(values or {})
    estimates = tuple(
        Estimate(p.name, p.symbol, p.unit, known.get(p.name, p.default), *(float("nan"),) * 3, "fixed")
        for p in model.parameters
    )
    nothing_known = np.zeros((0, 0))
    return replace(
        result,
        effects=model.effects,
        law=model.law,
        estimates=estimates,
        fitted=(),
        correlation=nothing_known,
        covariance=nothing_known,
    )
