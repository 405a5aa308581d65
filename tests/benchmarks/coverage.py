"""Coverage of the 95 % intervals on the generated stand: `python -m tests.benchmarks.coverage friction 100`, or
`... friction 40 100` for 40 draws of noise from seed 100 on. Every interval that misses is said with its seed.

friction, sine, theta: the stand's own values and a sine motor of the same force; table_2, table_3: the motors and the
friction of these tables of the paper.

Every seed measures the same exact motion with fresh encoder and current noise and fits it from nothing (motors:
from the friction of the first seed).
"""

from __future__ import annotations

import sys
from collections import defaultdict

import numpy as np

from linid.identification.fit import fit
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.stand.description import SineMotor
from linid.stand.generate import GeneratedCampaign, generate, resample_noise
from tests.benchmarks.paper_stands import DRIVEN, table_2, table_3
from tests.identification.stand import stand

SETTINGS = FitSettings(search=SearchSettings(population=24, generations=3), jobs=1)


def main(kind: str, seeds: int, first: int = 0) -> None:
    """Fit `seeds` draws of noise, from `first` on, of a stand as `kind` says and print coverage and scores per
    parameter."""
    campaign = STANDS[kind]() if kind in STANDS else stand()
    model = {"table_2": "sine", "table_3": "theta"}.get(kind, kind)
    inside: dict[str, list[bool]] = defaultdict(list)
    scores: dict[str, list[float]] = defaultdict(list)
    lost: dict[str, int] = defaultdict(int)
    friction: FitResult | None = None
    for seed in range(first, first + seeds):
        recordings = [r for r in resample_noise(campaign, 1000 + seed).recordings if r.split == "fit"]
        wheels = [r for r in recordings if r.kind == "free_wheel"]
        recordings = wheels + [r for r in recordings if r.name in DRIVEN]
        if model == "friction" or friction is None:
            friction = fit("friction", wheels, settings=SETTINGS)
        motor = model != "friction"
        result = fit(model, recordings, settings=SETTINGS, start=friction) if motor else friction  # type: ignore[arg-type]
        for estimate in result.estimates:
            if estimate.status == "not_identifiable":
                lost[estimate.name] += 1
            if estimate.status in ("fitted", "at_bound"):
                truth = campaign.truth[estimate.name]
                holds = estimate.low <= truth <= estimate.high
                if not holds:
                    print(f"seed {seed}: {estimate.name} {estimate.value:.6g}", end=" ")
                    print(f"[{estimate.low:.6g}, {estimate.high:.6g}], true {truth:.6g}", flush=True)
                inside[estimate.name].append(holds)
                scores[estimate.name].append((estimate.value - truth) / estimate.std)
        print(f"\r{seed + 1 - first}/{seeds}", end="", file=sys.stderr, flush=True)
    print(f"\n{'parameter':<24}{'covered':>9}{'of':>5}{'mean z':>9}{'std z':>8}{'not identifiable':>18}")
    for name in sorted(set(inside) | set(lost)):
        z = np.array(scores[name]) if scores[name] else np.array([np.nan])
        share = f"{100 * np.mean(inside[name]):.0f} %" if inside[name] else "-"
        print(f"{name:<24}{share:>9}{len(inside[name]):>5}{z.mean():>9.2f}{z.std():>8.2f}{lost[name]:>18}")


def _with_sine_motor() -> GeneratedCampaign:
    """The stand with a sine motor of the same force constant, pole pitch and field phase."""
    description = stand().description
    theta = description.motor
    motor = SineMotor(
        kind="sine",
        force_constant_n_per_a=30.0,
        electrical_wavenumber_per_m=2.0 * theta.electrical_wavenumber_per_m,
        winding_displacement_rad=2.0 * theta.winding_displacement_rad,
        commutation_offset_rad=2.0 * theta.commutation_offset_rad,
    )
    return generate(description.model_copy(update={"motor": motor}), seed=1)


STANDS = {"sine": _with_sine_motor, "table_2": table_2, "table_3": table_3}


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "friction", *map(int, sys.argv[2:] or ("100",)))
