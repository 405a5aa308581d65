"""What a fit returns: estimates with their intervals, how the search went, and what the data cannot tell."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from linid.arrays import Array

Status = Literal["fitted", "fixed", "not_identifiable", "at_bound"]
ModelKind = str  # a motor by name, or friction


@dataclass(frozen=True)
class Estimate:
    """One identified parameter in SI units.

    std: standard deviation (nan if fixed or not identifiable); low, high: 95 % interval;
    note: why it is fixed, at its bound or not identifiable, and which recording would help.
    """

    name: str
    symbol: str
    unit: str
    value: float
    std: float
    low: float
    high: float
    status: Status = "fitted"
    note: str = ""

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval in SI units; nan where there is none."""
        return self.low, self.high


@dataclass(frozen=True)
class Generation:
    """One line of the convergence history. stage: 'genetic', 'cma', 'plain' or 'least squares'; cost: dimensionless."""

    stage: str
    generation: int
    evaluations: int
    best: float
    median: float


@dataclass(frozen=True)
class Start:
    """Start state of one recording's simulation: y in m, v in m/s, w in m (rotary: rad, rad/s, rad)."""

    t: float
    y: float
    v: float
    w: float


@dataclass(frozen=True)
class Profile:
    """Likelihood ratio along one parameter, all others fitted again.

    values: (n,) in SI; statistic: (n,), below `CHI_SQUARED_95` within the 95 % interval; low, high: that interval in
    SI, nan where the profile does not reach the limit.
    """

    name: str
    values: tuple[float, ...]
    statistic: tuple[float, ...]
    low: float
    high: float


@dataclass(frozen=True)
class FitResult:
    """The MODEL (`parameters.json`): parameters, uncertainty, identifiability and convergence.

    correlation, covariance: (p, p) matrices of the parameters named in `fitted`, the latter in their SI units; pairs:
    parameters that the data cannot tell apart, (name, name, correlation, advice); derived: quantities that follow from
    the parameters (pole pitch, k ...) as Estimates; per_mass: forces are per kilogram because no mass is known;
    profiles: profile likelihoods that were asked for; winding: star or separate where the windings were identified;
    law: of friction; search_check: a sentence on whether a search from scratch found the same minimum, if it was asked.
    """

    model: ModelKind
    axis: str
    effects: tuple[str, ...]
    estimates: tuple[Estimate, ...]
    fitted: tuple[str, ...]
    correlation: Array
    condition_number: float
    pairs: tuple[tuple[str, str, float, str], ...]
    starts: dict[str, Start]
    objectives: dict[str, str]
    residual_rms: dict[str, float]
    history: tuple[Generation, ...]
    stop_reasons: tuple[str, ...]
    converged: bool
    seed: int
    evaluations: int
    substeps: int
    step_error: float
    warnings: tuple[str, ...] = ()
    derived: tuple[Estimate, ...] = ()
    per_mass: bool = False
    input_unit: str = "A"
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    settings: dict[str, Any] = field(default_factory=dict)
    profiles: tuple[Profile, ...] = ()
    winding: str = ""
    law: str = "lugre"
    search_check: str = ""

    def value(self, name: str) -> float:
        """The value of parameter `name` in SI units; raises KeyError if the model has none."""
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate.value
        raise KeyError(name)
