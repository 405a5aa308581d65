"""What the claims are judged by: signs, the thrust of table 2, lengths of searches, and words that follow numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from linid.diagnosis.gap import RecordingGap
from linid.identification.result import Generation
from linid.reproduction.claim import Claim
from linid.reproduction.claims import Evidence, claims, impossible
from linid.reproduction.evidence import (
    Fitted,
    Measured,
    Search,
    Signs,
    Times,
    search_of,
    signs_of,
    sine_thrust,
    table_2_thrust,
    thrust_range,
)
from linid.reproduction.printed import TABLE_1, TABLE_2, TABLE_3, meant
from tests.compiled_motor import thrust
from tests.report.samples import fit_result
from tests.reproduction.test_further import USUAL

STAND = {
    "force_constant": 30.0,
    "electrical_wavenumber": 222.0,
    "winding_displacement": 2 * math.pi / 3,
    "commutation_offset": 1.5,
}


def test_the_thrust_is_that_of_the_compiled_motor() -> None:
    random = np.random.default_rng(2)
    y, currents = random.uniform(0.0, 0.5, 50), random.normal(size=(3, 50))
    values = meant(TABLE_2)
    compiled = [thrust("sine", values, a, i) for a, i in zip(y, currents.T, strict=True)]
    assert sine_thrust(values, y, currents) == pytest.approx(compiled, rel=1e-12)


def test_three_phase_windings_push_alike_everywhere() -> None:
    """With 120 degrees between the windings 1 A (peak) gives 3/2 K_f at every place; other windings do not."""
    low, high = thrust_range(STAND)
    assert low == pytest.approx(45.0, rel=1e-4) and high == pytest.approx(45.0, rel=1e-4)
    # Sequences: forward and backward gain K_f/2 (1 + 2 cos(alpha_p -+ 120 degrees)) add up or cancel.
    alpha, constant = 0.5368, 133.8
    forward, backward = (constant / 2 * (1 + 2 * math.cos(alpha + s * 2 * math.pi / 3)) for s in (1, -1))
    low, high = table_2_thrust()
    assert high == pytest.approx(abs(forward) + abs(backward), rel=1e-4)
    assert low == pytest.approx(abs(abs(forward) - abs(backward)), rel=1e-3)


def test_what_signs_mean() -> None:
    signs = signs_of(STAND, seed=3)
    assert signs.negated < 1e-12 and signs.exchanged < 1e-12
    assert signs.exchanged_negated > 0.5


def test_the_length_of_a_search() -> None:
    lines = [("genetic", 0, 5.0), ("genetic", 1, 1.005), ("genetic", 2, 1.0), ("least_squares", 1, 0.5)]
    history = tuple(Generation(stage, number, 10 * number, best, best) for stage, number, best in lines)
    result = replace(fit_result(), history=history, evaluations=77)
    assert search_of(result) == Search(1, 2, 77)
    assert search_of(replace(result, history=())) == Search(0, 0, 0)


def test_table_3_as_printed_contradicts_table_2() -> None:
    second, third = meant(TABLE_2), meant(TABLE_3)
    assert abs(second["winding_displacement"] - 2.0 * third["winding_displacement"]) > 2.0
    assert [row for row in TABLE_3 if row.name in meant(TABLE_1)] == list(TABLE_1[:-1])
    words = " ".join(str(one) for one in impossible((19.0, 119.0)))
    assert "147 mm" in words and "0.15 mm" in words and "2517 N" in words and "1.5 mm" in words
    assert "1.75 pole pitches" in words and "k = 0.535" in words and "1.047 is pi/3" in words


def gap(name: str, *, free_run: float = 1e-4, floor: float = 1e-4, force: float = 0.1) -> Measured:
    kind = "free_wheel" if name.startswith("free") else "motor"
    return Measured(RecordingGap(name, kind, "fit", free_run, floor, 1e-5, 1e-5, force, 0.01, 0.05), 1e-3)


def evidence(*, sine_force: float, narrow_force: float, ratio: float, wheel: float = 1e-4) -> Evidence:
    def fitted(force: float, free_run: float = 1e-4) -> Fitted:
        found = [gap("freewheel_1", free_run=free_run), gap("square_current_1", force=force), gap("sine_current_1")]
        result = replace(fit_result(), estimates=(*fit_result().estimates, nome()))
        return Fitted(result, {m.gap.recording: m for m in found})

    def nome() -> object:
        return replace(fit_result().estimates[0], name="nome", value=0.5, status="not_identifiable")

    return Evidence(
        friction=fitted(0.1),
        sine=fitted(sine_force, wheel),
        theta=fitted(0.1),
        narrow_sine=fitted(narrow_force),
        narrow_theta=fitted(0.1),
        times=Times("x", 1e-3, ratio * 1e-3, ratio, 20.0),
        searches={"sine": Search(30, 40, 4000), "theta": Search(20, 40, 4000)},
        signs=Signs(0.0, 0.0, 1.4),
        table_2_thrust=(19.0, 119.0),
        further=USUAL,
    )


def drifting(found: Evidence, floor: float) -> Evidence:
    """The same with a sine model that drifts by 160 mm in a free run, 2.5 times the motion's standard deviation."""
    name = "sine_current_1"
    far = replace(gap(name, free_run=2.5, floor=floor), drift=0.16)
    near = gap(name, free_run=0.004, floor=floor)
    return replace(
        found,
        sine=replace(found.sine, measured={**found.sine.measured, name: far}),
        theta=replace(found.theta, measured={**found.theta.measured, name: near}),
    )


def verdict(found: Evidence, words: str) -> Claim:
    (claim,) = (one for one in claims(found) if words in one.claim)
    return claim


def test_verdicts_follow_the_numbers() -> None:
    usual = evidence(sine_force=0.1, narrow_force=0.1, ratio=1.1)
    assert verdict(usual, "square-wave").verdict == "does not hold"
    assert verdict(evidence(sine_force=0.1, narrow_force=0.3, ratio=1.1), "square-wave").verdict == "holds in part"
    assert verdict(evidence(sine_force=0.3, narrow_force=0.3, ratio=1.1), "square-wave").verdict == "holds"
    assert verdict(usual, "ten to twenty").verdict == "does not hold"
    assert verdict(evidence(sine_force=0.1, narrow_force=0.1, ratio=12.0), "ten to twenty").verdict == "holds"
    assert verdict(usual, "fidelity").verdict == "holds"
    assert (
        verdict(evidence(sine_force=0.1, narrow_force=0.1, ratio=1.0, wheel=0.01), "fidelity").verdict
        == "does not hold"
    )
    assert verdict(usual, "Theta drifts").verdict == "cannot be told"  # the free runs are at their floor
    assert verdict(drifting(usual, 0.001), "Theta drifts").verdict == "holds"
    assert verdict(drifting(usual, 1.3), "Theta drifts").verdict == "cannot be told"  # noise alone loses step
    assert "0.0001 to 1.3 times the motion" in verdict(drifting(usual, 1.3), "Theta drifts").found
    assert "noise of the logged currents does it" in verdict(drifting(usual, 1.3), "Theta drifts").reason
    assert "Beyond what the noise" in verdict(drifting(usual, 0.001), "Theta drifts").reason
    assert verdict(usual, "nome").verdict == "cannot be told"
    assert "500 times fewer" not in verdict(usual, "generations").reason
    assert f"{10_000 // 30} times fewer" in verdict(usual, "generations").reason
