"""What the paper prints: the parameters of its tables 1 to 3, as printed and as they can be meant in SI."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Printed:
    """One row of a table. name: linid's; value, unit: as printed; si: the value that can be meant, in SI."""

    name: str
    symbol: str
    value: float
    unit: str
    si: float


def _friction(
    coulomb: float, static: float, stiffness: float, damping: float, viscous: float, stribeck: float
) -> tuple[Printed, ...]:
    """The rows that all three tables share."""
    return (
        Printed("coulomb_force", "F_C", coulomb, "N", coulomb),
        Printed("static_force", "F_S", static, "N", static),
        Printed("bristle_stiffness", "sigma_0", stiffness, "N/m", 1e3 * stiffness),
        Printed("bristle_damping", "sigma_1", damping, "N s/mm", damping),
        Printed("viscous_friction", "sigma_2", viscous, "N s/mm", viscous),
        Printed("stribeck_velocity", "v_s", stribeck, "mm/s", 1e-3 * stribeck),
    )


TABLE_1 = (*_friction(1.720, 3.198, 11.69, 92.14, 2.517, 2.993), Printed("mass", "m", 0.588, "kg", 0.588))
TABLE_2 = (
    Printed("force_constant", "K_f", -133.8, "N", -133.8),
    Printed("electrical_wavenumber", "omega_g", 0.222, "1/mm", 222.0),
    Printed("winding_displacement", "alpha_p", 0.5368, "-", 0.5368),
    Printed("commutation_offset", "alpha_S", 1.936, "-", 1.936),
    *_friction(1.874, 2.341, 11.36, 26.30, 2.872, 11.66),
)
TABLE_3 = (
    Printed("force_constant", "K_f'", 80.63, "N", 80.63),
    Printed("electrical_wavenumber", "z_0", 1.047, "1/mm", 104.7),
    Printed("winding_length", "z_L", -1.376, "-", -1.376),
    Printed("winding_displacement", "z_p", 1.513, "-", 1.513),
    Printed("commutation_offset", "z_S", 0.7680, "-", 0.7680),
    Printed("nome", "q_0", 0.493, "-", 0.493),
    *_friction(1.720, 3.198, 11.69, 92.14, 2.517, 2.993),
)


def meant(table: tuple[Printed, ...]) -> dict[str, float]:
    """SI values by parameter."""
    return {row.name: row.si for row in table}
