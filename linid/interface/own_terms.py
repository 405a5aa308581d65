"""Own terms called by their short names: those of an earlier model, and `learned`, which the recordings ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linid.errors import UsageError
from linid.interface.friction_law import with_judges
from linid.physics.laws.names import ASKED_OF_THE_RECORDINGS

if TYPE_CHECKING:
    from linid.diagnosis.base import Base
    from linid.diagnosis.joint import Fitted
    from linid.diagnosis.means import Means
    from linid.identification.result import FitResult, ModelKind
    from linid.interface.campaign import Campaign
    from linid.interface.settings import Settings
    from linid.recording import Recording

LEARNED = "learned"
_MANY = 4  # coefficients, from which on they keep their ratios
_PLACE = f"--effect {LEARNED}"


def with_terms(
    campaign: Campaign, settings: Settings, model: ModelKind, start: FitResult | None = None, jobs: int = 1
) -> Settings:
    """The settings with own terms written out that they call by short names, and many coefficients as proportions.

    A short name is that of a term of `start`; `learned` is else the term that the campaign's recordings ask for beside
    the model and the other effects, as a diagnosis proposes it. Many coefficients keep the ratios in which they were
    found, by a penalised regression beside all that the model can do, and their size is identified: least squares would
    bend a curve by the noise, and a held size would hold the mass. model: of the fit; jobs: threads.
    Raises UsageError where the recordings ask for no term, or do not tell.
    """
    terms = {} if start is None else _terms_of(start)
    effects: list[str] = []
    ratios: dict[str, float] = {}
    for name in settings.effects:
        text, values = name, dict[str, float]()
        if name in terms:
            text, values = terms[name]
        elif name == LEARNED:
            text, values = _proposed(campaign, settings, model, start, jobs)
        effects.append(text)
        ratios |= values if len(values) >= _MANY else {}
    if tuple(effects) == settings.effects:
        return settings
    return settings.model_copy(update={"effects": tuple(effects), "proportions": {**ratios, **settings.proportions}})


def _terms_of(start: FitResult) -> dict[str, tuple[str, dict[str, float]]]:
    """The own terms of a model, with the SI values of their amplitudes, by their short names."""
    from linid.physics.effects.registry import find_effect
    from linid.physics.own_terms.own_term import is_own

    effects = [find_effect(name) for name in start.effects if is_own(name)]
    return {e.own.name: (e.name, {name: start.value(name) for name in e.amplitudes}) for e in effects}


def _proposed(
    campaign: Campaign, settings: Settings, model: ModelKind, start: FitResult | None, jobs: int
) -> tuple[str, dict[str, float]]:
    """The term that the recordings ask for, and the SI values of its coefficients."""
    from linid.diagnosis.means import Means
    from linid.diagnosis.proposed.learned import with_term
    from linid.diagnosis.proposed.problem import problem_of
    from linid.diagnosis.proposed.propose import judged_families, propose
    from linid.physics.effects.registry import find_effect
    from linid.physics.laws.registry import LUGRE

    kind, recordings = _judged_recordings(campaign, model)
    means = Means(jobs=jobs, seed=settings.seed)
    law = settings.law or (LUGRE if start is None else start.law)
    base, step = _fitted(recordings, kind, settings, _known(campaign, settings, model, start), law, means)
    problem = problem_of(base.judge, step, means.seed)
    proposal = propose(problem, judged_families(problem))
    if proposal is None:
        raise UsageError(
            _PLACE,
            "these recordings ask for no term beside the model and its effects",
            "Leave it out; `linid diagnose` says what it tried. Or start from a model that has the term: "
            "--friction model_after.json",
        )
    joined = with_term(base.judge, step, problem, proposal, None)
    if joined is None:
        raise UsageError(
            _PLACE,
            f"these recordings ask for a term of {' and '.join(proposal.arguments)} that no formula can say",
            "Leave it out; `linid diagnose` shows it.",
        )
    return joined.effect, {name: joined.fitted.values[name] for name in find_effect(joined.effect).amplitudes}


def _judged_recordings(campaign: Campaign, model: ModelKind) -> tuple[ModelKind, tuple[Recording, ...]]:
    """The kind of model and the recordings on which a term is sought, some of which judge."""
    from linid.diagnosis.base import numbered

    recordings = numbered(campaign.recordings)
    kind = model
    if model == "friction":
        wheels = tuple(r for r in recordings if r.kind == "free_wheel")
        kind = "friction" if any(r.split == "fit" for r in wheels) else "force"
        recordings = wheels if kind == "friction" else recordings
    judged = with_judges(recordings)
    if not judged:
        raise UsageError(
            _PLACE, "too few recordings to find a term and to judge it", "Add some, and mark one `split: held_out`."
        )
    return kind, judged


def _known(campaign: Campaign, settings: Settings, model: ModelKind, start: FitResult | None) -> dict[str, float]:
    """Known SI values; the mass that a fit takes from its start is one."""
    from linid.identification.guess.first_values import mass_known
    from linid.physics.model import Model

    known = settings.known_values(campaign.known)
    if start is not None and not start.per_mass and not any(mass_known(campaign.fitted, known, Model(model))):
        known["mass"] = start.value("mass")
    return known


def _fitted(
    recordings: tuple[Recording, ...],
    kind: ModelKind,
    settings: Settings,
    known: dict[str, float],
    law: str,
    means: Means,
) -> tuple[Base, Fitted]:
    """The base model along the measured motion under a friction law, and it with all effects but the term."""
    from linid.diagnosis.base import fit_base_model
    from linid.diagnosis.law_of_base import base_under, base_with_law
    from linid.diagnosis.screen import Screening
    from linid.diagnosis.select import fit_effects
    from linid.physics.model import Model

    others = tuple(name for name in settings.effects if name != LEARNED)
    names = {p.name for p in Model(kind, others).parameters}
    base = fit_base_model(recordings, kind, {k: x for k, x in known.items() if k in names}, means, [])
    base = base_with_law(base, known)[0] if law == ASKED_OF_THE_RECORDINGS else base_under(base, law)
    if not others:
        return base, base.fitted
    step = fit_effects(base, Screening(base.judge.fits, base.fitted, means.jobs), others)
    if step is None:
        raise UsageError(
            "--effect",
            f"one of {', '.join(others)} makes no sense with the {kind} model and these recordings",
            "See what each needs: linid effects",
        )
    return base, step
