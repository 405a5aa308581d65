"""The MJCF text of a model in MuJoCo's form (XML reference of MuJoCo 4, `actuator/dcmotor`)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from linid.export.simpler import number

if TYPE_CHECKING:
    from collections.abc import Iterable

    from linid.physics.model import Model

# MuJoCo steps bristles explicitly: this step, halved until the bristle turns and decays slowly within one.
_STEP, _LEAST_STEP = 1e-4, 1e-6  # s
_TURN, _DECAY = 0.25, 0.5
# Every dcmotor has an electrical branch, and before MuJoCo 4.0 a control. With a motor constant this small nothing
# comes of either, whatever the control; with a resistance as small, the force is the control itself.
_SMALL = 1e-9
_PASSIVE = f'joint="axis" motorconst="{_SMALL}" resistance="1"'
_HALF_TURN = "1.5707963267948966"  # cogging with no wave and this phase is a constant
_ORDERS = range(1, 9)
_LINK = 1e-6  # of a rotor's inertia, in the link that MuJoCo wants to have some


def step_of(values: dict[str, float]) -> float:
    """Step in s at which MuJoCo's explicit bristle stays stable and near the exact one. values: SI by name."""
    stiffness, mass = values["bristle_stiffness"], values["mass"]
    turn = math.sqrt(stiffness / mass)
    decay = values["bristle_damping"] / mass
    step = _STEP
    while step > _LEAST_STEP and (step * turn > _TURN or step * decay > _DECAY):
        step *= 0.5
    return step


def _element(name: str, **attributes: str) -> str:
    inside = "".join(f" {key}={quoteattr(text)}" for key, text in attributes.items())
    return f'    <dcmotor name="{name}" {_PASSIVE}{inside}/>'


def _wave(name: str, wavenumber: float, sine: float, cosine: float) -> str:
    """A force sine sin(k y) + cosine cos(k y) as cogging."""
    texts = (math.hypot(sine, cosine), wavenumber, math.atan2(cosine, sine))
    return _element(name, cogging=" ".join(map(number, texts)))


def _constant(name: str, force: float) -> str:
    return _element(name, cogging=f"{number(force)} 0 {_HALF_TURN}")


def _has_hysteresis(values: dict[str, float], effects: tuple[str, ...]) -> bool:
    return "cable_force" in effects and values["cable_hysteresis"] > 0.0


def _passive_effects(values: dict[str, float], effects: tuple[str, ...]) -> Iterable[str]:
    """One element for each wave, constant and bristle of the effects."""
    if "cogging" in effects:
        for k in _ORDERS:
            sine, cosine = values.get(f"cogging_sine_{k}", 0.0), values.get(f"cogging_cosine_{k}", 0.0)
            if sine or cosine:
                order = values.get(f"cogging_order_{k}", 0.0)
                yield _wave(f"cogging_{k}", order * values["cogging_wavenumber"], sine, cosine)
    if "gravity" in effects:
        yield _wave("gravity", 1.0, values["gravity_sine"], values["gravity_cosine"])
    if values.get("constant_force"):
        yield _constant("constant_force", values["constant_force"])
    if "cable_force" in effects:
        if values["cable_preload"]:
            yield _constant("cable_preload", values["cable_preload"])
        if _has_hysteresis(values, effects):
            # Dahl's hysteresis is LuGre's without damping and with one level.
            force = values["cable_hysteresis"]
            texts = (force / values["cable_hysteresis_length"], 0.0, force, force, 1.0)
            yield _element("cable_hysteresis", lugre=" ".join(map(number, texts)))


def _delay(model: Model, values: dict[str, float]) -> float:
    return values["input_delay"] if "input_delay" in model.effects else 0.0


def _voltage_driven(values: dict[str, float]) -> str:
    """The motor with its windings, whose control is the q-voltage times the square root of 3/2: with that root in the
    current too, thrust per current and back-EMF per speed are the same number, as `dcmotor` wants it.
    """
    inductance = values["phase_inductance"] - values.get("mutual_inductance", 0.0)
    constants = {
        "motorconst": math.sqrt(1.5) * values["force_constant"],
        "resistance": values["phase_resistance"],
        "inductance": inductance,
    }
    motor = " ".join(f'{name}="{number(x)}"' for name, x in constants.items())
    return f'    <dcmotor name="thrust" joint="axis" {motor}/>'


def _thrust(model: Model, values: dict[str, float], step: float) -> Iterable[str]:
    """The motor: its control is the q-current (or the one input), its gear the thrust per current."""
    if not model.driven_by.inputs:
        return
    if model.winding:
        yield _voltage_driven(values)
        return
    gear = values["force_constant"] * (1.5 if model.phases else 1.0)
    more = ""
    if "thermal_derating" in model.effects:
        # So that the temperature is the steady sum of squares, A^2: of a loss of control^2 / resistance.
        resistance = _SMALL * (1.5 if model.phases else 1.0)
        capacity = values["thermal_time"] / resistance
        more += f' thermal="{number(resistance)} {number(capacity)} 0 {number(values["derating"])} 0 0"'
    delay = 0.0 if model.phases else _delay(model, values)  # of phase currents, see run_axis.py
    if delay > 0.0:
        more += f' delay="{number(delay)}" nsample="{math.ceil(delay / step) + 2}" interp="linear"'
    motor = f'motorconst="{_SMALL}" resistance="{_SMALL}" gear="{number(gear)}"'
    yield f'    <dcmotor name="thrust" joint="axis" {motor}{more}/>'


def _moving(values: dict[str, float], effects: tuple[str, ...]) -> tuple[float, float]:
    """What moves with the axis itself, and what of that swings on a spring: kg (rotary: kg m^2)."""
    from linid.simulation.forces import LEAST_MASS

    load = values["load_mass"] if "flexible_load" in effects else 0.0
    return max(values["mass"] - load, LEAST_MASS * values["mass"]), load


def _friction(values: dict[str, float], effects: tuple[str, ...], axis: str) -> str:
    drag = values["drag_coefficient"] if "quadratic_drag" in effects else 0.0
    lugre = ("bristle_stiffness", "bristle_damping", "coulomb_force", "static_force", "stribeck_velocity")
    damping = number(values["viscous_friction"]) + (f" {number(drag)}" if drag else "")
    inertia = (1.0 - _LINK) * _moving(values, effects)[0]
    armature = {"armature": number(inertia)} if axis == "rotary" else {}
    return _element("friction", damping=damping, **armature, lugre=" ".join(number(values[name]) for name in lugre))


def _bodies(values: dict[str, float], effects: tuple[str, ...], axis: str) -> list[str]:
    """The moving mass, its spring, and the part of it that swings; a rotor's inertia is the actuator's armature."""
    kind = "hinge" if axis == "rotary" else "slide"
    own, load = _moving(values, effects)

    def inertial(mass: float) -> str:
        inertia = mass if axis == "rotary" else 1.0
        weight = 1.0 if axis == "rotary" else mass
        return f'<inertial pos="0 0 0" mass="{number(weight)}" diaginertia="{" ".join([number(inertia)] * 3)}"/>'

    spring = ""
    if "cable_force" in effects:
        spring = f' stiffness="{number(values["cable_stiffness"])}" springref="{number(values["cable_middle"])}"'
    lines = [
        '    <body name="mover">',
        f'      <joint name="axis" type="{kind}" axis="1 0 0"{spring}/>',
        f"      {inertial(_LINK * own if axis == 'rotary' else own)}",
    ]
    if load:
        omega = 2.0 * math.pi * values["load_frequency"]
        stiffness, damping = load * omega**2, 2.0 * values["load_damping"] * omega * load
        lines += [
            '      <body name="load">',
            f'        <joint name="load" type="{kind}" axis="1 0 0" stiffness="{number(stiffness)}" '
            f'damping="{number(damping)}"/>',
            f"        {inertial(load)}",
            "      </body>",
        ]
    return [*lines, "    </body>"]


@dataclass(frozen=True)
class Notes:
    """What a file says and holds besides the model. name: a word; axis: linear or rotary; lacking: sentences for the
    comment at the top; waves: of own terms, wavenumber in 1/m, sine and cosine in N.
    """

    name: str
    axis: str
    lacking: tuple[str, ...] = ()
    waves: tuple[tuple[float, float, float], ...] = ()


def mjcf(model: Model, values: dict[str, float], notes: Notes) -> str:
    """MJCF of a model in MuJoCo's form. values: SI by name."""
    axis = notes.axis
    step = step_of(values)
    unit = "rad, N m, kg m^2" if axis == "rotary" else "m, N, kg"
    control = "the q-voltage times sqrt(3/2)" if model.winding else "the q-current or the one input"
    comment = [f"{notes.name}: {unit}, s. MuJoCo 3.7 or later. The control is {control}."]
    comment += [f"Not held whole: {line}" for line in notes.lacking] or ["The whole model is held."]
    custom = []
    if model.phases:
        field = ("electrical_wavenumber", "winding_displacement", "commutation_offset")
        scale = math.sqrt(1.5) if model.winding else 1.0
        numbers = (*(values[key] for key in field), 0.0 if model.winding else _delay(model, values), scale)
        custom.append(f'    <numeric name="commutation" data="{" ".join(map(number, numbers))}"/>')
    lugre = ("bristle_stiffness", "coulomb_force", "static_force", "stribeck_velocity")
    cable = values["cable_hysteresis_length"] if _has_hysteresis(values, model.effects) else 0.0
    bristles = (*(values[key] for key in lugre), cable)
    custom.append(f'    <numeric name="bristles" data="{" ".join(map(number, bristles))}"/>')
    lines = [
        f"<mujoco model={quoteattr(notes.name)}>",
        *(f"  <!-- {line.replace('--', '-')} -->" for line in comment),
        '  <compiler angle="radian" autolimits="true"/>',
        "  <!-- Euler: MuJoCo's implicit integrators take a bristle's damping for the whole friction's. -->",
        f'  <option timestep="{number(step)}" integrator="Euler" gravity="0 0 0"/>',
        "  <custom>",
        *custom,
        "  </custom>",
        "  <worldbody>",
        *_bodies(values, model.effects, axis),
        "  </worldbody>",
        "  <actuator>",
        *_thrust(model, values, step),
        _friction(values, model.effects, axis),
        *_passive_effects(values, model.effects),
        *(_wave(f"own_{k}", *wave) for k, wave in enumerate(notes.waves)),
        "  </actuator>",
        "</mujoco>",
    ]
    return "\n".join(lines) + "\n"
