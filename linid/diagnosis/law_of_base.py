"""The friction law of a diagnosis' base: decided before effects are selected, and once more beside them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from linid.diagnosis.base import Base
from linid.diagnosis.descent import SETTLING, THOROUGH
from linid.diagnosis.joint import Fitted
from linid.diagnosis.judge import Judge, compare
from linid.diagnosis.laws import (
    LEAST_CLOSED,
    OF_THEIR_OWN,
    PROMISING,
    LawChoice,
    choose_law,
    clearly_better,
    promised,
    under_law,
)
from linid.diagnosis.report_data import LawFinding
from linid.diagnosis.select import Selection
from linid.diagnosis.steps_of_selection import further
from linid.diagnosis.verdict import LEAST_EXCESS
from linid.physics import friction
from linid.physics.laws.registry import DAHL, LUGRE, find_law

Select = Callable[[Base], Selection]
_SEPARATE = "mass"  # known without any friction law
PRESLIDING = (
    "slow back-and-forth moves within the presliding distance: a current that rises and falls below the breakaway force"
)


def base_with_law(base: Base, known: Mapping[str, float]) -> tuple[Base, LawChoice | None]:
    """The base under the friction law that the recordings prefer; no choice where friction is known. known: SI."""
    if {p.name for p in friction.PARAMETERS if p.name != _SEPARATE} & known.keys():
        return base, None
    choice = choose_law(base.judge, base.fitted)
    return _under(base, choice), choice


def base_under(base: Base, law: str) -> Base:
    """The base under a friction law that somebody names."""
    return base if law == base.fitted.model.law else _settled(base, under_law(base.judge.fits, base.fitted, law))


def _under(base: Base, choice: LawChoice) -> Base:
    return base if choice.base == LUGRE else _settled(base, choice.chosen.fitted)


def _settled(base: Base, one: Fitted) -> Base:
    """The base with a model under a friction law, fitted to the end."""
    return replace(base, fitted=further(base.judge.fits, one, one.recordings, THOROUGH), rivals=())


def select_under_law(
    plain: Base, base: Base, choice: LawChoice | None, select: Select
) -> tuple[Base, Selection, LawChoice | None]:
    """Effects selected beside the base's friction law, and the law tested once more with them there.

    plain: the base under LuGre. A missing effect may look like another law, and hide one: a law that is no longer
    better than LuGre beside the effects goes, one that is better only beside them comes; the effects are then selected
    anew, once.
    """
    found = select(base)
    if choice is None or not found.parts:
        return base, found, choice
    judge, best = base.judge, found.best
    if choice.base in OF_THEIR_OWN:
        if clearly_better(compare(judge.fits, under_lugre(judge, best), best, judge.balance.split)):
            return base, found, choice
        back = replace(choice, law=LUGRE, told=False, alike=(choice.law,), chosen=choice.trials[0], base=LUGRE)
        return plain, select(plain), back
    gap = choice.base == LUGRE and judge.excess(best.residual) > LEAST_EXCESS
    if gap and promised(judge, best) >= PROMISING * LEAST_CLOSED:
        second = choose_law(judge, best)
        if second.base in OF_THEIR_OWN:
            other = next(t for t in choice.trials if t.law == second.base)
            # How far the law closes the gap is told beside the effects: the choice keeps their trials.
            changed = _under(plain, replace(choice, chosen=other, base=second.base))
            return changed, select(changed), second
    return base, found, choice


def under_lugre(judge: Judge, one: Fitted) -> Fitted:
    """The model with its effects under LuGre friction, fitted again to the same recordings."""
    model = replace(one.model, law=LUGRE)
    values = {p.name: one.values.get(p.name, p.default) for p in model.parameters}
    return judge.fits.fit(model, values, one.preset, one.recordings, SETTLING)


def law_finding(judge: Judge, choice: LawChoice | None) -> LawFinding | None:
    """What is said of the friction law."""
    if choice is None:
        return None
    before, after = (judge.excess(one.residual) for one in (choice.trials[0].fitted, choice.chosen.fitted))
    closed = choice.chosen.on_held_out.power_closed if choice.base != LUGRE else 0.0
    values = choice.chosen.fitted.values
    own = {p.name: values[p.name] for p in find_law(choice.law).own if p.name in values}
    gains = {t.law: (t.on_held_out.gain, t.on_held_out.certainty) for t in choice.trials}
    words = sentence(choice, closed)
    return LawFinding(choice.law, choice.base, choice.told, choice.alike, closed, before, after, own, gains, words)


def sentence(choice: LawChoice, closed: float) -> str:
    """The friction law in words; empty where LuGre is told, or where nothing else is."""
    title = find_law(choice.law).title
    if choice.law == "coulomb":
        return f"Friction law: {title}; the recordings show stops, but no presliding that they could resolve."
    if choice.law == DAHL:
        return "Friction law: Dahl does as well as LuGre with fewer parameters: no Stribeck effect, no bristle damping."
    if choice.law != LUGRE:
        also = f" ({', '.join(find_law(name).title for name in choice.alike)} would do as well)" if choice.alike else ""
        return f"Friction law: {title} rather than LuGre closes {100.0 * closed:.0f} % of the gap{also}."
    return ""


def untold(choice: LawChoice) -> str:
    """Why the friction law stays LuGre though others would do, and what would tell; empty where it is told."""
    if choice.law != LUGRE or choice.told:
        return ""
    names = ", ".join(find_law(name).title for name in choice.alike)
    return f"the friction law is not told by these recordings (LuGre or {names}); to tell, record {PRESLIDING}"
