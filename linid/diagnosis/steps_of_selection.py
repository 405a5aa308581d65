"""Fits that a selection takes its steps by: a model with one effect more, without one, or taken further."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from linid.diagnosis.descent import QUICK, SETTLING, Effort
from linid.diagnosis.joint import FAR, Fitted, JointFit
from linid.diagnosis.masses import at_the_masses
from linid.diagnosis.screen import Screened, Screening
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model

# Of the amplitudes by regression, as first values: it lets all other parameters move along, and far from where they
# are its columns are others. The first that betters the criterion will do; else the ends are both tried.
STARTING = (1.0, 0.3, 0.1, 0.01)


def with_effect(model: Model, name: str) -> Model:
    """The model with one effect more, or the same if it is there."""
    return model if name in model.effects else model.with_effects((*model.effects, name))


def preset_of(model: Model, values: Mapping[str, float]) -> dict[str, float]:
    """What of a model's effects is not searched, given their values."""
    out: dict[str, float] = {}
    for name in model.effects:
        out |= find_effect(name).held(dict(values))
    return out


def extended(fits: JointFit, screening: Screening, item: tuple[Fitted, Screened], jobs: int) -> Fitted:
    """A model with one effect more, identified together."""
    del jobs
    step, found = item
    model = with_effect(step.model, found.name)
    values = {**step.values, **found.trial.values, **found.trial.amplitudes}
    if found.trial.held_first:
        values |= screening.beside(step, found)
    preset = preset_of(model, {**step.preset, **values})
    recordings = screening.to_fit(step, found.name, {**step.preset, **values})
    amplitudes, before = found.trial.amplitudes, fits.level(step.residual, step.floor, fits.rows_of(recordings))
    out: list[Fitted] = []
    for share in STARTING:
        start = {**values, **{name: share * x for name, x in amplitudes.items()}}
        good = fits.level_at(model, start, preset, recordings) < before
        if good or share in STARTING[:: len(STARTING) - 1]:
            out.append(fits.fit(model, start, preset, recordings, QUICK, fits.slopes(step)))
        if good:
            break
    return min(out, key=lambda one: one.level)


def further(fits: JointFit, one: Fitted, recordings: Sequence[int], effort: Effort) -> Fitted:
    """The fit of a model taken further, from where it is, within its valley."""
    return fits.fit(one.model, one.values, one.preset, recordings, effort, fits.slopes(one), exact=True)


def again(fits: JointFit, one: Fitted, recordings: Sequence[int], effort: Effort) -> Fitted:
    """The fit of a model taken further, from where it is, and by way of softer criteria where it is far off."""
    done = further(fits, one, recordings, effort)
    return annealed(fits, done, effort) if done.level > FAR else done


def settled(fits: JointFit, one: Fitted) -> Fitted:
    """The fit of a model taken further on its own recordings, as far as it takes to compare it with others."""
    return again(fits, one, one.recordings, SETTLING)


def annealed(fits: JointFit, one: Fitted, effort: Effort) -> Fitted:
    """The fit of a model taken further by way of softer criteria, at the mass that added masses tell."""
    return at_the_masses(fits, fits.annealed(one, effort))


def without_effect(fits: JointFit, full: Fitted, name: str) -> Fitted:
    """The model without one of its effects, fitted again to the same recordings."""
    one = nearly_without(fits, full, name)
    return annealed(fits, one, QUICK) if one.level > full.level + FAR else one


def nearly_without(fits: JointFit, full: Fitted, name: str) -> Fitted:
    """`without_effect` as far as the next valley: without a strong effect it may end higher."""
    model, values, preset = _without(full, name)
    return fits.fit(model, values, preset, full.recordings, QUICK, fits.slopes(full))


def foretold_without(fits: JointFit, full: Fitted, name: str) -> Fitted:
    """`without_effect` as the slopes of the full model foretell it: near where all else hardly moves, as without a weak
    effect, anywhere with a strong one."""
    model, values, preset = _without(full, name)
    return fits.along_slopes(full, model, values, preset, QUICK)


def _without(full: Fitted, name: str) -> tuple[Model, dict[str, float], dict[str, float]]:
    """A model without one of its effects, with the values and the presets that it then has."""
    model = full.model.with_effects(e for e in full.model.effects if e != name)
    own = {p.name for p in model.parameters}
    first, preset = ({k: x for k, x in some.items() if k in own} for some in (full.values, full.preset))
    return model, first, preset
