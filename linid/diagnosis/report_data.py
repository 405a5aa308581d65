"""What a diagnosis found: where the gap lies, which effect explains it, and how far it then shrinks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from linid.arrays import Array, Integers
from linid.diagnosis.compensation_data import Compensation
from linid.identification.result import Estimate
from linid.recording.check_findings import RecordingChecks

Status = Literal["none", "explained", "partly explained", "unknown"]
Form = Literal["table", "proportional"]
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
class PairShare:
    """How much of the residual force only a pair of coordinates explains, beyond any sum of the two by themselves.

    share: of the residual's variance, cross-validated, 0 to 1; p_value: against residuals rolled in time, for the best
    of all pairs tried; form: a table of both, or for each x another slope in y ("proportional"), whatever says more;
    x_edges (a + 1,), y_edges (b + 1,): of the table's cells in their units; mean: (b, a) residual force in N (rotary:
    N m), nan where too few rows; rows: (b, a) in each cell.
    """

    x_coordinate: str
    y_coordinate: str
    x_label: str
    y_label: str
    x_unit: str
    y_unit: str
    form: Form
    share: float
    p_value: float
    x_edges: Array
    y_edges: Array
    mean: Array
    rows: Integers


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
class Entry:
    """One line of the budget: an effect with evidence.

    rivals: effects that would do as well, which these recordings cannot tell from it; share: of the gap that it
    causes, whatever the order in which effects are added (Shapley's mean over all orders), with its 95 % interval;
    first_in: share closed by it alone; last_in: share that comes back when it alone is taken out (nan: to first order
    in the others' parameters, as these two are, it cannot be told); certainty: of the
    held-out gain, in standard deviations; parameters: of the effect, SI; combinations: lines on what is known of
    parameters that are not known one by one; measures: the three measures over the held-out recordings without it
    (`before`: all other effects in) and with it.
    """

    effect: str
    rivals: tuple[str, ...]
    share: float
    low: float
    high: float
    first_in: float
    last_in: float
    certainty: float
    parameters: tuple[Estimate, ...] = ()
    combinations: tuple[str, ...] = ()
    measures: dict[str, Change] = field(default_factory=dict)
    note: str = ""

    @property
    def worsens(self) -> tuple[str, ...]:
        """Measures that are worse with it than without, by more than noise alone makes of them: a free run that comes
        to rest elsewhere each time it is measured anew says nothing."""
        return tuple(
            name
            for name, change in self.measures.items()
            if change.after - change.before > float(np.fmax(change.floor, 0.0))
        )


@dataclass(frozen=True)
class Budget:
    """The gap and its causes.

    The gap is the mean square of the force that the base model misses along the measured motion, above its floor, over
    the held-out rows and the recordings that single-recording effects act in; all shares are shares of it. before,
    after, floor: RMS in N (rotary: N m) over these rows; excess_before, excess_after: the gap and what is left of it in
    mean squares of the noise; level_before, level_after: the same as mean logarithm over pieces of time, which a few
    stops do not decide; closed: share that the entries close together, unexplained: the rest, each with a 95 %
    interval; ceiling: share of the rest that smooth functions of pairs of coordinates reach; depends_on: coordinates,
    the strongest first, that the rest depends on.
    """

    before: float
    after: float
    floor: float
    excess_before: float
    excess_after: float
    closed: float
    closed_low: float
    closed_high: float
    unexplained: float
    unexplained_low: float
    unexplained_high: float
    entries: tuple[Entry, ...]
    ceiling: float
    depends_on: tuple[str, ...]
    level_before: float = math.inf
    level_after: float = math.inf


@dataclass(frozen=True)
class Tried:
    """An effect of the library on these recordings. explained: share of the base's log power over the floor that a
    regression on it alone takes from the fitted recordings; outcome: named, rival, dropped (joined the model, but
    failed on held-out recordings) or screened; certainty, closed: on held-out rows, where it was tested."""

    effect: str
    explained: float
    outcome: Literal["named", "rival", "dropped", "screened"]
    certainty: float = float("nan")
    closed: float = float("nan")


@dataclass(frozen=True)
class LawFinding:
    """What the recordings tell of the friction law.

    law: the one that they prefer; base: the one that the models have; told: whether all others are refuted; alike: laws
    that are not told from it; closed: share of LuGre's gap (mean square above the floor, held-out recordings) that the
    law closes; before, after: that gap under LuGre and under the law, in mean squares of the noise; parameters: SI
    values of those that LuGre has not; gains: per law (log power per held-out row over LuGre, its certainty in standard
    deviations); sentence: for people.
    """

    law: str
    base: str
    told: bool
    alike: tuple[str, ...]
    closed: float
    before: float
    after: float
    parameters: dict[str, float]
    gains: dict[str, tuple[float, float]]
    sentence: str


@dataclass(frozen=True)
class TermAxis:
    """What one side of a proposed term's curve is drawn over.

    argument: position, velocity, direction, motor_force, acceleration, travel, since_reversal, rest_time, time,
    campaign_time or recording; label: for people; unit: SI; x: (n,) places, in that unit.
    """

    argument: str
    label: str
    unit: str
    x: Array


@dataclass(frozen=True)
class TermCurve:
    """A proposed term over the data's support.

    axes: one or two; factor: what the shown values are multiplied by: "" (they are the force itself), direction (they
    are a level of friction, positive where it resists more), motor_force or velocity; unit: of the shown values, SI;
    value, low, high: (n,) of one axis, or (n_2, n_1) of two, with a 95 % band; nan where there are no data. What the
    model's own parameters can do is not in them, such as a mean friction or a mean force constant.
    """

    axes: tuple[TermAxis, ...]
    factor: str
    unit: str
    value: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class ShortFormula:
    """A formula with few numbers that predicts held-out rows as well as the curve.

    text: with numbers, for people; closed: share of the excess that it closes on held-out rows; numbers: how many are
    fitted; effect: formula of an own term whose amplitudes c_1, c_2 ... are to be fitted, empty where none can be
    written.
    """

    text: str
    closed: float
    numbers: int
    effect: str = ""


@dataclass(frozen=True)
class Resemblance:
    """A known effect that a proposed term is like: alike: share of the term's variance that the effect reproduces;
    difference: how the two differ, for people."""

    effect: str
    alike: float
    difference: str


@dataclass(frozen=True)
class ProposedTerm:
    """A term for what no effect of the library explains.

    arguments: names of all that it depends on (as in TermAxis), the main one first; not_on: labels of what it does
    not depend on beyond chance, though it was tried; closed, low, high: share of what the budget leaves that the term
    closes on held-out rows, with a 95 % interval; p_value: against rolled residuals; curve: None where it has
    coefficients per recording; short: None where no short formula is as good; resembles: known effects, the likest
    first; refines: named effects that depend on the same, of whose form it may well be a part; effect: the term as an
    effect of the model (a user's own term), empty where no simulation can have it;
    kept: whether the models after have it: with it no held-out recording is predicted worse, chance apart; measures:
    the three measures over the held-out recordings without it (`before`) and with it, empty where it was not simulated;
    sentence, next_experiment: for people.
    """

    arguments: tuple[str, ...]
    not_on: tuple[str, ...]
    closed: float
    low: float
    high: float
    p_value: float
    curve: TermCurve | None
    short: ShortFormula | None
    resembles: tuple[Resemblance, ...]
    refines: tuple[str, ...]
    effect: str
    kept: bool
    measures: dict[str, Change]
    sentence: str
    next_experiment: str


@dataclass(frozen=True)
class Verdict:
    """status: none (at the floor), explained (named effects bring the gap to the floor), partly explained (named
    effects with evidence, and a remainder), unknown (a gap and no effect with evidence).

    effects: named, the largest share first; equivalent: rivals of any of them; sentence: where, which and how far, for
    people; next_experiment: the recording to make next, with the reason.
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
    """The gap measures of one recording before and after; jumps: whether an input jumps within a sampling interval,
    where no floor holds when."""

    recording: str
    kind: str
    split: str
    changes: dict[str, Change]
    jumps: bool = False


@dataclass(frozen=True)
class ParameterChange:
    """A parameter that is another one than in the given model. before, after, and the 95 % interval of after: SI."""

    parameter: str
    unit: str
    effect: str
    before: float
    after: float
    low: float
    high: float

    @property
    def share(self) -> float:
        """By which share of itself it has changed; nan where it was 0."""
        return self.after / self.before - 1.0 if self.before else math.nan


@dataclass(frozen=True)
class ExportLoss:
    """What other programs keep of the closed gap.

    targets: of `linid export`, whose forms are equal; whole: whether they hold the whole model; kept: measure -> share
    of the closed gap that they keep with its 95 % interval, nan where the effects close none of it; lacks: what the
    form cannot hold, a sentence each; refused: why they cannot be made.
    """

    targets: tuple[str, ...]
    whole: bool
    kept: dict[str, tuple[float, float, float]]
    lacks: tuple[str, ...]
    refused: str = ""


@dataclass(frozen=True)
class Diagnosis:
    """All that a diagnosis of one campaign found.

    model: base motor model; base_effects: already in the base; assumptions: what was taken for granted; force_scale:
    "" where forces are in N, else what they are divided by ("kg"), since no recording tells the mass; where, pairs:
    coordinates and pairs of them that the base's residual depends on; tried: all effects that make sense here;
    measures: over all held-out recordings before and after; combinations: of base parameters, known although they are
    not known one by one; friction_law: None where friction is known; proposal: a term for what the budget leaves, None
    where the data ask for none; given: whether the base is a model as it was given; changes: parameters that are others
    than in it; checks: what the data themselves show;
    field_wavenumber: rad/m or None; compensation: following errors under the drive, None where not asked for;
    exports: what other programs would keep of the closed gap, empty where not asked for or nothing was named.
    """

    name: str
    model: str
    axis: str
    base_effects: tuple[str, ...]
    assumptions: tuple[str, ...]
    verdict: Verdict
    budget: Budget
    tried: tuple[Tried, ...]
    where: tuple[Share, ...]
    pairs: tuple[PairShare, ...]
    measures: dict[str, Change]
    recordings: tuple[RecordingChange, ...]
    traces: tuple[ResidualTrace, ...]
    checks: tuple[RecordingChecks, ...]
    force_scale: str
    field_wavenumber: float | None
    seed: int
    combinations: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    friction_law: LawFinding | None = None
    proposal: ProposedTerm | None = None
    given: bool = False
    changes: tuple[ParameterChange, ...] = ()
    compensation: Compensation | None = None
    exports: tuple[ExportLoss, ...] = ()
