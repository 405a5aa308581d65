"""Seconds and memory of a diagnosis, and how they grow: `python -m tests.benchmarks.diagnosis CAMPAIGN [--jobs N]`.

Every case runs in a process of its own, after one that fills the cache of compiled code.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from linid.recording.recording import Recording

# Copies of every recording, and which samples are kept.
CASES = ((1, 1), (2, 1), (4, 1), (1, 2), (1, 4))


def grown(recordings: Sequence[Recording], copies: int, every: int) -> list[Recording]:
    """The recordings `copies` times over, with every `every`-th sample."""
    out = []
    for copy in range(copies):
        for r in recordings:
            name = r.name if copy == 0 else f"{r.name}_{copy + 1}"
            currents = None if r.phase_currents is None else r.phase_currents[:, ::every]
            drive = None if r.drive_input is None else r.drive_input[::every]
            thin = replace(
                r, name=name, t=r.t[::every], y=r.y[::every], phase_currents=currents, drive_input=drive, number=0
            )
            out.append(thin)
    return out


def one(campaign: Path, jobs: int, copies: int, every: int) -> dict[str, float | str]:
    """Time and memory of one diagnosis in this process."""
    from linid.api import read
    from linid.diagnosis.diagnose import diagnose
    from linid.diagnosis.means import Means
    from linid.interface.stages import base_kind

    inputs = read(campaign)
    recordings = grown(inputs.recordings, copies, every)
    begin, busy = time.perf_counter(), time.process_time()
    verdict = diagnose(campaign.stem, recordings, base_kind(tuple(recordings)), known=inputs.known, means=Means(jobs))
    return {
        "recordings": len(recordings),
        "samples": sum(r.t.size for r in recordings),
        "seconds": time.perf_counter() - begin,
        "processor_seconds": time.process_time() - busy,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        "verdict": f"{verdict.diagnosis.verdict.status} {'+'.join(verdict.diagnosis.verdict.effects)}",
    }


def main() -> None:
    """Run all cases and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("campaign", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--case", type=int, nargs=2, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.case:
        print(json.dumps(one(chosen.campaign, chosen.jobs, *chosen.case)))
        return
    command = [sys.executable, "-m", "tests.benchmarks.diagnosis", str(chosen.campaign), "--jobs", str(chosen.jobs)]
    for number, case in enumerate((CASES[0], *CASES)):
        done = subprocess.run(
            [*command, "--case", *map(str, case)], stdout=subprocess.PIPE, text=True, check=True, cwd=Path.cwd()
        )
        found = json.loads(done.stdout)
        label = "cold" if number == 0 else "warm"
        print(
            f"{label}  {found['recordings']:3d} recordings {found['samples']:7d} samples  {found['seconds']:6.1f} s "
            f"({found['processor_seconds']:.1f} s of processors)  {found['peak_mb']:.0f} MB  {found['verdict']}"
        )


if __name__ == "__main__":
    main()
