"""A model that no recording made: motor parameters from a data sheet, friction and mass as given."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np

from linid.errors import UsageError
from linid.identification.derived_quantities import derived_quantities
from linid.identification.result import Estimate, FitResult
from linid.physics.field.geometry import MotorDesign
from linid.physics.model import Model

_SUBSTEPS = 4  # internal steps per sample at 1 kHz


def designed_model(design: MotorDesign, kind: Literal["sine", "theta"], rest: dict[str, float]) -> FitResult:
    """The sine or theta model of a motor by its dimensions, for `simulate` and `validate`.

    Its harmonics are those of the exact field: sine has the first, theta the first and third.
    rest: SI values of mass and friction by name. Raises UsageError where one is missing.
    """
    motor = design.sine | {"force_constant": design.exact[1]} if kind == "sine" else design.matched
    estimates = []
    electrical = design.geometry.electrical
    winding = "" if electrical is None else electrical.connection
    rest = rest | ({} if electrical is None else electrical.values)
    for parameter in Model(kind, winding=winding).parameters:
        source = "from dimensions" if parameter.name in motor else "given"
        value = motor.get(parameter.name, rest.get(parameter.name))
        if value is None:
            raise UsageError(
                f"{design.geometry.name}: {parameter.name}",
                "is neither a dimension's consequence nor given",
                "Give mass_kg and friction: in the geometry, or --friction MODEL.json.",
            )
        estimates.append(
            Estimate(
                parameter.name, parameter.symbol, parameter.unit, value, math.nan, math.nan, math.nan, "fixed", source
            )
        )
    bare = FitResult(
        model=kind,
        axis="linear",
        effects=(),
        estimates=tuple(estimates),
        fitted=(),
        correlation=np.zeros((0, 0)),
        condition_number=math.nan,
        pairs=(),
        starts={},
        objectives={},
        residual_rms={},
        history=(),
        stop_reasons=("from dimensions",),
        converged=True,
        seed=0,
        evaluations=0,
        substeps=_SUBSTEPS,
        step_error=math.nan,
        winding=winding,
    )
    derived = (e for e in derived_quantities(bare, ()) if e.name != "sine_force_error")
    nan = math.nan
    fixed = (replace(e, std=nan, low=nan, high=nan, status="fixed", note="from dimensions") for e in derived)
    return replace(bare, derived=tuple(fixed))
