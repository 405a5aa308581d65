"""The friction laws by name, those of `names.py`; the first is the default."""

from __future__ import annotations

from importlib import import_module

from linid.errors import UsageError
from linid.physics.laws import coulomb, dahl, lugre
from linid.physics.laws.law import Law
from linid.physics.laws.names import LAW_NAMES

LAWS: dict[str, Law] = {name: import_module(f"linid.physics.laws.{name}").LAW for name in LAW_NAMES}
LUGRE, DAHL, COULOMB = lugre.LAW.name, dahl.LAW.name, coulomb.LAW.name
MOST_ELEMENTS = max(law.elements for law in LAWS.values())


def find_law(name: str) -> Law:
    """The friction law of that name; raises UsageError if there is none."""
    if name not in LAWS:
        raise UsageError("--law", f"there is no friction law {name!r}", f"Choose one of {', '.join(LAWS)}")
    return LAWS[name]
