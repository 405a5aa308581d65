"""A slow twin of the compiled simulation on scipy, written from the equations alone; for tests and benchmarks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from linid.arrays import Array
from linid.physics.effects.effect import Effect
from linid.physics.effects.registry import EFFECTS
from linid.recording.recording import Recording

_SHORT = 1e-7  # s, of the advance from which a hidden state's rate is taken


def _theta0(z: float, q: float, z_L: float) -> float:
    """Theta0 from the double Gaussian-free definition: differences of theta3 series (eqs. 33, 36, 37)."""

    def theta3(x: float) -> float:
        reach = 3 + math.ceil(math.sqrt(40.0 / -math.log(q)))
        return 1.0 + 2.0 * sum(q ** (n * n) * math.cos(2 * n * x) for n in range(1, reach))

    def theta(x: float) -> float:
        return theta3(x) - theta3(x - math.pi / 2)

    return theta(z - z_L) - theta(z + z_L)


def motor_force(kind: str, values: dict[str, float], y: float, currents: Array) -> float:
    """Motor force in N at position y (m) and phase currents (3,) A, from eqs. 31 and 39."""
    if kind == "force":
        return values["force_constant"] * float(currents[0])
    if kind == "friction":
        return 0.0
    density, displacement, shift = (
        values["electrical_wavenumber"],
        values["winding_displacement"],
        values["commutation_offset"],
    )
    total = 0.0
    for j in (1, 2, 3):
        angle = density * y + displacement * (j - 2) + shift
        shape = math.sin(angle) if kind == "sine" else _theta0(angle, values["nome"], values["winding_length"])
        total += shape * float(currents[j - 1])
    return values["force_constant"] * total


@dataclass(frozen=True)
class _Terms:
    """The effects of a model as plain Python functions: (effect, its parameter values) in their order."""

    active: tuple[tuple[Effect, tuple[float, ...]], ...]
    record: float
    elapsed: float

    def values(
        self, name: str, arguments: tuple[float, ...], states: Array, before: tuple[float, ...] = ()
    ) -> list[float]:
        """Values of one term of all effects that have it; arguments: t, y, v, i_1, i_2, i_3, after those `before`."""
        out = []
        for index, (effect, parameters) in enumerate(self.active):
            function = effect.terms.get(name)
            if function is not None:
                out.append(function.py_func(*before, *self._all(name, arguments, states, index), *parameters))
        return out

    def chain(self, name: str, arguments: tuple[float, ...], states: Array) -> tuple[float, ...]:
        """Arguments after every `drive` (which replaces the inputs) or `field` (which replaces the position)."""
        for index, (effect, parameters) in enumerate(self.active):
            function = effect.terms.get(name)
            if function is not None:
                result = function.py_func(*self._all(name, arguments, states, index), *parameters)
                arguments = (*arguments[:3], *result) if name == "drive" else (arguments[0], result, *arguments[2:])
        return arguments

    def rates(self, arguments: tuple[float, ...], a: float, states: Array) -> Array:
        """Time derivatives of the hidden states, from a very short advance."""
        out = np.zeros_like(states)
        for index, (effect, parameters) in enumerate(self.active):
            if effect.advance is not None:
                t, y, v, *rest = self._all("advance", arguments, states, index)
                after = effect.advance.py_func(_SHORT, t, y, v, a, *rest, *parameters)
                own = self._own(index)
                out[own] = (np.array(after) - states[own]) / _SHORT
        return out

    def initial(self, arguments: tuple[float, ...]) -> Array:
        """Hidden states at the start."""
        states = np.zeros(sum(effect.states for effect, _ in self.active))
        for index, (effect, parameters) in enumerate(self.active):
            if effect.initial is not None:
                known = self._all("initial", arguments, states, index)
                states[self._own(index)] = effect.initial.py_func(*known, *parameters)
        return states

    def _own(self, index: int) -> slice:
        """Where an active effect's hidden states are among all."""
        first = sum(effect.states for effect, _ in self.active[:index])
        return slice(first, first + self.active[index][0].states)

    def _all(self, name: str, arguments: tuple[float, ...], states: Array, index: int) -> tuple[float, ...]:
        """The arguments of a term before its parameters; states that nothing advances are zero."""
        effect = self.active[index][0]
        own = states[self._own(index)] if effect.states else np.zeros(effect.states_of(name))
        own = own[: effect.states_of(name)]
        return (*arguments, self.record, self.elapsed + arguments[0], *map(float, own))


def simulate_reference(
    kind: str,
    values: dict[str, float],
    recording: Recording,
    start: tuple[float, float, float],
    *,
    effects: tuple[str, ...] = (),
    rtol: float = 1e-9,
    method: str = "LSODA",
    max_step: float | None = None,
) -> tuple[Array, Array]:
    """Position reading (n,) m and velocity (n,) m/s by scipy.integrate.solve_ivp; eqs. 40-45 as corrected.

    values: canonical parameter name -> SI value; start: y, v, w; effects: names of those that act. Raises
    RuntimeError when scipy gives up.
    """
    t = recording.t
    channels = recording.phase_currents if recording.phase_currents is not None else recording.drive_input
    spline = None
    if channels is not None and np.any(channels):
        rows = np.zeros((3, t.size))
        rows[: np.atleast_2d(channels).shape[0]] = channels
        spline = CubicSpline(t, rows, axis=1)
    chosen = [effect for effect in EFFECTS if effect.name in effects]
    terms = _Terms(
        tuple((e, tuple(values.get(p.name, p.default) for p in e.parameters)) for e in chosen),
        float(recording.number),
        recording.elapsed,
    )
    mass = values["mass"] + recording.added_mass
    mass += sum(e.mass.py_func(terms.record, *own) for e, own in terms.active if e.mass is not None)
    delay = sum(e.delay.py_func(*own) for e, own in terms.active if e.delay is not None)
    sigma_0, sigma_1, sigma_2 = values["bristle_stiffness"], values["bristle_damping"], values["viscous_friction"]
    coulomb, static = values["coulomb_force"], values["static_force"]
    v_s, alpha = values["stribeck_velocity"], values["stribeck_exponent"]

    def arguments_at(time: float, y: float, v: float) -> tuple[float, ...]:
        if spline is None:
            return (time, y, v, 0.0, 0.0, 0.0)
        return (time, y, v, *(float(i) for i in spline(min(max(time - delay, t[0]), t[-1]))))

    def right_hand_side(time: float, state: Array) -> Array:
        y, v, w = (float(x) for x in state[:3])
        hidden = state[3:]
        arguments = arguments_at(time, y, v)
        driven = arguments
        force = 0.0
        if spline is not None:
            driven = terms.chain("drive", arguments, hidden)
            seen = terms.chain("field", driven, hidden)[1]
            force = motor_force(kind, values, seen, np.array(driven[3:]))
            force *= math.prod(terms.values("thrust", driven, hidden))
        level = coulomb + (static - coulomb) * math.exp(-(abs(v / v_s) ** alpha))
        level += sum(terms.values("load", arguments, hidden, (force,)))
        level *= math.prod(terms.values("level", arguments, hidden))
        w_rate = v - sigma_0 * abs(v) * w / level
        grip = math.prod(terms.values("friction", arguments, hidden))
        resistance = grip * (sigma_0 * w + sigma_1 * w_rate) + sigma_2 * v
        force += sum(terms.values("force", driven, hidden))
        a = (force - resistance) / mass
        return np.concatenate([[v, a, w_rate], terms.rates(arguments, a, hidden)])

    def without_effects(time: float, state: Array) -> list[float]:
        y, v, w = state
        level = coulomb + (static - coulomb) * math.exp(-(abs(v / v_s) ** alpha))
        w_rate = v - sigma_0 * abs(v) * w / level
        resistance = sigma_0 * w + sigma_1 * w_rate + sigma_2 * v
        force = 0.0 if spline is None else motor_force(kind, values, y, spline(time))
        return [v, (force - resistance) / mass, w_rate]

    first = np.concatenate([start, terms.initial(arguments_at(float(t[0]), start[0], start[1]))])
    solution = solve_ivp(
        right_hand_side if chosen else without_effects,
        (t[0], t[-1]),
        first,
        method=method,
        t_eval=t,
        rtol=rtol,
        atol=np.concatenate([[1e-11, 1e-10, 1e-13], np.full(first.size - 3, 1e-10)]),
        max_step=np.inf if max_step is None else max_step,
    )
    if not solution.success:
        raise RuntimeError(f"reference integration stopped: {solution.message}")
    reading = [
        y + sum(terms.values("sensor", arguments_at(time, y, v), hidden))
        for time, y, v, hidden in zip(t, solution.y[0], solution.y[1], solution.y[3:].T, strict=True)
    ]
    return np.array(reading), solution.y[1]
