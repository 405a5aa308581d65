"""The verdict: none, identified, ambiguous or unknown, and the recording to make next."""

from __future__ import annotations

from collections.abc import Sequence

from linid.diagnosis.next_experiment import Prospect
from linid.diagnosis.report_data import Share, Status, Verdict
from linid.diagnosis.select import LEAST_CLOSURE, LEAST_EXCESS, Confirmed
from linid.physics.effects.registry import find_effect

# An effect that closes less of the excess is named all the same if it leaves so little: the floor is not
# known better than that.
LEFT_OVER = 0.15
# A model that explains less of the motion itself is none; real axes reach 0.9 and more.
LEAST_MOTION = 0.5
_TELLING = 0.05  # share from which a coordinate is worth a word


def decide(
    chosen: Confirmed | None,
    groups: Sequence[tuple[str, ...]],
    excess: float,
    where: Sequence[Share],
    ceiling: float,
    screened: Sequence[tuple[str, float]],
    motion: float = 1.0,
) -> Verdict:
    """The verdict of a diagnosis.

    chosen: the effects that paid (None: none did); groups: per chosen effect its rivals; excess: held-out mean square
    over the floor, in floors; where: shares by coordinate; ceiling: what any smooth function of the coordinates could
    close; screened: effect and explained share, best first; motion: share of the held-out acceleration's power that
    the best model explains.
    """
    status: Status
    if motion < LEAST_MOTION:
        sentence = (
            f"The model explains {_percent(max(motion, 0.0))} of the held-out accelerations, so no effect can be "
            "judged: units, signs or channels may be wrong."
        )
        return Verdict("unknown", (), (), sentence, "Check the channels with linid inspect, and one recording by hand.")
    left = excess if chosen is None else excess * (1.0 - chosen.closure)
    if chosen is None or (chosen.closure < LEAST_CLOSURE and left >= LEFT_OVER):
        if chosen is None and excess < LEAST_EXCESS:
            sentence = "The model explains the held-out recordings down to the noise floor: no effect is missing."
            return Verdict(
                "none", (), (), sentence, "Nothing is needed; a longer stroke or higher speed may show more."
            )
        status = "unknown"
        found = [s for s in where if s.share > _TELLING and s.p_value < 0.02]
        coordinates = ", ".join(s.label for s in found[:3]) or "none of the usual coordinates"
        best = "" if chosen is None else f" The best, {' + '.join(chosen.effects)}, closes {_percent(chosen.closure)}."
        sentence = (
            f"No effect of the library explains the gap.{best} The residual depends on {coordinates}; "
            f"any smooth function of the coordinates could close at most {_percent(ceiling)}."
        )
        near = screened[0][0] if screened else ""
        step = f"Record: {find_effect(near).exposed_by}." if near else "Repeat a recording to see what of it repeats."
        return Verdict("unknown", (), (), sentence, step)
    names = chosen.effects
    rivals = tuple(dict.fromkeys(name for group in groups for name in group))
    status = "ambiguous" if rivals else "identified"
    total = _percent(chosen.closure)
    if status == "identified":
        sentence = f"The gap comes from {_list(names)}: with it in the model {total} of the held-out excess closes."
        step = f"To measure it better, record: {find_effect(names[0]).exposed_by}."
    else:
        sentence = (
            f"The gap comes from {_list(names)} or {_list(rivals)}, which these recordings cannot tell apart; "
            f"{total} of the held-out excess closes."
        )
        step = "To tell them apart, record: " + "; or ".join(
            dict.fromkeys(find_effect(name).exposed_by for name in (*names[-1:], *rivals[:1]))
        )
    return Verdict(status, names, rivals, sentence, step)


def advice(verdict: Verdict, best: Prospect, noise: float, axis: str) -> str:
    """The computed next recording in words; noise: m/s^2 of the recordings at hand."""
    unit = "rad/s^2" if axis == "rotary" else "m/s^2"
    times = max(best.difference / max(noise, 1e-300), 0.0)
    size = f"{best.difference:.2g} {unit} RMS ({times:.1f} times the noise)"
    name = verdict.effects[-1].replace("_", " ")
    if verdict.status == "ambiguous":
        rival = verdict.equivalent[0].replace("_", " ")
        return f"To tell {name} from {rival}, record {best.words}: there the two differ by {size}."
    sharper = (1.0 + best.gain) ** 0.5
    return (
        f"To measure {name} better, record {best.words}: a tenth of it shows there with {size}, "
        f"and its interval would shrink to {100.0 / sharper:.0f} % of its width."
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _list(names: Sequence[str]) -> str:
    words = [name.replace("_", " ") for name in names]
    return " and ".join(words)
