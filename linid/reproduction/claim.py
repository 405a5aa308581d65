"""One claim of the paper beside what was found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["holds", "holds in part", "does not hold", "cannot be told"]


@dataclass(frozen=True)
class Claim:
    """claim: as the paper has it; source: where; found: numbers; reason: why, or what it depends on."""

    claim: str
    source: str
    verdict: Verdict
    found: str
    reason: str
