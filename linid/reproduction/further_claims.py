"""The paper's remarks by the way, on guideway, free wheels, magnets and coils, each beside what was found."""

from __future__ import annotations

from linid.physics.field.guideway import k_of
from linid.reproduction.claim import Claim, Verdict
from linid.reproduction.further_evidence import Further
from linid.reproduction.printed import TABLE_3, meant

_SURE = 2.0  # standard deviations
_SMALL = 0.02  # of F_C: a variation along the guideway that matters to nobody
_PRINTED_SHUT = 0.5  # k of magnets without space between them, as the paper has it
_LIKE = 1.2  # times as fast: the simulation springs back as the machine does
_NONE = 1e-3  # of the force itself: a sum over wires in pieces is no better


def further_claims(found: Further) -> tuple[Claim, ...]:
    """Those claims of the paper that carry no result of its own, in the order of its text."""
    return (_coils(found), _shut(found), _recoil(found), _homogeneous(found), _directions(found))


def _coils(found: Further) -> Claim:
    return Claim(
        "The forces between the coils sum to zero.",
        "sec. 3.2",
        "holds" if found.coil_sum < _NONE else "does not hold",
        f"One coil pushes its neighbour with {found.coil_force:.2g} N per squared ampere, and is pushed back: the sum "
        f"over their wires is {found.coil_sum:.1g} of it.",
        "Action and reaction within the rigid forcer. What remains of one coil's field in another is the mutual "
        "inductance, which sec. 3.3 mentions and (31), (39) leave out.",
    )


def _shut(found: Further) -> Claim:
    ratios = list(found.shut_k.values())
    verdict: Verdict = "holds in part" if min(ratios) <= _PRINTED_SHUT <= max(ratios) else "does not hold"
    listed = ", ".join(f"{k:.3g} at a gap of {gap:g} pitches" for gap, k in found.shut_k.items())
    printed = k_of(meant(TABLE_3)["nome"])
    return Claim(
        "k = 0.5 means that there is no space between the magnets.",
        "sec. 4.1",
        verdict,
        f"Magnets as long as the pole pitch: k = {listed}.",
        "It hangs on the air gap, across which the field spreads. The nome of table 3 means k = "
        f"{printed:.3f}, beyond 0.5: a recording tells k by the thrust's third harmonic, which magnets of two thirds "
        "of the pole pitch hardly have either.",
    )


def _recoil(found: Further) -> Claim:
    measured, simulated = found.recoil
    own = simulated > 0.0 and 1.0 / _LIKE < measured / simulated < _LIKE
    return Claim(
        "The overshoot of the velocity at the end of a free wheel comes from measuring it.",
        "sec. 5.1",
        "does not hold" if own else "cannot be told",
        f"Free wheels run back by up to {1e3 * measured:.2g} mm/s; the friction model, which nobody measures, by "
        f"{1e3 * simulated:.2g} mm/s.",
        "A forcer that comes to rest hangs on its bristles and springs back: with table 1 it swings at 22 Hz with a "
        "damping of 0.57, and of 0.35 with 1 kg added, where the paper saw the overshoot most.",
    )


def _homogeneous(found: Further) -> Claim:
    change, deviation = found.along
    none, told = abs(change) < max(_SURE * deviation, _SMALL), _SURE * deviation < _SMALL
    verdict: Verdict = "cannot be told" if not told else "holds" if none else "does not hold"
    return Claim(
        "The guideway is homogeneous: the friction does not depend on the position.",
        "sec. 5.1",
        verdict,
        f"Over the stroke that the free wheels cover the friction changes by {100 * change:+.2g} % of F_C, standard "
        f"deviation {100 * deviation:.2g} %.",
        "The paper gives no number. Free wheels at several places do tell it; this guideway was generated alike "
        "everywhere.",
    )


def _directions(found: Further) -> Claim:
    difference, deviation = found.directions
    drifts = ", ".join(f"{name} {1e3 * drift:+.2g} mm" for name, drift in found.square_drift.items())
    same = abs(difference) < max(_SURE * deviation, _SMALL)
    return Claim(
        "Under square waves the forcer drifts, for friction is lower at negative speed.",
        "sec. 5.3",
        "cannot be told" if same else "holds in part",
        f"Measured position, a straight line through it: {drifts}. By the free wheels the friction of the two "
        f"directions differs by {100 * difference:+.2g} % of F_C, standard deviation {100 * deviation:.2g} %.",
        "A drift proves nothing: here it is there with friction alike in both directions, for a square wave's first "
        "half period sets the speed that the others swing about. Free wheels in both directions would tell."
        if same
        else "The free wheels of the two directions differ as well.",
    )
