"""The explicit list of friction laws; the first is the default."""

from __future__ import annotations

from linid.errors import UsageError
from linid.physics.laws import coulomb, dahl, elasto_plastic, lugre, maxwell_slip
from linid.physics.laws.law import Law

LAWS: dict[str, Law] = {module.LAW.name: module.LAW for module in (lugre, dahl, coulomb, elasto_plastic, maxwell_slip)}
LUGRE, DAHL, COULOMB = lugre.LAW.name, dahl.LAW.name, coulomb.LAW.name
MOST_ELEMENTS = max(law.elements for law in LAWS.values())


def find_law(name: str) -> Law:
    """The friction law of that name; raises UsageError if there is none."""
    if name not in LAWS:
        raise UsageError("--law", f"there is no friction law {name!r}", f"Choose one of {', '.join(LAWS)}")
    return LAWS[name]
