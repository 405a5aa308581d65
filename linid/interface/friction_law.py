"""The friction law that the recordings of a campaign prefer, for fits that ask for it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from linid.identification.result import ModelKind
    from linid.interface.campaign import Campaign
    from linid.interface.settings import Settings
    from linid.recording import Recording

_FEWEST = 4  # recordings, every second of which can judge where none is held out


def preferred_law(campaign: Campaign, settings: Settings, kind: ModelKind) -> tuple[str, tuple[str, ...]]:
    """The law that a campaign's recordings prefer along the measured motion, held-out ones judging, and words on it;
    LuGre where they do not tell. kind: of the motor model."""
    from linid.diagnosis.base import fit_base_model, numbered
    from linid.diagnosis.law_of_base import PRESLIDING, base_with_law, sentence, untold
    from linid.diagnosis.means import Means
    from linid.physics.laws.registry import LUGRE

    recordings = with_judges(numbered(campaign.recordings))
    silent = f"the friction law is not told by these recordings: LuGre is taken; to tell, record {PRESLIDING}"
    if not recordings:
        return LUGRE, (silent,)
    known = settings.known_values(campaign.known)
    plain = fit_base_model(recordings, kind, known, Means(seed=settings.seed), [])
    _, choice = base_with_law(plain, known)
    if choice is None or (choice.law == LUGRE and not choice.told):
        return LUGRE, (silent if choice is None else untold(choice),)
    words = sentence(choice, choice.chosen.on_held_out.power_closed)
    return choice.law, (words or "the recordings tell LuGre friction from all other laws",)


def with_judges(recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
    """Recordings of which some are fitted and some judge; none where that cannot be."""
    if {"fit", "held_out"} <= {r.split for r in recordings}:
        return recordings
    if len(recordings) < _FEWEST:
        return ()
    return tuple(replace(r, split="held_out" if k % 2 else "fit") for k, r in enumerate(recordings))
