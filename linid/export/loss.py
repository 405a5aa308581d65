"""What a target's simpler form costs: the gap on held-out recordings without effects, with all, and in that form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from linid.arrays import Array
from linid.diagnosis.gap import RecordingGap
from linid.diagnosis.measures import measure_gaps
from linid.export.target import reshaped
from linid.identification.result import FitResult
from linid.recording.recording import Recording

Measure = Literal["ahead", "free_run", "force"]
MEASURES: tuple[Measure, ...] = ("ahead", "free_run", "force")
_WORDS = {"ahead": "position 0.1 s ahead", "free_run": "free run", "force": "force"}
_RESAMPLES, _SEED = 1000, 1  # of the recordings, for the intervals
_LEAST_CLOSED = 0.01  # of the gap without effects, that a model must close for shares of it to say anything


@dataclass(frozen=True)
class Kept:
    """One measure over all recordings, root mean squares.

    measure: `ahead` (m), `force` (N) or `free_run` (of the positions' deviation); base, full, target: the gap without
    the model's effects, with all, and in the target's form; share: of the gap between the first two that the target
    keeps closed, nan where the model closes none; low, high: its 95 % interval over recordings, nan with one alone.
    """

    measure: Measure
    base: float
    full: float
    target: float
    share: float
    low: float
    high: float


@dataclass(frozen=True)
class Loss:
    """What a target keeps on recordings. recordings: their names; kept: the measure that counts first."""

    recordings: tuple[str, ...]
    kept: tuple[Kept, ...]

    @property
    def text(self) -> str:
        """It in one sentence."""
        return "; ".join(map(_sentence, self.kept))

    def row(self) -> dict[str, Any]:
        """It as plain data, nothing but numbers, texts and None."""
        rows = [{k: _finite(v) for k, v in asdict(one).items()} for one in self.kept]
        return {"recordings": list(self.recordings), "kept": rows, "text": self.text}


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _sentence(kept: Kept) -> str:
    what = _WORDS[kept.measure]
    if math.isnan(kept.share):
        return f"{what}: the effects close no gap"
    if not math.isfinite(kept.share):
        return f"{what}: its simulation diverges"
    between = f" (95 %: {100 * kept.low:.0f} to {100 * kept.high:.0f} %)" if math.isfinite(kept.low) else ""
    return f"{what}: keeps {100 * kept.share:.0f} % of the closed gap{between}"


class Errors(NamedTuple):
    """What is asked of a recording's gap; its measures as in `RecordingGap`."""

    recording: str
    kind: str
    free_run: float
    ahead: float
    force: float


@dataclass(frozen=True)
class Measured:
    """Gaps of the same recordings without the effects and with all of them, which all targets share."""

    base: tuple[RecordingGap | Errors, ...]
    full: tuple[RecordingGap | Errors, ...]


def without_effects(result: FitResult) -> FitResult:
    """The model without its effects: what a target that holds none is compared with at least."""
    return reshaped(result, effects=())


def measure_model(
    result: FitResult, base: FitResult | None, recordings: Sequence[Recording], jobs: int = 1
) -> Measured:
    """The gap that a model closes, against a base (None: itself without its effects).

    Raises UsageError or DataError where a recording lacks what the model needs.
    """
    first = without_effects(result) if base is None else base
    return Measured(measure_gaps_of(first, recordings, jobs), measure_gaps_of(result, recordings, jobs))


def measure_loss(measured: Measured, form: FitResult | None, recordings: Sequence[Recording], jobs: int = 1) -> Loss:
    """What a target keeps of the gap that the model closes; form: the MODEL that it equals (None: the model)."""
    return loss_of(measured, measured.full if form is None else measure_gaps_of(form, recordings, jobs))


def loss_of(measured: Measured, target: Sequence[RecordingGap | Errors]) -> Loss:
    """The same from gaps that were measured, in whatever way, of the recordings in the same order."""
    names = tuple(gap.recording for gap in measured.full)
    kept = []
    for measure in MEASURES:
        rows = [k for k, gap in enumerate(measured.full) if _counts(gap, measure)]
        if rows:
            each = (measured.base, measured.full, target)
            values = [np.array([getattr(gaps[k], measure) for k in rows]) for gaps in each]
            kept.append(_kept(measure, *values))
    return Loss(names, tuple(kept))


def _counts(gap: RecordingGap | Errors, measure: Measure) -> bool:
    """Whether a measure says something of a recording: driven axes have no spring, and their free runs lose step."""
    return measure == "force" or (measure == "free_run") == (gap.kind == "free_wheel")


def measure_gaps_of(result: FitResult, recordings: Sequence[Recording], jobs: int) -> tuple[RecordingGap, ...]:
    """The gaps of a model on recordings, in their order; raises UsageError or DataError where one lacks a channel."""
    return measure_gaps(result, recordings, jobs=jobs, floors=False)[0]


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(np.square(values), axis=-1)))


def _shares(base: Array, full: Array, target: Array) -> Array:
    """Which share of the closed gap a target keeps, by its errors (..., R) of R recordings; nan where none closes."""
    first, last = _rms(base), _rms(full)
    with np.errstate(invalid="ignore", divide="ignore"):
        closes = np.isfinite(first) & (first - last > _LEAST_CLOSED * first)
        return np.where(closes, (first - _rms(target)) / (first - last), math.nan)


def _kept(measure: Measure, base: Array, full: Array, target: Array) -> Kept:
    """A measure over all recordings, with the percentiles of resampled ones (Efron 1979, Ann. Stat. 7, 1)."""
    low = high = math.nan
    if base.size > 1:
        generator = np.random.default_rng(_SEED)
        rows = generator.integers(0, base.size, (_RESAMPLES, base.size))
        shares = _shares(base[rows], full[rows], target[rows])
        shares = shares[~np.isnan(shares)]
        if shares.size:
            low, high = (float(edge) for edge in np.percentile(shares, [2.5, 97.5]))
    share = float(_shares(base, full, target))
    return Kept(measure, float(_rms(base)), float(_rms(full)), float(_rms(target)), share, low, high)


def held_out(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Those that no fit has seen, or all where none is marked so."""
    chosen = tuple(r for r in recordings if r.split == "held_out")
    return chosen or tuple(recordings)


def readme(lines: Sequence[str], loss: Loss | None, lacks: Sequence[str]) -> str:
    """The text beside a target's files: what they are, what the form lacks, and what that costs."""
    out = [*lines, ""]
    if lacks:
        out += ["What this form does not hold:", *(f"- {one}" for one in lacks), ""]
    if loss is None:
        out.append("Loss: not computed. Give held-out recordings: linid export MODEL.json CAMPAIGN.yaml --to ...")
    else:
        out.append(f"Loss on {len(loss.recordings)} held-out recordings ({', '.join(loss.recordings)}):")
        out += [f"- {_sentence(one)}" for one in loss.kept]
    return "\n".join(out) + "\n"
