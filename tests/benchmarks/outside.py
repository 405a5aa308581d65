"""Terms for causes outside the library: `python -m tests.benchmarks.outside FOLDER [--make N --seed S] [--jobs J]`.

Diagnoses every campaign of a challenge (those with results keep them), fits the true effects or the true term beside
the base, and prints by cause, and in all, how often a proposed term has the right arguments and how far it closes the
gap. --make N: first make N campaigns of --kinds in FOLDER. --without-true: of campaigns of one listed effect each, such
as those of `--make 26 --kinds single`, diagnoses every one with its effect left out of consideration (into
results_without), and grades what is proposed by what that effect says it depends on.
"""

from __future__ import annotations

import argparse
import math
import os
from collections import Counter
from collections.abc import Collection, Sequence
from functools import partial
from pathlib import Path
from statistics import median

from linid.challenge.answers import ORACLE_FILE, Answer, read_answer
from linid.challenge.create import make_challenge
from linid.challenge.files import CAMPAIGN_FILE, DIAGNOSIS_FILE, KEYS_FILE, RESULTS_FOLDER, Key, read_keys_file
from linid.challenge.make import Plan
from linid.challenge.outside import CAUSES
from linid.challenge.proposals import cause_of, closed_of, grade, score_proposals
from linid.challenge.run import diagnose_one, in_processes
from linid.physics.effects.registry import BUILT_IN, find_effect

WITHOUT_FOLDER = "results_without"  # beside the challenge's results
_RANK = {"wrong": 0, "related": 1, "exact": 2}


def best_grade(said: Collection[str], answers: Sequence[tuple[str, ...]]) -> str:
    """`exact`, `related` or `wrong`: the best that what is said earns of several honest answers."""
    known = [grade(said, one) if one else "exact" if not said else "wrong" for one in answers]
    return max(known, key=_RANK.__getitem__)


def judged(folder: Path, name: str, key: Key, plan: dict[str, object] | None, oracle: bool) -> tuple[str, float]:
    """Diagnose one campaign and fit what truly acts; its name, and the seconds of the diagnosis (0: kept)."""
    from linid.workflow.commands.challenge import diagnose_with_linid, write_oracle

    results, seconds = folder / RESULTS_FOLDER, 0.0
    if not (results / name / DIAGNOSIS_FILE).exists():
        seconds = diagnose_one(diagnose_with_linid, folder / name / CAMPAIGN_FILE, results).seconds
    target = results / name / ORACLE_FILE
    if oracle and cause_of(key) is not None and not target.exists():
        write_oracle(folder / name / CAMPAIGN_FILE, key.effects, target, plan)
    return name, seconds


def left_out(folder: Path, name: str, key: Key) -> tuple[str, float]:
    """Diagnose one campaign without its listed effect; its name, and the seconds of the diagnosis (0: kept)."""
    from linid.workflow.commands.challenge import diagnose_with_linid

    results = folder / WITHOUT_FOLDER
    if (results / name / DIAGNOSIS_FILE).exists():
        return name, 0.0
    diagnose = partial(diagnose_with_linid, without=key.effects)
    return name, diagnose_one(diagnose, folder / name / CAMPAIGN_FILE, results).seconds


def without_true(folder: Path, keys: dict[str, Key], jobs: int) -> list[str]:
    """Grades of all campaigns of one listed effect that is left out, and rates by effect and in all."""
    listed = {effect.name for effect in BUILT_IN}
    chosen = {name: key for name, key in keys.items() if len(key.effects) == 1 and key.effects[0] in listed}
    grades: dict[str, list[str]] = {}
    for name, seconds in in_processes(left_out, [(folder, name, key) for name, key in chosen.items()], jobs):
        (effect,) = chosen[name].effects
        answer = read_answer(folder / WITHOUT_FOLDER / name)
        answers, proposal = find_effect(effect).depends_on, answer.proposal
        if proposal is None:
            mark = "nothing is asked for" if answer.status == "none" or () in answers else "nothing proposed"
        else:
            mark = best_grade(proposal.arguments, answers)
        grades.setdefault(effect, []).append(mark)
        said = "" if proposal is None else f"{'+'.join(proposal.arguments)}, closes {proposal.closed or math.nan:.2f}"
        named = "+".join(answer.named) or "-"
        print(f"{name} {effect}: {answer.status}, names {named}; {said} {mark} [{seconds:.0f} s]", flush=True)
    every = [mark for marks in grades.values() for mark in marks]
    lines = [f"{effect:28} {_counted(marks)}" for effect, marks in sorted(grades.items())]
    return [*lines, f"{'all':28} {_counted(every)}"]


def _counted(marks: Sequence[str]) -> str:
    return f"{len(marks)}: " + ", ".join(f"{mark} {count}" for mark, count in Counter(marks).most_common())


def line(name: str, key: Key, answer: Answer, seconds: float) -> str:
    """One campaign in words."""
    cause = cause_of(key)
    truth = CAUSES[cause].arguments if cause else ()
    proposal = answer.proposal
    said, mark = "nothing proposed", ""
    if proposal is not None:
        form = f"a finer form of {'+'.join(proposal.refines)}" if proposal.refines else "no cause outside"
        mark = grade(proposal.arguments, truth) if truth else form
        closed = closed_of(answer)
        said = f"{'+'.join(proposal.arguments)}, closes {'?' if closed is None else f'{closed:.2f}'}"
    best = "" if answer.oracle is None else f" of {answer.oracle:.2f}"
    best += "" if answer.ahead is None else f", {answer.ahead:.1f} x the best error ahead"
    hidden, named = "+".join(key.effects) or "nothing", "+".join(answer.named) or "-"
    return f"{name} {hidden} ({'+'.join(truth)}): {answer.status}, {named}; {said}{best} {mark} [{seconds:.0f} s]"


def summary(keys: dict[str, Key], answers: dict[str, Answer]) -> list[str]:
    """Rates by cause, then of all campaigns."""
    out = []
    for cause in dict.fromkeys(cause_of(key) for key in keys.values()):
        if cause is not None:
            own = {name: key for name, key in keys.items() if cause_of(key) == cause}
            score = score_proposals(own, answers)
            exact, main = score.rates["arguments_exact"], score.rates["arguments_main"]
            closure = "-" if score.closure is None else f"{score.closure:.2f}"
            out.append(f"{cause:32} exact {exact.count:g}, main {main.count:g} of {exact.total}; closure {closure}")
    score = score_proposals(keys, answers)
    for name, one in score.rates.items():
        if one.total:
            out.append(f"{name}: {one.count:g} of {one.total}, {one.value:.0%} ({one.low:.0%} to {one.high:.0%})")
    if score.closure is not None:
        out.append(f"closure over the true term's, median of {score.count}: {score.closure:.2f}")
    ahead = [answer.ahead for answer in answers.values() if answer.another_cause and answer.ahead is not None]
    if ahead:
        out.append(f"error 0.1 s ahead over the true term's, median of {len(ahead)}: {median(ahead):.2f}")
    return out


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--make", type=int, default=0, metavar="N")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", default="unknown")
    parser.add_argument("--effects", default="")
    parser.add_argument("--strength", default="0.1,1")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--without-true", action="store_true", help="leave the true effect out of consideration")
    parser.add_argument("--no-oracle", action="store_true", help="fit no true terms: no closures to compare with")
    options = parser.parse_args(arguments)
    if options.make:
        low, high = map(float, options.strength.split(","))
        effects = tuple(name for name in options.effects.split(",") if name)
        plan = Plan(options.seed, effects=effects, kinds=tuple(options.kinds.split(",")), strength=(low, high))
        make_challenge(plan, options.make, options.folder, jobs=options.jobs)
    keys, more = read_keys_file(options.folder / KEYS_FILE)
    if options.without_true:
        print("\n".join(without_true(options.folder, keys, options.jobs)))
        return
    tasks = [(options.folder, name, key, more.get("plan"), not options.no_oracle) for name, key in keys.items()]
    for name, seconds in in_processes(judged, tasks, options.jobs):
        answer = read_answer(options.folder / RESULTS_FOLDER / name)
        print(line(name, keys[name], answer, seconds), flush=True)
    answers = {name: read_answer(options.folder / RESULTS_FOLDER / name) for name in keys}
    print("\n".join(summary(keys, answers)))


if __name__ == "__main__":
    main()
