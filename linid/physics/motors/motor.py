"""What a motor is: its inputs, its parameters and compiled terms of its thrust, all in one file.

Every term is a function decorated with `term` (linid.physics.term). A motor has one of two kinds:

* A field that repeats with the pole pitch, on which three phase currents act linearly (31, 39). Phase j pushes with
  force_constant * shape(z + (j - 2) * winding_displacement) * i_j, z = electrical_wavenumber * y + commutation_offset.
  `amplitudes(out, *shape)` fills out (MAX_HARMONICS,) with the amplitudes of the sines of turns * n * z, n = 1, 3, 5
  ..., that the shape is the sum of, and returns how many there are, or 0 where they are too many; `constant(z,
  *shape)` is then asked for the shape itself. Such a motor can be driven by phase voltages too: its back-EMF has the
  same shape.
* Any other one: `thrust(y, i_1, i_2, i_3, *parameters)` in N, y in m, the inputs in A; with one input i_2 = i_3 = 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from linid.physics.parameter import Parameter
from linid.physics.well_formed import fault_of_arguments, well_formed

MAX_HARMONICS = 12
_POINTS = 256  # of a period, for more harmonics than MAX_HARMONICS
# The first parameters of every motor with three phases, in this order; those of its field's shape follow.
PHASE_PARAMETERS = ("force_constant", "electrical_wavenumber", "winding_displacement", "commutation_offset")


@dataclass(frozen=True)
class Derived:
    """A quantity that follows from a motor's parameters.

    unit: SI of a linear axis; quantity(*values): of the parameters named in `of`, SI.
    """

    name: str
    symbol: str
    unit: str
    quantity: Callable[..., Any]
    of: tuple[str, ...]


@dataclass(frozen=True)
class Motor:
    """One motor model.

    name: as in `--model`; inputs: how many it has: 0 (friction alone), 1 or 3 (phase currents); parameters: in table
    order, `PHASE_PARAMETERS` first where there are three phases; turns: electrical radians per radian of its own angles
    (displacement and commutation offset), and so of its wavenumber; shape: the parameters after those, with the values
    that a search begins with; harmonic(force_constant, *shape) -> amplitude of the thrust's first harmonic per phase
    current, N/A, all of them floats or (C,) (None: the force constant itself); derived: what follows from its
    parameters. amplitudes, constant, thrust: compiled terms, see above.
    """

    name: str
    inputs: int
    parameters: tuple[Parameter, ...] = ()
    turns: float = 1.0
    shape: tuple[tuple[str, float], ...] = ()
    harmonic: Callable[..., Any] | None = None
    derived: tuple[Derived, ...] = ()
    amplitudes: Any = None
    constant: Any = None
    thrust: Any = None

    @property
    def terms(self) -> dict[str, Any]:
        """The terms that this motor has, by name."""
        names = ("amplitudes", "constant", "thrust")
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}

    @property
    def phases(self) -> bool:
        """Whether three phase currents drive it."""
        return self.inputs == 3

    @property
    def periodic(self) -> bool:
        """Whether its field repeats with the pole pitch and its thrust is linear in the currents."""
        return self.amplitudes is not None

    def fundamental(self, constant: Any, values: Mapping[str, Any]) -> Any:
        """Thrust per input of the first harmonic, N/A: the force constant itself where the field has no shape.

        constant: force constant (float or (C,)); values: at least those of the shape, each like it.
        """
        return constant if self.harmonic is None else self.harmonic(constant, *(values[name] for name, _ in self.shape))

    def spectrum(self, values: Mapping[str, float]) -> dict[int, float]:
        """Amplitudes of the odd harmonics of a periodic field by order, per unit of the force constant (as of eq. 37).

        values: at least those of the shape, SI.
        """
        shape = [values[name] for name, _ in self.shape]
        out = np.zeros(MAX_HARMONICS)
        amplitudes, constant = (getattr(one, "py_func", one) for one in (self.amplitudes, self.constant))
        count = int(amplitudes(out, *shape))  # in Python: to compile it would take a fifth of a second
        if count > 0:
            return {2 * k + 1: float(out[k]) for k in range(count)}
        # By the trapezoidal rule, which is exact for a sum of fewer harmonics than half the points.
        angle = np.arange(_POINTS) * (2.0 * math.pi / _POINTS)
        seen = np.array([constant(z / self.turns, *shape) for z in angle])
        return {n: float(2.0 * np.mean(seen * np.sin(n * angle))) for n in range(1, _POINTS // 4, 2)}

    def of_first_harmonic(self, sine: Mapping[str, float], known: Mapping[str, float]) -> dict[str, float]:
        """First values of this motor's parameters, SI, from those of a sine of the same first harmonic (eq. 37).

        sine: SI by name; known: SI values of its shape, where they are.
        """
        out = dict(sine)
        for name in PHASE_PARAMETERS[1:]:
            out[name] = sine[name] / self.turns
        shape = {name: known.get(name, usual) for name, usual in self.shape}
        out["force_constant"] = sine["force_constant"] / self.fundamental(1.0, shape)
        return {**out, **shape}


def check_motor(motor: Any, place: str) -> Motor:
    """The motor itself if it is well formed; raises ConfigError that names what is not."""
    return well_formed(motor, Motor, place, _fault)


def _fault(motor: Motor) -> str:
    """What is wrong with a motor, or nothing."""
    names = tuple(parameter.name for parameter in motor.parameters)
    shape = tuple(name for name, _ in motor.shape)
    if motor.inputs not in (0, 1, 3):
        return f"it has {motor.inputs} inputs, expected 0, 1 or 3"
    if motor.phases and names != (*PHASE_PARAMETERS, *shape):
        return "its parameters are not " + ", ".join((*PHASE_PARAMETERS, "and then those of `shape`"))
    if motor.inputs == 1 and names[:1] != PHASE_PARAMETERS[:1]:
        return f"its first parameter is not {PHASE_PARAMETERS[0]}"
    if motor.inputs and (motor.amplitudes is None) == (motor.thrust is None):
        return "it needs either `amplitudes` or `thrust`"
    if motor.periodic and not motor.phases:
        return "it has `amplitudes`, but not three inputs"
    if motor.constant is not None and not motor.periodic:
        return "it has `constant`, but no `amplitudes`"
    for derived in motor.derived:
        if set(derived.of) - set(names):
            return f"`{derived.name}` follows from {', '.join(derived.of)}, of which some are no parameters of it"
    expected = {"amplitudes": ("out", *shape), "constant": ("z", *shape), "thrust": ("y", "i_1", "i_2", "i_3", *names)}
    faults = (fault_of_arguments(name, function, expected[name]) for name, function in motor.terms.items())
    return next(filter(None, faults), "")
