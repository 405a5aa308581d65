"""What compiles the functions of effects and motors that become part of the simulation."""

from __future__ import annotations

from numba import njit

# Not cached by itself: it is compiled into the kernel, whose cache knows what it does.
term = njit(error_model="numpy")
