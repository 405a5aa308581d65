"""Coverage of the 95 % intervals on the generated stand: `python -m tests.benchmarks.coverage friction 100`, or
`... friction 40 100` for 40 draws of noise from seed 100 on. Every interval that misses is said with its seed.

friction, sine, theta: the stand's own values and a sine motor of the same force; table_2, table_3: the motors and the
friction of these tables of the paper. The name of an effect: a small sine motor with it, encoder noise of 2 um alone,
fitted from the truth.

Every seed measures the same exact motion with fresh encoder and current noise and fits it from nothing (motors:
from the friction of the first seed).
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from linid.identification.fit import fit, refine
from linid.identification.result import FitResult
from linid.identification.settings import FitSettings, SearchSettings
from linid.identification.space.bounds import build_space
from linid.physics.effects.registry import find_effect
from linid.physics.model import Model
from linid.stand.description import SineMotor
from linid.stand.generate import GeneratedCampaign, generate, resample_noise
from tests.benchmarks.paper_stands import DRIVEN, table_2, table_3
from tests.identification.stand import stand
from tests.simulation.axis_with_effects import AXIS, SAMPLES, campaign_with

SETTINGS = FitSettings(search=SearchSettings(population=24, generations=3), jobs=1)
ENCODER = 2e-6  # m, its noise where effects are fitted

Draws = Iterator[tuple[int, dict[str, float], FitResult]]  # seed, true values in SI, fit


def main(kind: str, seeds: int, first: int = 0) -> None:
    """Fit `seeds` draws of noise, from `first` on, of a stand as `kind` says and print coverage and scores per
    parameter."""
    inside: dict[str, list[bool]] = defaultdict(list)
    scores: dict[str, list[float]] = defaultdict(list)
    lost: dict[str, int] = defaultdict(int)
    draws = _of_effect if kind in SAMPLES else _of_stand
    for number, (seed, truth, result) in enumerate(draws(kind, seeds, first), 1):
        for estimate in result.estimates:
            if estimate.status == "not_identifiable":
                lost[estimate.name] += 1
            if estimate.status in ("fitted", "at_bound"):
                true = truth[estimate.name]
                holds = estimate.low <= true <= estimate.high
                if not holds:
                    print(f"seed {seed}: {estimate.name} {estimate.value:.6g}", end=" ")
                    print(f"[{estimate.low:.6g}, {estimate.high:.6g}], true {true:.6g}", flush=True)
                inside[estimate.name].append(holds)
                scores[estimate.name].append((estimate.value - true) / estimate.std)
        print(f"\r{number}/{seeds}", end="", file=sys.stderr, flush=True)
    print(f"\n{'parameter':<24}{'covered':>9}{'of':>5}{'mean z':>9}{'std z':>8}{'not identifiable':>18}")
    for name in sorted(set(inside) | set(lost)):
        z = np.array(scores[name]) if scores[name] else np.array([np.nan])
        share = f"{100 * np.mean(inside[name]):.0f} %" if inside[name] else "-"
        print(f"{name:<24}{share:>9}{len(inside[name]):>5}{z.mean():>9.2f}{z.std():>8.2f}{lost[name]:>18}")


def _of_stand(kind: str, seeds: int, first: int) -> Draws:
    """Fits of a stand."""
    campaign = STANDS[kind]() if kind in STANDS else stand()
    model = {"table_2": "sine", "table_3": "theta"}.get(kind, kind)
    friction: FitResult | None = None
    for seed in range(first, first + seeds):
        recordings = [r for r in resample_noise(campaign, 1000 + seed).recordings if r.split == "fit"]
        wheels = [r for r in recordings if r.kind == "free_wheel"]
        recordings = wheels + [r for r in recordings if r.name in DRIVEN]
        if model == "friction" or friction is None:
            friction = fit("friction", wheels, settings=SETTINGS)
        motor = model != "friction"
        result = fit(model, recordings, settings=SETTINGS, start=friction) if motor else friction  # type: ignore[arg-type]
        yield seed, campaign.truth, result


def _of_effect(name: str, seeds: int, first: int) -> Draws:
    """Fits of a small sine motor with one effect, all parameters free but those that nobody searches."""
    effect = find_effect(name)
    truth = AXIS | SAMPLES[name]
    fixed = ("winding_displacement", "stribeck_exponent", *effect.preset)
    held = {k: truth[k] for k in fixed if k in truth}
    for seed in range(first, first + seeds):
        recordings = campaign_with((name,), seed=100 + seed, noise=ENCODER)
        space = build_space(Model("sine", (name,)), recordings, truth, held, {}, False)
        yield seed, truth, refine(space, space.encode(truth), recordings, settings=SETTINGS)


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
