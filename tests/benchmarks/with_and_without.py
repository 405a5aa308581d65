"""Campaigns of the challenge with an effect, with another one and with none, so many of each."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from linid.challenge.make import Kind


def campaigns_with_and_without(effect: str, words: str, seed: int, count: int) -> Iterator[tuple[str, str, Path]]:
    """Group, a label with number, effects and their strengths, and the folder of each campaign, which lasts until the
    next one. words: of the group with the effect."""
    from linid.challenge.catalogue import FIRST
    from linid.challenge.files import write_hidden_campaign
    from linid.challenge.make import Plan, make_campaign

    others = tuple(name for name in FIRST if name != effect)
    groups: dict[str, tuple[Kind, tuple[str, ...]]] = {
        words: ("single", (effect,)),
        "another effect": ("single", others),
        "nothing": ("none", ()),
    }
    for group, (kind, effects) in groups.items():
        for index in range(count):
            hidden = make_campaign(Plan(seed, effects=effects, kinds=(kind,)), index)
            names = "+".join(f"{name} {hidden.strength[name]:.2f}" for name in hidden.strength)
            with TemporaryDirectory() as folder:
                write_hidden_campaign(hidden, Path(folder), fresh=False)
                yield group, f"{group} {index} {names}", Path(folder) / hidden.name
