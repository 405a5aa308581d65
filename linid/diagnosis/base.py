"""The base model of a diagnosis, identified by the force balance, and the judge of all models that follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from linid.diagnosis.balance import Balance, Memory
from linid.diagnosis.confirm import Fitted, Judge, fit_base, judge_of
from linid.identification.first_values import first_values
from linid.identification.fit import fit
from linid.identification.genetic import SearchSettings
from linid.identification.result import FitResult, ModelKind
from linid.identification.settings import FitSettings
from linid.physics.model import Model
from linid.recording.recording import Recording

Progress = Callable[[str, int, int], None]
# Friction and Stribeck parameters come from the free wheels; a short search is enough to start from.
_STEPS, _PRECISION = 20, 0.1
_FRICTION_SEARCH = SearchSettings(population=32, generations=12, patience=4)


def numbered(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Recordings that know their number (bare files have none)."""
    if all(r.number for r in recordings):
        return tuple(recordings)
    return tuple(replace(r, number=k) for k, r in enumerate(recordings, 1))


def fit_base_model(
    recordings: Sequence[Recording], kind: ModelKind, known: dict[str, float], jobs: int, seed: int,
    assumptions: list[str], watch: Progress, memory: Memory | None = None,
) -> tuple[Fitted, Judge]:  # fmt: skip
    """The base model by the force balance of the fitted recordings, started from friction of the free wheels."""
    fitted = [r for r in recordings if r.split == "fit"]
    wheels = [r for r in fitted if r.kind == "free_wheel"]
    model = Model(kind)
    settings = FitSettings(
        search=replace(_FRICTION_SEARCH, seed=seed), jobs=jobs, polish_steps=_STEPS, polish_precision=_PRECISION
    )
    start: FitResult | None = None
    fixed = dict(known)
    watch("base", 0, 2)
    if wheels:
        names = {p.name for p in Model("friction").parameters}
        start = fit("friction", wheels, settings=settings, known={k: x for k, x in known.items() if k in names})
        assumptions.append(f"friction starts from {len(wheels)} free wheels")
    elif kind == "force":
        start = fit("force", fitted, settings=replace(settings, objective="acceleration"), known=known)
        assumptions.append("no free wheels: friction comes from the driven recordings")
    watch("base", 1, 2)
    masses = {r.added_mass for r in fitted}
    if "mass" not in fixed and len(masses) < 2 and not (kind == "force" and "force_constant" in fixed):
        fixed["mass"] = 1.0 if start is None else start.value("mass")
        assumptions.append("no recording tells the mass: forces are those of the friction result, or per kilogram")
    first, _ = first_values(model, fitted, fixed, start)
    balance = Balance(model, recordings, jobs, seed, memory)
    base = fit_base(balance, model, first, fixed, fitted, jobs)
    watch("base", 2, 2)
    return base, judge_of(balance, model, base.vector, seed)
