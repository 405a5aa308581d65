"""What an effect is: a named term of the equation of motion with its own parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from linid.physics.parameter import Parameter


@dataclass(frozen=True)
class Effect:
    """One physical effect.

    force: compiled function (t in s, y in m, v in m/s, *parameters) -> force in N that pushes the mass;
    physics: one line; exposed_by: the recording that shows it; confused_with: effects that look alike.
    """

    name: str
    physics: str
    parameters: tuple[Parameter, ...]
    force: Callable[..., float]
    exposed_by: str
    confused_with: tuple[str, ...] = ()
