"""An outcome on the console: tables, or a machine-readable summary."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

    from linid.workflow.run.outcome import Outcome


def show(outcome: Outcome, as_json: bool) -> None:
    """Print an outcome on stdout: JSON, or its tables, its folder and whether it converged."""
    if as_json:
        print(json.dumps(outcome.summary, indent=1, ensure_ascii=False, allow_nan=False))
        return
    from rich.console import Console

    width = None if sys.stdout.isatty() else 80
    console = Console(width=width, highlight=False, markup=False)
    for table in outcome.tables:
        _print_whole(console, table)
        console.print()
    if outcome.summary.get("dry_run"):
        console.print(plan_text(outcome.summary), soft_wrap=True)
    if outcome.folder is not None:
        console.print(f"Results: {outcome.folder}", soft_wrap=True)
    if outcome.exit_code == 5:
        console.print("Not converged: see the note below the table; try more --generations or a larger --population.")


def _print_whole(console: Console, table: Any) -> None:
    """Print a table no narrower than it can be: a long line is a smaller evil than a lost column."""
    from rich.measure import Measurement

    if isinstance(table, str):
        console.print(table, soft_wrap=True)
        return
    needed = Measurement.get(console, console.options.update(max_width=1000), table).minimum
    console.print(table, width=max(console.width, needed), crop=False)


def plan_text(summary: dict[str, Any]) -> str:
    """What --dry-run prints."""
    lines = [f"{summary['command']} would do the following; nothing is written."]
    for stage in summary.get("stages", []):
        known = ", ".join(f"{name} = {value:g}" for name, value in stage["known"].items()) or "none"
        bounds = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in stage["bounds"].items())
        lines += [
            f"Stage {stage['stage']}: {stage['model']} model" + "".join(f" + {e}" for e in stage["effects"]),
            f"  recordings  {', '.join(stage['recordings'])} ({stage['samples']} samples)",
            f"  identified  {', '.join(stage['identified'])}",
            f"  known       {known}",
            *([f"  bounds      {bounds}"] if bounds else []),
            f"  search      {stage['method']}, population {stage['population']}, up to {stage['generations']} "
            f"generations, at most {stage['largest_number_of_simulations']} simulations, seed {stage['seed']}",
            f"  objective   {stage['objective']}",
        ]
    for name in ("held_out", "recordings"):
        if summary.get(name):
            lines.append(f"{name.replace('_', ' ').capitalize()}: {', '.join(summary[name])}")
    for job in summary.get("jobs", []):
        after = f" (after {', '.join(job['after'])})" if job["after"] else ""
        lines.append(f"  {job['job']}: {job['command']} {' '.join(job['files'])}{after}")
    return "\n".join(lines)
