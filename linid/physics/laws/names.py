"""The names of the friction laws, each that of its file here, the default first; without what the laws compile."""

from __future__ import annotations

LAW_NAMES = ("lugre", "dahl", "coulomb", "elasto_plastic", "maxwell_slip")
ASKED_OF_THE_RECORDINGS = "auto"  # in place of a name: the law that they prefer
LAW_CHOICES = (ASKED_OF_THE_RECORDINGS, *LAW_NAMES)
