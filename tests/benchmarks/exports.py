"""What the simpler forms of exports keep of a model, as linid states it and as MuJoCo shows it: python -m
tests.benchmarks.exports [MODEL.json CAMPAIGN.yaml]

Position 0.1 s ahead of measured states on the held-out driven recordings, with bristles and hidden states along the
motion (MuJoCo's heat and load start at rest). Without arguments an axis of nine effects makes the recordings. Written
is a table in Markdown.
"""

from __future__ import annotations

import sys

import numpy as np

import linid
from linid.export.loss import held_out, measure_loss, measure_model, without_effects
from linid.export.registry import all_targets
from linid.export.target import Exported
from tests.export.axes import HELD, LOST, ahead, axis, made


def rms(errors: list[np.ndarray]) -> float:
    """Root mean square of all, in m."""
    return float(np.sqrt(np.mean(np.square(np.concatenate(errors)))))


def main(model: str = "", campaign: str = "") -> None:
    """Print the table. model, campaign: paths."""
    if model:
        result, recordings = linid.load(model).result, tuple(linid.read(campaign))
    else:
        held = {name: HELD[name] for name in ("cogging", "constant_force", "cable_force", "quadratic_drag")}
        result = axis(held, LOST)
        recordings = made(result, 0.9, 1.2, 1.5)
    driven = tuple(r for r in held_out(recordings) if r.kind != "free_wheel")
    measured = measure_model(result, None, driven)
    whole = Exported(result, "axis", recordings=recordings)
    base, full = ([ahead(one, r) for r in driven] for one in (without_effects(result), result))
    lines = [f"{len(driven)} held-out recordings, effects {', '.join(result.effects)}", ""]
    lines += ["| target | stated: keeps of the closed gap | linid from the same states | MuJoCo |", "|---|---|---|---|"]
    for name, target in all_targets().items():
        if target.whole:
            continue
        form = target.simplified(whole)
        stated = next(k.share for k in measure_loss(measured, form, driven).kept if k.measure == "ahead")
        rows = [[ahead(form, r) for r in driven]]
        if name == "mujoco":
            text = target.files(whole)["axis.xml"].decode()
            rows.append([ahead(form, r, text) for r in driven])
        shares = [(rms(base) - rms(row)) / (rms(base) - rms(full)) for row in rows]
        texts = [f"{100.0 * share:.1f} %" for share in (stated, *shares)]
        lines.append(f"| {name} | " + " | ".join([*texts, *["-"] * (3 - len(texts))]) + " |")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
