"""A model in the closed loops of a drive that follows a reference."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from linid.arrays import Array
from linid.physics.model import Model
from linid.recording.recording import Recording
from linid.recording.splines import cubic_spline_coefficients
from linid.simulation.inputs import Inputs, pack_inputs
from linid.simulation.run import Simulator, whole_recordings
from linid.simulation.steering import Steering

if TYPE_CHECKING:
    from linid.simulation.controller import Controller


@dataclass(frozen=True)
class ClosedLoop:
    """How a simulated axis follows a reference, (n,) arrays at its samples.

    t: s; reference, y: commanded and simulated position in m (rotary: rad), as the encoder reads it; v: m/s (rad/s);
    current: q-current in A, of the cycle that begins with the sample.
    """

    t: Array
    reference: Array
    y: Array
    v: Array
    current: Array

    @property
    def following_error(self) -> Array:
        """Commanded minus simulated position, (n,) in m."""
        return self.reference - self.y


@dataclass(frozen=True)
class Command:
    """What a drive commands in each of n cycles of dt s, (n,) arrays at their beginnings: y in m, v in m/s, a in m/s^2;
    cycles: per sample of the reference."""

    y: Array
    v: Array
    a: Array
    dt: float
    cycles: int


def command_of(reference: Recording, controller: Controller) -> Command:
    """The command of every cycle: cycles are made to divide the sampling period of the reference, which is a cubic
    spline between its samples. reference: recording whose `y` is the commanded position.
    """
    cycles = max(1, round(reference.duration / (reference.t.size - 1) / controller.cycle_time_s))
    dt = reference.duration / (cycles * (reference.t.size - 1))
    spline = cubic_spline_coefficients(cycles * dt, reference.y)[0]
    share = (np.arange(cycles) * dt)[:, None] ** np.arange(4)
    y = (spline @ share.T).ravel()
    v = ((spline[:, 1:] * np.arange(1, 4)) @ share[:, :3].T).ravel()
    a = ((spline[:, 2:] * (2.0, 6.0)) @ share[:, :2].T).ravel()
    return Command(y, v, a, dt, cycles)


@dataclass(frozen=True)
class Loops:
    """A drive's loops along a reference, for one axis after the other: what each run commands lands in the inputs.

    reference: recording whose `y` is the commanded position; command: of every cycle; inputs: packed, of all cycles.
    """

    controller: Controller
    reference: Recording
    command: Command
    inputs: Inputs

    @classmethod
    def along(cls, reference: Recording, controller: Controller) -> Loops:
        """The loops of a drive along a reference, of which nothing has been run."""
        command = command_of(reference, controller)
        y = command.y
        t = reference.t[0] + np.linspace(0.0, reference.duration, y.size + 1)
        empty = Recording("reference", t, np.append(y, reference.y[-1]), kind="motor", number=reference.number)
        empty = replace(empty, added_mass=reference.added_mass, elapsed=reference.elapsed)
        return cls(controller, reference, command, pack_inputs([empty])._replace(powered=np.array([True])))

    def run(
        self,
        model: Model,
        values: dict[str, float],
        start: tuple[float | None, float] = (None, 0.0),
        substeps: int = 2,
        *,
        ahead: Array | None = None,
    ) -> ClosedLoop:
        """Run a motor in these loops; arguments as of `follow`."""
        command, reference = self.command, self.reference
        y, cycles = command.y, command.cycles
        steering = _steering(model, values, self.controller, command, np.zeros(y.size) if ahead is None else ahead)
        simulator = Simulator(model, self.inputs, substeps, steering=steering)
        state = np.array([[[y[0] if start[0] is None else start[0], start[1], math.nan]]])
        vector = model.vector(values)[None, :]
        out_y, out_v, _ = simulator.run(vector, whole_recordings(self.inputs), state, velocity=True)
        current = np.append(steering.current, steering.current[-1])
        return ClosedLoop(reference.t, reference.y, out_y[0, ::cycles], out_v[0, ::cycles], current[::cycles])


def follow(
    model: Model,
    values: dict[str, float],
    controller: Controller,
    reference: Recording,
    start: tuple[float | None, float] = (None, 0.0),
    substeps: int = 2,
    *,
    ahead: Array | None = None,
) -> ClosedLoop:
    """Run a motor in a drive's cascade: position P, velocity PI, current limit (the paper's modes of operation).

    values: SI by canonical name; reference: recording whose `y` is the commanded position; start: position in m (None:
    that commanded first) and speed in m/s; substeps: internal steps per cycle at least; ahead: (cycles,) A, what the
    motor is given besides in every cycle of `command_of`, with the sign of its force constant, before the current
    limit (None: nothing).
    """
    return Loops.along(reference, controller).run(model, values, start, substeps, ahead=ahead)


def _commutation(model: Model, values: dict[str, float]) -> tuple[float, float, float]:
    """Wavenumber in rad/m, offset in rad and polarity of the drive's commutation to the motor's first harmonic."""
    constant = values.get("force_constant", 1.0)
    if not model.phases:
        return 0.0, 0.0, math.copysign(1.0, constant)
    # Phases that are not 120 degrees apart push together by so much of three.
    apart = model.turns * values["winding_displacement"] - 2.0 * math.pi / 3.0
    constant = model.driven_by.fundamental(constant, values) * (1.0 + 2.0 * math.cos(apart))
    wavenumber, offset = values["electrical_wavenumber"], values["commutation_offset"]
    return model.turns * wavenumber, model.turns * offset, math.copysign(1.0, constant)


def measured_q_current(model: Model, values: dict[str, float], recording: Recording) -> Array:
    """The q-current (n,) in A that the logged phase currents of a recording amount to along the model's own field.

    values: SI by canonical name.
    """
    assert recording.phase_currents is not None
    wavenumber, offset, polarity = _commutation(model, values)
    angles = wavenumber * recording.y + offset + np.arange(-1, 2)[:, None] * 2.0 * math.pi / 3.0
    return np.asarray(polarity * np.sum(recording.phase_currents * np.sin(angles), axis=0) / 1.5)


def _steering(
    model: Model, values: dict[str, float], controller: Controller, command: Command, ahead: Array
) -> Steering:
    """The drive's cascade along a command, with the commutation that fits the motor's first harmonic."""
    lag = controller.current_time_constant_s
    wavenumber, offset, polarity = _commutation(model, values)
    return Steering(
        y=command.y,
        v=command.v,
        ahead=polarity * ahead,
        current=np.zeros(command.y.size),
        integral=np.zeros(1),
        position_gain=controller.position_gain_per_s,
        velocity_gain=controller.velocity_gain_a_s_per_m,
        integral_gain=controller.integral_gain,
        feedforward=controller.velocity_feedforward,
        limit=controller.current_limit_a,
        share=1.0 - math.exp(-command.dt / lag) if lag > 0.0 else 1.0,
        wavenumber=wavenumber,
        offset=offset,
        polarity=polarity,
        phases=3 if model.phases else 1,
    )
