"""LuGre: one bristle that bends and, from the first travel on, slips a little (Canudas de Wit et al. 1995)."""

from __future__ import annotations

from linid.physics.laws.law import Law

LAW = Law(
    name="lugre",
    title="LuGre",
    meaning="one bristle with stiffness and damping, and a steady force that falls with speed (Stribeck)",
    source="Canudas de Wit, Olsson, Astrom and Lischinsky 1995, IEEE Trans. Autom. Control 40, 419",
)
