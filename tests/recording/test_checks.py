"""Checks of recordings: synthetic ones with known coherence, shift, resolution ..., and real ones with known facts."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from shared_data import shared

from linid.recording import (
    ChannelMapping,
    Recording,
    RecordingChecks,
    all_findings,
    checks_data,
    checks_of,
    checks_table,
    joined_findings,
    read_campaign,
    read_recording,
)
from linid.recording.noise import noise_level, quantum

STAND = Path(__file__).resolve().parents[2] / "data" / "stand" / "campaign.yaml"
DT = 1e-3
T = np.arange(8000) * DT


@lru_cache
def waves(seed: int, shift: float = 0.0, power: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """A noise of 400 sines from 5 to 80 Hz and the same twice integrated, both late by `shift` s; variance `power`."""
    random = np.random.default_rng(seed)
    f, phase = random.uniform(5.0, 80.0, 400), random.uniform(0.0, 2.0 * np.pi, 400)
    angle = 2.0 * np.pi * f * (T[:, None] - shift) + phase
    size = np.sqrt(2.0 * power / f.size)
    return np.sum(size * np.cos(angle), axis=1), np.sum(-size / (2.0 * np.pi * f) ** 2 * np.cos(angle), axis=1)


def driven(shift: float = 0.0, disturbance: float = 0.0, sign: float = 1.0, **kwargs: object) -> Recording:
    """A free mass pushed by noise (1 A, 1 m/s^2 per A) and by a disturbance of another seed and the given power."""
    u, _ = waves(1)
    _, y = waves(1, shift)
    if disturbance:
        y = y + waves(2, power=disturbance)[1]
    return Recording("moved", T.copy(), y, drive_input=sign * u, **kwargs)  # type: ignore[arg-type]


def one(recording: Recording) -> RecordingChecks:
    return checks_of([recording])[0]


def said(checks: RecordingChecks) -> set[str]:
    return {f.check for f in checks.findings}


@pytest.mark.parametrize("disturbance", [0.0, 0.25, 1.0, 4.0])
def test_coherence_is_the_share_of_the_power_that_follows(disturbance: float) -> None:
    checks = one(driven(disturbance=disturbance))
    assert checks.coherence.judged
    assert checks.coherence.value == pytest.approx(1.0 / (1.0 + disturbance), abs=0.06)
    assert 4.0 < checks.coherence.low < 8.0 and 75.0 < checks.coherence.high < 90.0
    assert ("coherence" in said(checks)) == (disturbance >= 1.0)


def test_an_input_that_has_nothing_to_do_with_the_motion_is_told() -> None:
    checks = one(replace(driven(), drive_input=waves(9)[0]))
    assert checks.coherence.value < 0.1 and abs(checks.coherence.correlation) < 0.1
    (found,) = [f for f in checks.findings if f.check == "coherence"]
    assert found.level == "warning" and f"{checks.coherence.value:.2f}" in found.text


def test_resonances_and_viscous_friction_are_no_lack_of_coherence() -> None:
    """Two masses on a spring: the motor's acceleration is far from proportional to the input, but follows it."""
    random = np.random.default_rng(4)
    u = np.convolve(random.standard_normal(T.size * 4), np.hanning(40), mode="same")
    y = v = load = w = 0.0
    out = np.empty(u.size)
    stiff = (2.0 * np.pi * 12.0) ** 2
    for k, push in enumerate(u):
        force = stiff * (load - y) + 2.0 * (w - v)
        v += 0.25 * DT * (push + force - 3.0 * v)
        w += 0.25 * DT * (-force)
        y, load = y + 0.25 * DT * v, load + 0.25 * DT * w
        out[k] = y
    checks = one(Recording("spring", T.copy(), out[::4].copy(), drive_input=u[::4].copy()))
    assert checks.coherence.value > 0.9 and not said(checks)


@pytest.mark.parametrize("shift", [0.0, 0.3e-3, 2.4e-3, -3.2e-3])
def test_the_shift_between_the_channels_is_found_below_a_sample(shift: float) -> None:
    checks = one(driven(shift=shift, disturbance=0.02))
    assert checks.delay.sharp
    assert checks.delay.seconds == pytest.approx(shift, abs=max(3.0 * checks.delay.deviation, 5e-6))
    assert checks.delay.deviation < 2e-4
    found = [f for f in checks.findings if f.check == "shift"]
    assert [f.level for f in found] == ([] if abs(shift) < DT else ["note" if shift > 0.0 else "warning"])


def test_no_shift_is_claimed_of_an_input_without_breadth() -> None:
    u = np.sin(2.0 * np.pi * 7.0 * T)
    assert not one(Recording("sine", T.copy(), -u / (2.0 * np.pi * 7.0) ** 2, drive_input=u)).delay.sharp


def test_a_wrong_sign_is_told_only_where_it_shows() -> None:
    damped = one(driven())
    assert damped.coherence.correlation > 0.9 and "sign" not in said(damped)
    # Against viscous friction the push does work, and both signs are told apart.
    u, _ = waves(1)
    speed = np.gradient(waves(1)[1], DT)
    for sign in (1.0, -1.0):
        braked = one(Recording("braked", T.copy(), waves(1)[1], drive_input=sign * (u + 40.0 * speed)))
        assert np.sign(braked.coherence.work) == sign and ("sign" in said(braked)) == (sign < 0.0)
    mixed = checks_of([replace(driven(), name=f"r{k}") for k in range(4)] + [replace(driven(sign=-1.0), name="odd")])
    assert {f.recording for f in all_findings(mixed) if f.check == "sign" and "others" in f.text} == {"odd"}


def test_free_wheels_slow_moves_and_short_ones_are_not_judged() -> None:
    free = one(Recording("free", T.copy(), 0.3 * (1.0 - np.exp(-T)), kind="free_wheel"))
    slow_y = 0.05 * np.sin(2.0 * np.pi * 0.3 * T)
    random = np.random.default_rng(3)
    # Friction takes all of the input; what remains is the controller's noise.
    push = 2.0 * np.sign(np.cos(2.0 * np.pi * 0.3 * T)) + 0.1 * random.standard_normal(T.size)
    slow = one(Recording("slow", T.copy(), np.round(slow_y, 7), drive_input=push))
    short = one(Recording("short", T[:280].copy(), waves(1)[1][:280], drive_input=waves(1)[0][:280]))
    constant = one(Recording("constant", T.copy(), 0.5 * T**2, drive_input=np.ones(T.size)))
    for checks in (free, slow, short, constant):
        assert not checks.coherence.judged and checks.coherence.reason
        assert not {"coherence", "sign", "shift"} & said(checks)


def test_currents_that_turn_with_the_position_tell_field_and_push() -> None:
    u, y = waves(1)
    y = 300.0 * y  # several periods of the field
    angle = 210.0 * y + 0.4
    currents = np.stack([u * np.cos(angle - 2.0 * np.pi / 3.0 * j) for j in range(3)])
    noise = np.random.default_rng(2).normal(0.0, 0.01, currents.shape)
    checks = one(Recording("phases", T.copy(), y, phase_currents=currents + noise))
    assert checks.commutation.wavenumber == pytest.approx(210.0, rel=1e-3) and checks.commutation.agreement > 0.98
    assert checks.coherence.judged and checks.coherence.value > 0.95
    still = one(Recording("still", T.copy(), y, phase_currents=np.stack([u, -0.5 * u, -0.5 * u])))
    assert np.isnan(still.commutation.wavenumber) and "position" in still.coherence.reason
    known = checks_of([Recording("still", T.copy(), y, phase_currents=np.stack([u, -0.5 * u, -0.5 * u]))], [u])
    assert known[0].coherence.value > 0.95


@pytest.mark.parametrize(("pairs", "expected"), [(7.0, set()), (6.6, {"pole pairs"}), (1.0, {"pole pairs"})])
def test_pole_pairs_are_whole(pairs: float, expected: set[str]) -> None:
    turns = 3.0 * np.sin(2.0 * np.pi * 0.4 * T) + 4.0 * T
    i = 2.0 * np.cos(2.0 * np.pi * 0.7 * T)
    currents = np.stack([i * np.cos(pairs * turns - 2.0 * np.pi / 3.0 * j) for j in range(3)])
    checks = one(Recording("motor", T.copy(), turns, phase_currents=currents, axis="rotary"))
    assert checks.commutation.wavenumber == pytest.approx(pairs, rel=1e-3)
    assert said(checks) & {"pole pairs"} == expected


@pytest.mark.parametrize("step", [1e-6, 2.0 * np.pi / 8192, 0.25])
def test_the_step_of_an_encoder_is_found(step: float) -> None:
    y = 300.0 * step * np.sin(3.0 * T) + 5.0 * step * np.sin(70.0 * T)
    assert quantum(np.round(y / step) * step) == pytest.approx(step, rel=1e-3)
    printed = np.round(np.round(y / step) * step, 7 if step < 1e-3 else 4)
    assert quantum(printed) == pytest.approx(step, rel=2e-2)
    assert quantum(y + np.random.default_rng(1).normal(0.0, step, y.size)) == 0.0


@pytest.mark.parametrize("step", [1e-6, 5e-6, 1e-5])
def test_the_travel_per_sample_is_no_step_of_an_encoder(step: float) -> None:
    """An even, fast motion: some hundred steps per sample, a few more or less."""
    y = 0.5 * T + 0.01 * np.sin(6.0 * T)
    assert quantum(np.round(y / step) * step) == pytest.approx(step, rel=1e-6)
    assert quantum(y) == 0.0


def test_slow_motion_hides_between_the_steps_of_the_encoder() -> None:
    step = 1e-4
    y = np.round(0.02 * T / step) * step  # 0.2 steps per sample
    slow = one(Recording("slow", T.copy(), y, kind="free_wheel"))
    assert slow.resolution.step == pytest.approx(step) and slow.resolution.slow > 0.95
    assert slow.resolution.noise == pytest.approx(step / np.sqrt(12.0), rel=0.5)
    assert "resolution" in said(slow)
    random = np.random.default_rng(1)
    fast = one(Recording("fast", T.copy(), np.round(0.3 * np.sin(9.0 * T) / 1e-6 + random.normal(size=T.size)) * 1e-6))
    assert fast.resolution.slow < 0.1 and "resolution" not in said(fast)
    # Noise of one step, differentiated by the same cubic over 15 ms elsewhere: 1.1e-6 m leave 0.025 m/s^2.
    assert fast.resolution.floor == pytest.approx(1.04e-6 * 23700.0, rel=0.1)


def test_a_position_that_is_held_for_two_samples_is_told() -> None:
    y = np.round(0.2 * np.sin(4.0 * T), 6)
    held = one(Recording("held", T.copy(), np.repeat(y[::2], 2)))
    assert held.resolution.held == pytest.approx(0.5, abs=0.03) and "held" in said(held)
    assert "held" not in said(one(Recording("fresh", T.copy(), y)))


def test_saturation_is_a_rest_and_not_a_peak() -> None:
    random = np.random.default_rng(6)
    sine = 5.0 * np.sin(2.0 * np.pi * 3.0 * T) + random.normal(0.0, 0.01, T.size)
    y = waves(1)[1]
    cut = np.clip(5.0 * np.sin(2.0 * np.pi * 3.0 * T), -3.0, 3.0) + random.normal(0.0, 0.01, T.size)
    assert one(Recording("sine", T.copy(), y, drive_input=sine)).saturation.share == 0.0
    found = one(Recording("cut", T.copy(), y, drive_input=cut))
    assert found.saturation.share == pytest.approx(1.0 - 2.0 * np.arcsin(0.6) / np.pi, abs=0.03)
    assert found.saturation.level == pytest.approx(3.0, abs=0.02) and "saturation" in said(found)
    rate = 40.0
    slewed = np.cumsum(np.clip(np.diff(5.0 * np.sin(2.0 * np.pi * 3.0 * T), prepend=0.0), -rate * DT, rate * DT))
    limited = one(Recording("slewed", T.copy(), y, drive_input=slewed))
    assert limited.saturation.rate_share > 0.5 and limited.saturation.rate == pytest.approx(rate, rel=0.02)


def test_wraps_and_counts_left_in_the_position_are_told() -> None:
    turns = 5.0 * T
    wrapped = np.mod(turns, 2.0 * np.pi) + 100.0 * (T > 9.0)
    jumps = one(Recording("wrapped", T.copy(), wrapped, axis="rotary", kind="free_wheel"))
    assert jumps.angle.jumps == int(turns[-1] / (2.0 * np.pi)) and jumps.angle.equal
    assert jumps.angle.jump == pytest.approx(2.0 * np.pi, rel=0.01)
    assert any("wrap is left" in f.text and "1 turns" in f.text for f in jumps.findings)
    counts = one(Recording("counts", T.copy(), np.rint(1000.0 * T), axis="rotary", kind="free_wheel"))
    assert counts.angle.whole and "unit" in said(counts)
    ordinary = one(Recording("ordinary", T.copy(), turns, axis="rotary", kind="free_wheel"))
    assert not {"jumps", "unit"} & said(ordinary)


def test_an_end_stop_is_a_rest_against_a_push() -> None:
    u, y = waves(1)
    y = 50.0 * y
    stop = np.quantile(y, 0.999)
    pressed = (T > 5.0) & (T < 5.6)
    hit = one(
        Recording("hit", T.copy(), np.where(pressed, stop, np.minimum(y, stop)), drive_input=np.where(pressed, 3.0, u))
    )
    assert hit.end_stop.side == 1 and hit.end_stop.seconds == pytest.approx(0.6, abs=0.02) and "end stop" in said(hit)
    assert one(driven()).end_stop.side == 0


def export(path: Path, t: np.ndarray, extra: float = 0.0) -> Path:
    u, y = waves(1)
    rows = [f"{a:.7f},{1e3 * b:.3f},{c:.4f}" for a, b, c in zip(t, 1e3 * y + extra, u, strict=True)]
    path.write_text("\n".join(["Time (s),Position (mm),Q-Current (A)", *rows]))
    return path


def test_what_the_reader_did_to_the_clock_is_kept_in_numbers(tmp_path: Path) -> None:
    random = np.random.default_rng(8)
    uneven = T + random.normal(0.0, 0.05 * DT, T.size)
    read = read_recording(export(tmp_path / "uneven.csv", uneven))
    assert read.reading is not None and read.reading.resampled
    assert read.reading.jitter == pytest.approx(0.05 * np.sqrt(2.0), rel=0.05)
    assert read.reading.position_step == pytest.approx(1e-6, rel=1e-3)
    assert read.reading.input_step == pytest.approx(1e-4, rel=1e-3)
    checks = one(read)
    assert "clock" in said(checks) and checks.reading.jitter == read.reading.jitter
    lines = export(tmp_path / "even.csv", T).read_text().splitlines()
    del lines[3001:3004], lines[5001:5002]  # three samples and one
    lines[700] = lines[700].replace(lines[700].split(",")[1], "bad")
    lines.insert(100, lines[99])
    (tmp_path / "gaps.csv").write_text("\n".join(lines))
    facts = read_recording(tmp_path / "gaps.csv").reading
    assert facts is not None
    assert (facts.gaps, facts.missing, facts.filled, facts.left_out, facts.cut) == (2, 4, 1, 1, 0)
    assert facts.longest_gap == pytest.approx(4.0 * DT, rel=1e-3)
    del lines[2001:2501]
    (tmp_path / "cut.csv").write_text("\n".join(lines))
    halved = read_recording(tmp_path / "cut.csv")
    assert halved.reading is not None and halved.reading.cut == 2000 - 1
    assert {"cut", "gaps"} <= said(one(halved))


def test_a_wrapped_position_is_noted(tmp_path: Path) -> None:
    angle = np.degrees(np.mod(5.0 * T, 2.0 * np.pi))
    lines = ["Time (s),Position (deg)", *(f"{a:.4f},{b:.4f}" for a, b in zip(T, angle, strict=True))]
    (tmp_path / "turns.csv").write_text("\n".join(lines))
    facts = read_recording(tmp_path / "turns.csv", axis="rotary").reading
    assert facts is not None and facts.wraps == 6 and facts.wrap == pytest.approx(2.0 * np.pi)


def test_those_that_differ_from_all_others_are_named() -> None:
    plain = [replace(driven(disturbance=0.05), name=f"r{k}") for k in range(5)]
    odd = replace(driven(disturbance=2.0), name="disturbed")
    slow = replace(driven(), name="slow", t=2.0 * T)
    found = [f for c in checks_of([*plain, odd, slow]) for f in c.findings]
    assert {f.recording for f in found if f.check == "coherence"} == {"disturbed"}
    assert {f.recording for f in found if f.check == "period"} == {"slow"}


def test_table_and_json_hold_all_recordings() -> None:
    checks = checks_of([driven(), replace(driven(disturbance=4.0), name="other")])
    header, rows = checks_table(checks)
    assert [row[0] for row in rows] == ["moved", "other"] and all(len(row) == len(header) for row in rows)
    data = json.loads(json.dumps(checks_data(checks), allow_nan=False))
    assert data[0]["coherence"]["value"] == pytest.approx(1.0, abs=0.05) and data[1]["findings"][0]["check"]
    levels = [level for level, _, _ in joined_findings(checks)]
    assert levels == sorted(levels, reverse=True)  # warnings first


def test_noise_level_is_where_it_was() -> None:
    from linid.identification.signals import motion

    assert motion.noise_level is noise_level


def test_the_stand_is_in_order_and_its_field_is_seen() -> None:
    """True: 222.0 rad/m (twice the theta field's 111), no delay, no disturbance, 0.1 um and 1 mA."""
    checks = checks_of(read_campaign(STAND).recordings)
    seen = [c.commutation.wavenumber for c in checks if np.isfinite(c.commutation.wavenumber)]
    assert len(seen) >= 12 and max(abs(w / 222.0 - 1.0) for w in seen) < 2e-3
    assert all(c.resolution.step == pytest.approx(1e-7, rel=1e-6) for c in checks)
    assert all(c.reading.input_step == pytest.approx(1e-3, rel=1e-6) for c in checks if c.kind == "motor")
    assert not [f for f in all_findings(checks) if f.level == "warning"]
    assert sum(c.coherence.judged and c.coherence.value > 0.9 for c in checks) >= 4


TWO_MASS = {
    "time": {"column": "time", "unit": "us"},
    "position": {"column": "theta_mx", "unit": "rad"},
    "current_q": {"column": "iq_adx", "unit": "A"},
}


@pytest.mark.parametrize("file", ["A", "B"])
def test_the_two_mass_bench_follows_its_input(file: str) -> None:
    """Both multisines: at the frequencies that they hold, all motion follows the current; resonance and
    antiresonance do not disturb that. File A holds every hertz, file B every fourth: between its lines there is no
    input to follow, and a coherence averaged over all frequencies says 0.5 of it."""
    path = shared("real", "two_mass", f"MultisineType{file}.mat")
    checks = one(read_recording(path, channels=ChannelMapping.model_validate(TWO_MASS), axis="rotary"))
    assert checks.coherence.judged and checks.coherence.value > 0.995
    assert checks.resolution.step == pytest.approx(2.0 * np.pi / 2**20, rel=1e-3)
    assert not [f for f in checks.findings if f.level == "warning"]


def test_the_current_of_another_file_is_told() -> None:
    """The motor angle of one multisine against the current of the other: most of it does not follow."""
    campaign = read_campaign(shared("real", "two_mass", "campaign.yaml"))
    first, second = campaign.recordings[:2]
    checks = one(replace(first, drive_input=second.drive_input))
    assert checks.coherence.value < 0.7 and "coherence" in said(checks)


def test_odrive_is_uneven_and_not_judged() -> None:
    """Stamps of a computer: 5 to 9 % jitter; constant-current spin-ups and slow moves that fight the cogging."""
    checks = checks_of(read_campaign(shared("real", "odrive", "campaign.yaml")).recordings)
    assert all(0.04 < c.reading.jitter < 0.1 and c.reading.resampled for c in checks)
    assert not any(c.coherence.judged for c in checks)
    assert {f.recording for f in all_findings(checks) if f.check == "period"} == {"slow2_nocomp_0", "slow2_nocomp_1"}
    assert not [f for f in all_findings(checks) if f.level == "warning"]


def test_mn4004_answers_its_motion_in_slow_moves() -> None:
    """20 000 counts per turn; under slow speed control the current follows the cogging, not the other way round."""
    checks = {c.name: c for c in checks_of(read_campaign(shared("real", "mn4004", "campaign.yaml")).recordings)}
    assert all(c.resolution.step == pytest.approx(2.0 * np.pi / 20000, rel=1e-3) for c in checks.values())
    assert {f.recording for c in checks.values() for f in c.findings if f.level == "warning"} == {"slow_1", "slow_2"}
    assert checks["slow_1"].delay.seconds < -3e-3
    assert checks["accelerate"].coherence.value > 0.99


def test_gravity_moves_the_pendulum_besides_its_drive() -> None:
    checks = checks_of(read_campaign(shared("real", "pendulum", "campaign.yaml")).recordings)
    warned = {f.recording for f in all_findings(checks) if f.level == "warning"}
    assert warned == {"energy", "energy_2"}  # the others are too short or too slow to be judged
    assert all(c.resolution.step == pytest.approx(0.0029145, rel=1e-3) for c in checks)


def test_emps_is_in_order() -> None:
    channels = ChannelMapping.model_validate(
        {
            "time": {"column": "t", "unit": "s"},
            "position": {"column": "qm", "unit": "m"},
            "command": {"column": "vir", "unit": "V"},
        }
    )
    files = [shared("emps", name) for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")]
    checks = checks_of([read_recording(path, channels=channels) for path in files])
    assert all(c.coherence.judged and c.coherence.value > 0.99 and not c.findings for c in checks)
