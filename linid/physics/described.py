"""What people write about an axis in YAML: the strict base of such descriptions, and friction."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, model_validator

from linid.former_names import with_present_keys

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]


class Description(BaseModel):
    """Base: unknown keys are errors, values cannot be changed afterwards."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _former_keys(cls, data: Any) -> Any:
        return with_present_keys(data)


class Friction(Description):
    """LuGre friction (symbols F_C, F_S, v_s, alpha, sigma_0, sigma_1, sigma_2); stribeck_exponent: dimensionless."""

    coulomb_force_n: Positive
    static_force_n: Positive
    stribeck_velocity_m_per_s: Positive
    stribeck_exponent: Annotated[float, Field(ge=0.5, le=2)] = 2.0
    bristle_stiffness_n_per_m: Positive
    bristle_damping_n_s_per_m: NotNegative
    viscous_friction_n_s_per_m: NotNegative

    @model_validator(mode="after")
    def _static_not_below_coulomb(self) -> Friction:
        if self.static_force_n < self.coulomb_force_n:
            raise ValueError("static_force_n must not be below coulomb_force_n")
        return self

    @property
    def values(self) -> dict[str, float]:
        """SI values under the canonical parameter names."""
        return {
            "coulomb_force": self.coulomb_force_n,
            "static_force": self.static_force_n,
            "stribeck_velocity": self.stribeck_velocity_m_per_s,
            "stribeck_exponent": self.stribeck_exponent,
            "bristle_stiffness": self.bristle_stiffness_n_per_m,
            "bristle_damping": self.bristle_damping_n_s_per_m,
            "viscous_friction": self.viscous_friction_n_s_per_m,
        }
