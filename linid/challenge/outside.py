"""Causes outside the library: no listed effect has their formula, so an honest diagnosis calls them unknown.

`DEPENDS_ON` says what each depends on. Arguments, in an engineer's words: `position`; `velocity`; `direction` of
motion; `motor_force` or current; `acceleration`; `time` in the recording; `campaign_time`, running time of all
recordings one after the other; `travel` since the last reversal (before one: since the start); `rest_time` before the
last breakaway. (A resonance of the machine base is not among them: seen from the forcer it is the transfer function of
a flexible load.)
"""

from __future__ import annotations

from dataclasses import dataclass

from linid.challenge.entries import (
    BOTH,
    AxisSizes,
    Entry,
    Random,
    constant,
    coulombs,
    even,
    log_even,
    nothing,
    phase,
    waves,
)
from linid.challenge.kernel import layout

ARGUMENTS = {
    "position": "place on the track, also within a pole pitch or another period",
    "velocity": "speed and its sign",
    "direction": "sign of the velocity alone",
    "motor_force": "thrust or current",
    "acceleration": "acceleration",
    "time": "time since the recording began",
    "campaign_time": "running time of all recordings, one after the other in the order of campaign.yaml",
    "travel": "distance since the last reversal (before one: since the start)",
    "rest_time": "how long the axis rested before the last breakaway",
}
LAG = 1.5e-3  # s, in which a body feels an acceleration: as fast as no sample shows


@dataclass(frozen=True)
class Outside:
    """A cause. physics: what acts; arguments: what it depends on, the main one first; repeats: whether recordings tell
    of each other what it does (not: a random walk, or a phase that every recording has for itself)."""

    physics: str
    arguments: tuple[str, ...]
    entry: Entry
    repeats: bool = True


def _place(r: Random, s: AxisSizes, width: tuple[float, float] = (0.015, 0.035)) -> dict[str, float]:
    """A place that driven recordings pass, and its width, in m."""
    return {"centre": s.stroke / 2 + s.reach * even(r, -0.45, 0.45), "width": s.stroke * even(r, *width)}


def _walk(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"memory": even(r, 0.15, 0.4), "seed": float(r.integers(2**31))}


def _felt(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"half_acceleration": even(r, 1.0, 4.0), "lag": LAG}


def _speed_cogging(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"turning_speed": even(r, 0.3, 0.6), "phase": phase(r)}


def _phase_only(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"phase": phase(r)}


def _gated(r: Random, s: AxisSizes) -> dict[str, float]:
    return {
        "frequency": log_even(r, 9, 20),
        "phase": phase(r),
        "speed": even(r, 0.2, 0.45),
        "speed_width": even(r, 0.03, 0.08),
    }


def _soft_rail(r: Random, s: AxisSizes) -> dict[str, float]:
    return {**_place(r, s), "force": s.coulomb * even(r, 2.0, 4.0)}


def _chain(r: Random, s: AxisSizes) -> dict[str, float]:
    """One period forth, and one back that is a good deal longer or shorter, in m."""
    forth = log_even(r, 20e-3, 45e-3)
    back = forth * even(r, 1.3, 1.7) if r.random() < 0.5 else forth / even(r, 1.3, 1.7)
    return {"forth_period": forth, "forth_phase": phase(r), "back_period": back, "back_phase": phase(r)}


def _resonance(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"speed": even(r, 0.25, 0.6), "speed_width": even(r, 0.04, 0.1)}


def _feed_line(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"from": s.stroke / 2 + s.reach * even(r, -0.3, 0.3), "length": s.stroke * even(r, 0.05, 0.12)}


def _loose(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"acceleration": even(r, 4.0, 10.0), "lag": LAG}


def _reversal(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"length": log_even(r, 5e-3, 30e-3)}


def _grip(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"force": s.coulomb * even(r, 2.5, 4.5), "force_width": s.coulomb * even(r, 0.5, 1.0)}


def _coolant(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"period": even(r, 12.0, 30.0), "phase": phase(r)}


def _ball_pass(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"period": log_even(r, 6e-3, 25e-3), "phase": phase(r)}


def _film(r: Random, s: AxisSizes) -> dict[str, float]:
    return {"recovery_time": log_even(r, 0.05, 0.3), "wear_length": log_even(r, 5e-3, 20e-3)}


CAUSES: dict[str, Outside] = {
    "floor_vibration": Outside(
        "the floor shakes at one frequency; each recording begins at some moment of it",
        ("time",),
        Entry(layout.VIBRATION, "all", coulombs(0.2), coulombs(4), waves(7, 25)),
        repeats=False,
    ),
    "clock_beat": Outside(
        "the encoder is read at an instant that sways about the sampling instant",
        ("time", "velocity"),
        Entry(None, "all", constant(5e-5), constant(3e-3), waves(8, 25)),
    ),
    "walking_friction": Outside(
        "friction walks at random",
        ("time", "direction"),
        Entry(layout.WALK, "all", constant(0.1), constant(0.8), _walk),
        repeats=False,
    ),
    "speed_derating": Outside(
        "thrust per ampere falls with speed",
        ("velocity", "motor_force"),
        Entry(layout.SPEED_DERATING, "driven", constant(0.1), constant(3.0), nothing),
    ),
    "wandering_force": Outside(
        "a force walks at random",
        ("time",),
        Entry(layout.WANDER, "all", coulombs(0.1), coulombs(2), _walk),
        repeats=False,
    ),
    "acceleration_dependent_friction": Outside(
        "friction grows with acceleration, as where a carriage tilts",
        ("acceleration", "direction"),
        Entry(layout.ACCELERATION_FRICTION, "all", constant(0.2), constant(6.0), _felt),
    ),
    "speed_dependent_cogging": Outside(
        "cogging that grows and whose phase turns with speed",
        ("position", "velocity"),
        Entry(layout.SPEED_COGGING, "all", coulombs(0.3), coulombs(6), _speed_cogging),
    ),
    "reluctance_force": Outside(
        "a force that goes with the square of the current and turns with the pole pitch",
        ("position", "motor_force"),
        Entry(
            layout.RELUCTANCE,
            "driven",
            lambda s: 0.1 * s.thrust / s.current,
            lambda s: 3 * s.thrust / s.current,
            _phase_only,
        ),
    ),
    "gated_vibration": Outside(
        "an exciter that starts with the recording shakes the axis, but only above a speed",
        ("time", "velocity"),
        Entry(layout.GATED_VIBRATION, "all", coulombs(0.2), coulombs(4), _gated),
    ),
    "soft_rail": Outside(
        "at one place the rail gives way and costs force, but only where the motor pushes hard",
        ("position", "motor_force"),
        Entry(layout.SOFT_RAIL, "driven", coulombs(0.3), coulombs(3), _soft_rail),
    ),
    "place_damping": Outside(
        "at one place a damper, such as a sheet between magnets",
        ("position", "velocity"),
        Entry(layout.PLACE_DAMPING, "all", coulombs(0.3), coulombs(20), _place),
    ),
    "chain_ripple": Outside(
        "a chain's links roll over a guide with one period on the way forth, and another one back",
        ("position", "direction"),
        Entry(layout.CHAIN, "all", coulombs(0.2), coulombs(4), _chain),
    ),
    "place_magnet": Outside(
        "a magnet beside the track pulls to one place, or pushes away from it",
        ("position",),
        Entry(layout.MAGNET, "all", coulombs(0.2), coulombs(2), _place, BOTH),
    ),
    "resonance_drag": Outside(
        "at one speed the frame resonates and takes up power",
        ("velocity",),
        Entry(layout.RESONANCE, "all", coulombs(0.2), coulombs(4), _resonance),
    ),
    "feed_line_derating": Outside(
        "thrust per ampere falls with speed, and only towards one end, as where the feed line is long",
        ("velocity", "position", "motor_force"),
        Entry(layout.FEED_LINE, "driven", constant(0.2), constant(6.0), _feed_line),
    ),
    "supply_ripple": Outside(
        "the supply's voltage sways, and thrust per ampere with it; its phase starts with the recording",
        ("time", "motor_force"),
        Entry(layout.SUPPLY, "driven", constant(0.05), constant(0.6), waves(6, 20)),
    ),
    "loose_mass": Outside(
        "a mass in a flat socket: it is carried only by large accelerations",
        ("acceleration",),
        Entry(layout.LOOSE, "all", lambda s: 0.2 * s.mass, lambda s: 2.5 * s.mass, _loose),
    ),
    "reversal_friction": Outside(
        "friction is higher after a reversal and wears in over some millimetres, as where seals turn over",
        ("travel", "direction"),
        Entry(layout.REVERSAL, "all", constant(0.2), constant(5.0), _reversal),
    ),
    "thrust_grip": Outside(
        "friction is higher about one thrust, at which the carriage cants",
        ("motor_force", "direction"),
        Entry(layout.GRIP, "driven", constant(0.2), constant(8.0), _grip),
    ),
    "coolant_cycle": Outside(
        "friction sways with the campaign's running time, as a cooler switches on and off",
        ("campaign_time", "direction"),
        Entry(layout.COOLANT, "all", constant(0.1), constant(0.8), _coolant),
    ),
    "ball_pass_friction": Outside(
        "friction sways with a period in position that is not the pole pitch, as balls enter the race",
        ("position", "direction"),
        Entry(layout.BALL_PASS, "all", constant(0.1), constant(0.8), _ball_pass),
    ),
    "film_recovery": Outside(
        "a starved film of oil recovers at rest: after it friction is lower for some millimetres",
        ("rest_time", "direction"),
        Entry(layout.FILM, "driven", constant(0.3), constant(0.85), _film, most=0.3),
    ),
}
OUTSIDE: dict[str, Entry] = {name: cause.entry for name, cause in CAUSES.items()}
DEPENDS_ON: dict[str, tuple[str, ...]] = {name: cause.arguments for name, cause in CAUSES.items()}
