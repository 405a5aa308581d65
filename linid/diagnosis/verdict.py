"""The verdict in words: what the gap is made of, what is left, and the recording to make next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from linid.diagnosis.next_experiment import Prospect
from linid.diagnosis.report_data import Budget, Entry, ProposedTerm, Share, Status, Verdict
from linid.physics.effects.effect import ARGUMENTS
from linid.physics.effects.registry import find_effect
from linid.recording.check_findings import RecordingChecks
from linid.recording.checks import joined_findings

# Excess over the floor (in floors) below which a campaign counts as explained: nobody knows the floor better.
LEAST_EXCESS = 0.3
# The same of the mean logarithm: a coarse encoder hides when exactly an axis stops and breaks away, which few pieces of
# much power then show.
LEAST_LEVEL = 0.15
MOST_LEFT = 0.05  # of the gap, for one that is closed but for such pieces
_NOTHING = 0.0005  # of the gap: what is written as 0.0 %
# A model that explains less of the motion itself is said to.
LEAST_MOTION = 0.5
TELLING, SURE = 0.05, 0.02  # share from which, and p-value below which, a coordinate is worth a word


def status_of(budget: Budget) -> Status:
    """none, explained, partly explained or unknown, from the gap and its entries."""
    if budget.entries:
        closed = leaves_nothing(budget.excess_after, budget.level_after, budget.unexplained)
        return "explained" if closed else "partly explained"
    return "none" if leaves_nothing(budget.excess_before, budget.level_before, 0.0) else "unknown"


def leaves_nothing(excess: float, level: float, unexplained: float) -> bool:
    """Whether a model is at the floor: by its excess in floors, or by the mean logarithm where little of the gap is
    left (a share, 0 without effects)."""
    return excess < LEAST_EXCESS or (level < LEAST_LEVEL and unexplained < MOST_LEFT)


def decide(
    budget: Budget,
    where: Sequence[Share],
    screened: Sequence[tuple[str, float]],
    motion: float,
    checks: Sequence[RecordingChecks],
    axis: str,
    term: ProposedTerm | None = None,
) -> Verdict:
    """The verdict of a diagnosis.

    where: shares of the base's residual by coordinate; screened: effect and explained share, best first; motion: share
    of the held-out acceleration's power that the best model explains; checks: of the data; axis: linear
    or rotary; term: proposed for what the effects leave.
    """
    word = "torque" if axis == "rotary" else "force"
    status = status_of(budget)
    if status == "none" and term is not None:  # what predicts recordings that it was not fitted to is no noise
        status = "unknown"
    names = tuple(entry.effect for entry in budget.entries)
    rivals = tuple(dict.fromkeys(name for entry in budget.entries for name in entry.rivals))
    if status == "none":
        return _nothing(budget, word)
    if status == "unknown":
        sentence = _unknown(where, screened, motion, checks, _term_in_words(term, word))
        near = screened[0][0] if screened else ""
        step = "Repeat a recording to see what of it repeats."
        if near:
            step = f"To see whether {near.replace('_', ' ')} is behind it, record {find_effect(near).exposed_by}."
        if term is not None and term.next_experiment:
            step = term.next_experiment
        return Verdict(status, (), (), sentence, step)
    parts = [_in_words(entry) for entry in budget.entries]
    if len(parts) == 1:
        causes = f"{parts[0]} causes {_percent(budget.closed)} of the gap"
    else:
        causes = f"{_list(parts)} together cause {_percent(budget.closed)} of the gap"
    if status == "explained":
        sentence = f"{causes[0].upper()}{causes[1:]}; the residual {word} is then at the noise floor."
    else:
        sentence = f"{causes[0].upper()}{causes[1:]}; {_rest_in_words(budget, term, word)}."
    worse = {name for entry in budget.entries for name in entry.worsens}
    if worse:
        words = {"free_run": "the free run", "ahead": "the prediction 0.1 s ahead", "force": "the force balance"}
        which = [e.effect.replace("_", " ") for e in budget.entries if e.worsens]
        get = "gets" if len(worse) == 1 else "get"
        sentence += f" With {_list(which)} in the model {_list([words[n] for n in words if n in worse])} {get} worse."
    step = f"To measure {names[0].replace('_', ' ')} better, record {find_effect(names[0]).exposed_by}."
    return Verdict(status, names, rivals, sentence, step)


def so_far(shares: Mapping[str, float], unexplained: float) -> str:
    """What is known once effects are chosen, before the models and a term have had their say, as a line.

    shares: of the gap, by effect; unexplained: share that they leave.
    """
    found = sorted(shares.items(), key=lambda item: -item[1])
    words = [f"{name.replace('_', ' ')} ({_percent(share)})" for name, share in found]
    what = f"{_list(words)}, {_percent(max(unexplained, 0.0))} unexplained" if words else "no effect"
    return f"so far: {what}; next: what the models predict"


def _rest_in_words(budget: Budget, term: ProposedTerm | None, word: str) -> str:
    """What effects leave of the gap, as a clause. word: force or torque."""
    left = f"{_percent(budget.unexplained)} stay unexplained, "
    if budget.unexplained < _NOTHING:
        left = f"the residual {word} is still above the noise floor, "
    if term is not None:  # it says it better: its arguments were tested together
        closes = _term_in_words(term, word)
        return left + (f"of which {closes}" if budget.unexplained >= _NOTHING else f"and {closes} of what is left")
    if budget.depends_on:
        return f"{left}{'and' if budget.unexplained < _NOTHING else 'which'} depends on {_list(budget.depends_on)}"
    return left.removesuffix(", ")


def _nothing(budget: Budget, word: str) -> Verdict:
    """The verdict of a campaign without a gap, or with one in few pieces of much power. word: force or torque."""
    sentence = f"The residual {word} of the held-out recordings is at the noise floor"
    if budget.excess_before < LEAST_EXCESS:
        step = "Nothing is needed; a longer stroke or higher speed may show more."
        return Verdict("none", (), (), f"{sentence}: no effect is missing.", step)
    sentence += (
        " but for short pieces: no effect that lasts is missing. A push from outside is such a piece, and a stop or "
        "breakaway that the encoder shows coarsely."
    )
    return Verdict("none", (), (), sentence, "Repeat the recordings with the largest residual: what repeats there?")


def _term_in_words(term: ProposedTerm | None, word: str) -> str:
    """What a proposed term does, as a clause; empty without one. word: force or torque."""
    if term is None:
        return ""
    labels = [ARGUMENTS[name].replace("force", word) for name in term.arguments]
    said = f"a term of {_list(labels)}" if labels else f"a constant {word}"
    return f"{said} closes {_percent(term.closed)}"


def _in_words(entry: Entry) -> str:
    """An entry with its share and, where there are any, its rivals."""
    name = " or ".join(n.replace("_", " ") for n in (entry.effect, *entry.rivals))
    return f"{name} ({_percent(entry.share)})"


def _unknown(
    where: Sequence[Share],
    screened: Sequence[tuple[str, float]],
    motion: float,
    checks: Sequence[RecordingChecks],
    term: str,
) -> str:
    """What was tried and what it saw, where no effect has evidence. term: what a proposed one does."""
    found = [s.label for s in where if s.share > TELLING and s.p_value < SURE][:3]
    depends = f"depends on {_list(found)}" if found else "depends on none of the usual coordinates"
    gap = f"; {term} of it." if term else f": the residual {depends}."
    tried = ""
    if screened:
        tried = (
            f" {len(screened)} effects were tried; the nearest, {screened[0][0].replace('_', ' ')}, takes "
            f"{_percent(max(screened[0][1], 0.0))} of the log power from the fitted recordings, but does not hold on "
            "the held-out ones."
        )
    moved = ""
    if motion < LEAST_MOTION:
        moved = f" The model explains {_percent(max(motion, 0.0))} of the held-out accelerations."
    warned = [text for level, _, text in joined_findings(checks) if level == "warning"]
    seen = f" The data themselves: {warned[0]}" if warned else ""
    return f"No effect of the library explains the gap{gap}{tried}{moved}{seen}"


def advice(budget: Budget, best: Prospect, noise: float, axis: str) -> str:
    """The computed next recording in words; noise: m/s^2 of the recordings at hand."""
    unit = "rad/s^2" if axis == "rotary" else "m/s^2"
    times = max(best.difference / max(noise, 1e-300), 0.0)
    size = f"{best.difference:.2g} {unit} RMS ({times:.1f} times the noise)"
    unclear = next((entry for entry in budget.entries if entry.rivals), None)
    if unclear is not None:
        name, rival = unclear.effect.replace("_", " "), unclear.rivals[0].replace("_", " ")
        return f"To tell {name} from {rival}, record {best.words}: there the two differ by {size}."
    name = budget.entries[-1].effect.replace("_", " ")
    sharper = (1.0 + best.gain) ** 0.5
    return (
        f"To measure {name} better, record {best.words}: a tenth of it shows there with {size}, "
        f"and its interval would shrink to {100.0 / sharper:.0f} % of its width."
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.095 or share <= 0.0 else f"{100.0 * share:.1f} %"


def _list(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
