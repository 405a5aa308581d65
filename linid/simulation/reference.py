"""A slow twin of the compiled simulation on scipy, written from the equations alone; for tests and benchmarks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import PPoly

from linid.arrays import Array
from linid.physics.effects.effect import Effect
from linid.physics.effects.registry import EFFECTS
from linid.physics.motors.registry import MOTORS
from linid.recording.input_course import input_coefficients
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
    """Motor force in N at position y (m), from eqs. 31 and 39; of motors that are not linid's own by their terms.

    values: SI by name of parameter; currents: (3,) inputs in A.
    """
    motor = MOTORS[kind]
    if kind == "force":
        return values["force_constant"] * float(currents[0])
    if kind == "friction":
        return 0.0
    if motor.thrust is not None:
        return float(motor.thrust.py_func(y, *map(float, currents), *(values[p.name] for p in motor.parameters)))
    density, displacement, shift = (
        values["electrical_wavenumber"],
        values["winding_displacement"],
        values["commutation_offset"],
    )
    total = 0.0
    for j in (1, 2, 3):
        angle = density * y + displacement * (j - 2) + shift
        if kind == "theta":
            shape = _theta0(angle, values["nome"], values["winding_length"])
        else:
            shape = sum(a * math.sin(motor.turns * n * angle) for n, a in motor.spectrum(values).items())
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


@dataclass(frozen=True)
class Friction:
    """The LuGre model's parameters. coulomb, static: N; stribeck: m/s; exponent: dimensionless; sigma_0: N/m; sigma_1,
    sigma_2: N s/m."""

    coulomb: float
    static: float
    stribeck: float
    exponent: float
    sigma_0: float
    sigma_1: float
    sigma_2: float

    @classmethod
    def of(cls, values: dict[str, float]) -> Friction:
        """From values by canonical parameter name, SI."""
        return cls(
            values["coulomb_force"],
            values["static_force"],
            values["stribeck_velocity"],
            values["stribeck_exponent"],
            values["bristle_stiffness"],
            values["bristle_damping"],
            values["viscous_friction"],
        )

    def level(self, v: float) -> float:
        """The Stribeck curve g(v) in N."""
        return self.coulomb + (self.static - self.coulomb) * math.exp(-(abs(v / self.stribeck) ** self.exponent))


@dataclass(frozen=True)
class _Run:
    """What acts on the axis during one recording: its equations (40-45 as corrected) with all effects or without any.

    inputs: the three between their samples (None: none acts); t: the recording's first and last instant, s.
    """

    kind: str
    values: dict[str, float]
    friction: Friction
    terms: _Terms
    inputs: PPoly | None
    t: tuple[float, float]
    mass: float
    delay: float

    def arguments(self, time: float, y: float, v: float) -> tuple[float, ...]:
        """What every term of an effect is told: t, y, v and the delayed inputs."""
        if self.inputs is None:
            return (time, y, v, 0.0, 0.0, 0.0)
        return (time, y, v, *(float(i) for i in self.inputs(min(max(time - self.delay, self.t[0]), self.t[1]))))

    def rates(self, time: float, state: Array) -> Array:
        """Time derivatives of y, v, w and the hidden states."""
        terms, friction = self.terms, self.friction
        y, v, w = (float(x) for x in state[:3])
        hidden = state[3:]
        arguments = self.arguments(time, y, v)
        driven = arguments
        force = 0.0
        if self.inputs is not None:
            driven = terms.chain("drive", arguments, hidden)
            seen = terms.chain("field", driven, hidden)[1]
            force = motor_force(self.kind, self.values, seen, np.array(driven[3:]))
            force *= math.prod(terms.values("thrust", driven, hidden))
        level = friction.level(v)
        level += sum(terms.values("load", arguments, hidden, (force,)))
        level *= math.prod(terms.values("level", arguments, hidden))
        w_rate = v - friction.sigma_0 * abs(v) * w / level
        grip = math.prod(terms.values("friction", arguments, hidden))
        resistance = grip * (friction.sigma_0 * w + friction.sigma_1 * w_rate) + friction.sigma_2 * v
        force += sum(terms.values("force", driven, hidden))
        a = (force - resistance) / self.mass
        return np.concatenate([[v, a, w_rate], terms.rates(arguments, a, hidden)])

    def rates_without_effects(self, time: float, state: Array) -> list[float]:
        """The same without effects and so without a delay: for they take most of the time."""
        y, v, w = state
        friction = self.friction
        w_rate = v - friction.sigma_0 * abs(v) * w / friction.level(v)
        resistance = friction.sigma_0 * w + friction.sigma_1 * w_rate + friction.sigma_2 * v
        force = 0.0 if self.inputs is None else motor_force(self.kind, self.values, y, self.inputs(time))
        return [v, (force - resistance) / self.mass, w_rate]


def _run_of(kind: str, values: dict[str, float], recording: Recording, effects: tuple[str, ...]) -> _Run:
    t = recording.t
    channels = recording.inputs
    spline = None
    if channels is not None and np.any(channels):
        courses = np.zeros((4, t.size - 1, 3))  # highest powers first
        between = input_coefficients(recording, np.atleast_2d(channels))
        courses[::-1, :, : len(between)] = between.transpose(2, 1, 0)
        spline = PPoly(courses, t)
    chosen = [effect for effect in EFFECTS if effect.name in effects]
    terms = _Terms(
        tuple((e, tuple(values.get(p.name, p.default) for p in e.parameters)) for e in chosen),
        float(recording.number),
        recording.elapsed,
    )
    mass = values["mass"] + recording.added_mass
    mass += sum(e.mass.py_func(terms.record, *own) for e, own in terms.active if e.mass is not None)
    delay = sum(e.delay.py_func(*own) for e, own in terms.active if e.delay is not None)
    more = sum(e.static.py_func(*own) for e, own in terms.active if e.static is not None)
    known = values | {"static_force": max(values["static_force"] + more, values["coulomb_force"])} if more else values
    return _Run(kind, values, Friction.of(known), terms, spline, (float(t[0]), float(t[-1])), mass, delay)


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

    values: canonical parameter name -> SI value; start: y in m, v in m/s, w in m; effects: names of those that act;
    rtol: relative tolerance, dimensionless; max_step: s. Raises RuntimeError when scipy gives up.
    """
    t, run = recording.t, _run_of(kind, values, recording, effects)
    first = np.concatenate([start, run.terms.initial(run.arguments(float(t[0]), start[0], start[1]))])
    solution = solve_ivp(
        run.rates if run.terms.active else run.rates_without_effects,
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
        y + sum(run.terms.values("sensor", run.arguments(time, y, v), hidden))
        for time, y, v, hidden in zip(t, solution.y[0], solution.y[1], solution.y[3:].T, strict=True)
    ]
    return np.array(reading), solution.y[1]
