"""What a diagnosis found: where the gap lies, which effect explains it, and how far it then shrinks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from linid.identification.result import Estimate

Array = NDArray[np.float64]
Status = Literal["none", "identified", "ambiguous", "unknown"]
MEASURES = ("free_run", "ahead", "force")


@dataclass(frozen=True)
class Share:
    """How much of the residual force a coordinate explains.

    share: of the residual's variance, cross-validated, 0 to 1; p_value: against residuals permuted in blocks of time;
    x: (b,) bin centres and mean, spread: (b,) mean residual force in N and its standard error; unit: of x.
    """

    coordinate: str
    label: str
    unit: str
    share: float
    p_value: float
    x: Array
    mean: Array
    spread: Array


@dataclass(frozen=True)
class Change:
    """One gap measure before and after, beside its floor; low, high: 95 % interval of `after` for a new recording
    of the same kind (over several recordings: of their mean).

    free_run: NRMSE (1); ahead: m (rotary: rad); force: N (rotary: N m).
    """

    before: float
    after: float
    floor: float
    low: float = float("nan")
    high: float = float("nan")


@dataclass(frozen=True)
class Candidate:
    """One effect (or several together) tried as the cause of the gap.

    explained: share of the fitted recordings' residual that a regression on the effect takes away (screening);
    closure: share of the held-out excess over the floor that goes away when base and effect are fitted together, with
    its 95 % block-bootstrap interval (nan where the effect was only screened); parameters: of the effect, SI.
    """

    effects: tuple[str, ...]
    explained: float
    closure: float = float("nan")
    low: float = float("nan")
    high: float = float("nan")
    held_out: dict[str, Change] = field(default_factory=dict)
    parameters: tuple[Estimate, ...] = ()
    note: str = ""

    @property
    def name(self) -> str:
        """The effects' names in one word."""
        return " + ".join(self.effects)


@dataclass(frozen=True)
class Verdict:
    """status: none (at the floor), identified, ambiguous (a group that these data cannot tell apart), unknown.

    effects: named as cause, in order of importance; equivalent: the rivals that explain as much; sentence: for people;
    next_experiment: the recording to make next, with the reason.
    """

    status: Status
    effects: tuple[str, ...]
    equivalent: tuple[str, ...]
    sentence: str
    next_experiment: str


@dataclass(frozen=True)
class ResidualTrace:
    """Residual force of one recording along the measured motion, (n,) SI arrays on its own clock.

    before, after: measured minus modelled force in N; deviation: standard deviation that encoder and current noise
    alone give it.
    """

    recording: str
    kind: str
    split: str
    t: Array
    y: Array
    v: Array
    before: Array
    after: Array
    deviation: float


@dataclass(frozen=True)
class RecordingChange:
    """The gap measures of one recording before and after."""

    recording: str
    kind: str
    split: str
    changes: dict[str, Change]


@dataclass(frozen=True)
class Diagnosis:
    """All that a diagnosis of one campaign found.

    model: base motor model; base_effects: already in the base; assumptions: what was taken for granted; ceiling:
    largest share of the held-out excess that any smooth function of the coordinates could explain (cross-validated);
    excess: held-out mean square of the residual acceleration over its floor, before and after; field_wavenumber:
    rad/m or None.
    """

    name: str
    model: str
    axis: str
    base_effects: tuple[str, ...]
    assumptions: tuple[str, ...]
    verdict: Verdict
    candidates: tuple[Candidate, ...]
    where: tuple[Share, ...]
    ceiling: float
    ceiling_coordinates: str
    excess_before: float
    excess_after: float
    floor: float
    recordings: tuple[RecordingChange, ...]
    traces: tuple[ResidualTrace, ...]
    field_wavenumber: float | None
    seed: int
    warnings: tuple[str, ...] = ()
