"""The results file -> docs/benchmarks.md and its two figures."""

from __future__ import annotations

import math
from pathlib import Path
from statistics import median
from typing import Any

from tests.benchmarks.peers.earlier import Rows, earlier_rows
from tests.benchmarks.peers.fits import FITS
from tests.benchmarks.peers.problems import EVERY
from tests.benchmarks.peers.simulators import SIMULATORS
from tests.benchmarks.peers.speed import CASES, DRAWS, POPULATION, at_error

SHARE = 0.01
_BOX = "Over the search box"
_TITLES = {
    "friction": "LuGre and mass from four free wheels (7 parameters)",
    "sine": "Sine motor, friction known (4 parameters)",
    "theta": "Theta motor, friction known (6 parameters)",
}


def arrival(run: dict[str, Any], target: float) -> dict[str, Any] | None:
    """The first improvement whose judged cost is not above `target` (m)."""
    return next((step for step in run.get("steps", ()) if step.get("judged", math.inf) <= target), None)


def outcome(run: dict[str, Any], target: float) -> str:
    """One run in a few words."""
    if "reason" in run:
        return f"not run: {run['reason']}"
    if "error" in run:
        return f"failed: {run['error'].strip().splitlines()[-1]}"
    step = arrival(run, target)
    if step is not None:
        return f"arrived after {step['s']:.2f} s and {step['evaluations']} evaluations"
    cost = run["steps"][-1]["judged"] if run["steps"] else math.inf
    what = f"not within {run['s']:.0f} s" if run["end"] == "limit" else f"ended by itself after {run['s']:.0f} s"
    return f"{what}: cost {1e6 * cost:.3g} um, {run['evaluations']} evaluations"


def write(data: dict[str, Any], docs: Path) -> str:
    """Write docs/benchmarks.md and the figures; returns the page."""
    (docs / "figures").mkdir(parents=True, exist_ok=True)
    before = earlier_rows(docs / "benchmarks.md")
    page = "\n".join([*_head(data), *_speed_tables(data, before), *_fit_tables(data, before), *_remarks(data)]) + "\n"
    (docs / "benchmarks.md").write_text(page, encoding="utf-8")
    if any("rows" in row for row in data["speed"].values()):
        _speed_figure(data, docs / "figures" / "benchmark_speed.png")
    if any(run.get("steps") for run in data["runs"].values()):
        _fit_figure(data, docs / "figures" / "benchmark_fits.png")
    return page


def _table(header: list[str], rows: list[list[str]]) -> list[str]:
    lines = ["| " + " | ".join(row) + " |" for row in [header, *rows]]
    return [lines[0], "|" + "---|" * len(header), *lines[1:], ""]


def _head(data: dict[str, Any]) -> list[str]:
    about = data["about"]
    versions = ", ".join(f"{k} {v}" for k, v in about.get("versions", {}).items())
    return [
        "# Benchmarks",
        "",
        "Written by `python -m tests.benchmarks.peers`; nothing here is typed by hand.",
        "",
        f"{about.get('date', '')}, {about.get('machine', '')}, one core for every run, Python "
        f"{about.get('python', '')}; {versions}.",
        "",
        "All peers get the same recordings of `data/stand`, the same start states, the same bounds (linid's, as a unit "
        "cube with its logarithmic scales), and one cost: the RMS of simulated minus measured position over all "
        f"samples. Friction: whole free wheels. Motors: one in {EVERY} pieces of 0.1 s of three driven recordings, "
        "started from the measured state, friction known. `solve_ivp` is LSODA on linid's reference equations. Seconds "
        "are those of the processor. Rows with a date were measured by an earlier run, on the machine they name.",
        "",
    ]


def _milliseconds(s: float | None) -> str:
    return "-" if s is None else f"{1e3 * s:.3g}"


def _speed_tables(data: dict[str, Any], before: Rows) -> list[str]:
    lines = ["## One simulation", ""]
    if not data["speed"]:
        return []
    lines += [
        "![Error against time](figures/benchmark_speed.png)",
        "",
        "Every setting of every simulator; the error is that against LSODA with a relative tolerance of 1e-11, whose "
        "own is some 1e-5 to 1e-3 um.",
        "",
    ]
    for case, (kind, name) in CASES.items():
        own = data["speed"].get(f"{case}|linid", {})
        if "rows" not in own:
            continue
        usual = next(
            row
            for row in own["rows"]
            if row["setting"] == min((r["setting"] for r in own["rows"]), key=lambda s: abs(s - own["usual"]))
        )
        lines += [
            f"**{case.capitalize()}** ({name}, {kind}). Processor time at an RMS position error of at most "
            f"{1e6 * usual['error']:.2g} um, which linid's usual step ({usual['setting']} per sample) has.",
            "",
        ]
        rows = []
        for simulator in SIMULATORS:
            found = data["speed"].get(f"{case}|{simulator}")
            if found is None:
                rows += [before[key]] if (key := (case.capitalize(), simulator)) in before else []
                continue
            if "rows" not in found:
                rows.append([simulator, found.get("reason", ""), "", "", ""])
                continue
            row = usual if simulator == "linid" else at_error(found["rows"], usual["error"])
            many = found.get("population")
            if row is None:
                rows.append([simulator, "not reached", "", "", _milliseconds(many)])
                continue
            rows.append(
                [
                    simulator,
                    f"{row['setting']:g}",
                    _milliseconds(row["s"]),
                    f"{row['s'] / usual['s']:.3g}",
                    _milliseconds(many),
                ]
            )
        heads = ["simulator", "setting", "ms", "times linid's", f"ms each, {POPULATION} candidates in one call"]
        lines += _table(heads, rows)
    return lines + (_box_table(data, before) if data["box"] else [])


def _box_table(data: dict[str, Any], before: Rows) -> list[str]:
    lines = [
        f"**{_BOX}**: {DRAWS} random candidates of the friction problem on one free wheel, at the "
        "setting used in the fits. A global search simulates these, not only the truth; usable: RMS error below "
        "1 um.",
        "",
    ]
    rows = [
        [name, f"{row['usual']:g}", _milliseconds(row["s"]), f"{100 * row['usable']:.0f} %"]
        if "s" in row
        else [name, row["reason"], "", ""]
        for name, row in data["box"].items()
    ] + [row for (title, name), row in before.items() if title == _BOX and name not in (*data["box"], "simulator")]
    return lines + _table(["simulator", "setting", "ms, mean", "usable"], rows)


def _runs_of(data: dict[str, Any], name: str, peer: str) -> list[dict[str, Any]]:
    return [run for key, run in data["runs"].items() if key.startswith(f"{name}|{peer}|")]


def _fit_tables(data: dict[str, Any], before: Rows) -> list[str]:
    lines: list[str] = []
    if not data["runs"]:
        return lines
    lines += ["## Whole fits", "", "![Cost against time](figures/benchmark_fits.png)", ""]
    limit = data["about"].get("limit_s", math.nan)
    for name, best in data["best"].items():
        target = best["cost"] * (1.0 + SHARE)
        lines += [
            f"**{_TITLES[name]}**. Best known cost {1e6 * best['cost']:.4g} um ({best['from']}); arrived: within 1 % "
            f"of it; at most {limit:g} s per run. Time and evaluations are medians over the runs that arrived; where "
            "none did, the lowest cost reached is given.",
            "",
        ]
        rows = []
        for peer in FITS:
            runs = _runs_of(data, name, peer)
            if not runs and (_TITLES[name], peer) in before:
                rows.append(before[_TITLES[name], peer])
                continue
            good = [run for run in runs if "evaluations" in run]
            if not good:
                reasons = {run.get("reason") or "failed: " + run["error"].strip()[-200:] for run in runs}
                rows += [[peer, "-", reason.replace("\n", " "), "", "", "", ""] for reason in sorted(reasons)]
                continue
            arrivals = [step for run in good if (step := arrival(run, target)) is not None]
            reached = min((run["steps"][-1]["judged"] for run in good if run["steps"]), default=math.inf)
            rows.append(
                [
                    peer,
                    f"{len(arrivals)} of {len(good)}",
                    f"{median(s['s'] for s in arrivals):.3g}" if arrivals else _not_arrived(good),
                    f"{median(s['evaluations'] for s in arrivals):.0f}"
                    if arrivals
                    else f"({median(run['evaluations'] for run in good):.0f})",
                    f"{1e6 * reached:.4g}",
                    f"{median(run['peak_mb'] for run in good):.0f}",
                    f"{median(run['first_simulation_s'] for run in good):.2g}",
                ]
            )
        heads = ["peer", "arrived", "s", "evaluations", "lowest cost, um", "peak MB", "first simulation, s"]
        lines += _table(heads, rows)
    return lines


def _not_arrived(runs: list[dict[str, Any]]) -> str:
    if all(run["end"] == "limit" for run in runs):
        return f"not within {max(run['s'] for run in runs):.0f}"
    return f"ended by itself after {median(run['s'] for run in runs):.0f}"


def _remarks(data: dict[str, Any]) -> list[str]:
    return [
        "## How to read this",
        "",
        "- The clock of a fit starts after the first simulation, which compiles (last column); linid's first guess "
        "and the making of its start candidates are within its time, the reading of files is in nobody's.",
        "- linid also gives intervals, identifiability and gaps, which the cost here leaves out; its own objective "
        "fits the start states too.",
        "- `scipy least_squares from linid's guess` shows what the first guess alone is worth; `linid without its "
        "first guess` what search and simulation are worth without it.",
        "- numba RK4 has a fixed explicit step: it is stable only for bristles that are not much stiffer than the "
        "stand's. That is why it is no peer in the fits, whose box reaches far stiffer ones.",
        "- heyoka's Taylor series are explicit: beyond 3000 steps a free wheel counts as failed, as more than "
        "a third of the box does, and costs a start little. `CasADi, multiple shooting` starts its states on the "
        "measured motion and runs compiled C; its iterates are judged by linid's simulation. AMICI simulates PEtab's "
        "problems; it is compiled before the clock starts, as CasADi's and heyoka's programs are.",
        "- MuJoCo has LuGre friction, in its `dcmotor` actuator, but no three-phase field. Its explicit RK4 is "
        "unstable for the stiffest bristles of the box, its own Euler steps stay first order.",
        "- Peers are set up as their documentation advises (default settings unless `tests/benchmarks/peers/fits.py` "
        "says why not); someone who knows one better may find a faster set-up.",
        "",
    ]


def _speed_figure(data: dict[str, Any], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(CASES), figsize=(9.0, 4.0), sharey=True, layout="constrained")
    for axis, case in zip(axes, CASES, strict=True):
        for number, name in enumerate(SIMULATORS):
            rows = data["speed"].get(f"{case}|{name}", {}).get("rows")
            if not rows:
                continue
            good = [row for row in rows if row["error"] == row["error"] and row["error"] < 1e-2]
            axis.loglog(
                [1e6 * row["error"] for row in good],
                [1e3 * row["s"] for row in good],
                "os^vDPX*h"[number % 9] + "-",
                color="k" if name == "linid" else f"C{number}",
                lw=2.0 if name == "linid" else 1.0,
                ms=4,
                label=name,
            )
        axis.set_xlabel("RMS position error in µm")
        axis.set_title(case)
        axis.invert_xaxis()
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("processor time of one simulation in ms")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(path, dpi=150)
    plt.close(figure)


def _fit_figure(data: dict[str, Any], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = list(data["best"])
    figure, axes = plt.subplots(
        1, len(names), figsize=(max(3.6 * len(names), 9.0), 5.4), squeeze=False, layout="constrained"
    )
    labelled: dict[str, Any] = {}
    for axis, name in zip(axes[0], names, strict=True):
        best = data["best"][name]["cost"]
        for number, peer in enumerate(FITS):
            for run in _runs_of(data, name, peer):
                steps = run.get("steps")
                if not steps:
                    continue
                times = [max(step["s"], 1e-3) for step in steps] + [max(run["s"], steps[-1]["s"], 1e-3)]
                costs = [step["cost"] / best for step in steps] + [steps[-1]["cost"] / best]
                (line,) = axis.step(
                    times,
                    costs,
                    where="post",
                    color="k" if peer == "linid" else f"C{number % 10}",
                    alpha=0.8,
                    lw=1.8 if peer == "linid" else 0.9,
                    ls="-" if number < 10 else "--",
                )
                labelled.setdefault(peer, line)
                if peer == "linid":  # it may arrive with its first guess
                    axis.plot(times[-1], costs[-1], "ko", ms=4, alpha=0.8, clip_on=False, zorder=5)
        axis.axhline(1.0 + SHARE, color="grey", lw=0.8, ls=":")
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_ylim(0.9, None)
        axis.set_xlabel("time (s)")
        axis.set_title(name)
        axis.grid(alpha=0.3)
    axes[0][0].set_ylabel("lowest cost so far / best known")
    figure.legend(labelled.values(), labelled, loc="outside lower center", ncols=2, frameon=False, fontsize=8)
    figure.savefig(path, dpi=150)
    plt.close(figure)
