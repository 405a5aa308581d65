"""The paper's claims in words, each beside what was found; the words follow from the numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from linid.physics.field.guideway import k_of
from linid.physics.field.sine_scope import PAPER_FIT, limit_k
from linid.reproduction.claim import Claim, Verdict
from linid.reproduction.evidence import Fitted, Measured, Search, Signs, Times
from linid.reproduction.further_claims import further_claims
from linid.reproduction.further_evidence import Further
from linid.reproduction.printed import TABLE_1, TABLE_2, TABLE_3, meant

SQUARE, OPEN_LOOP = "square_current", ("square_current", "sine_current")
_CLEARLY = 1.5  # times as large, or more, counts as worse
_LOST = 0.5  # of the motion's standard deviation: noise alone loses step, and how far a run goes from there is chance
_PEAK_THRUST = 180.0  # N, of the paper's drive


@dataclass(frozen=True)
class Impossible:
    """A printed number that cannot be, what speaks against it, and what can be meant."""

    what: str
    printed: str
    against: str
    meant: str


@dataclass(frozen=True)
class Evidence:
    """All that the claims are judged by. friction, sine, theta: fits of the stand; narrow_*: of the narrow one."""

    friction: Fitted
    sine: Fitted
    theta: Fitted
    narrow_sine: Fitted
    narrow_theta: Fitted
    times: Times
    searches: Mapping[str, Search]
    signs: Signs
    table_2_thrust: tuple[float, float]
    further: Further


def claims(evidence: Evidence) -> tuple[Claim, ...]:
    """The paper's claims: those that it draws from its results, then those by the way."""
    return (
        _scope(),
        _free_wheels(evidence),
        _square_waves(evidence),
        _signs(evidence.signs),
        _drift(evidence),
        _nome(evidence),
        _time(evidence.times),
        _generations(evidence.searches),
        *further_claims(evidence.further),
    )


def impossible(table_2_thrust: tuple[float, float]) -> tuple[Impossible, ...]:
    """Where the paper's numbers cannot be, with the consequence that shows it."""
    return (
        *_impossible_units(),
        *_impossible_windings(table_2_thrust),
        Impossible(
            "friction, table 3",
            "equal to table 1 in every digit",
            "the text says that it changed in the theta fit",
            "perhaps table 1 was printed twice",
        ),
        Impossible(
            "limit of the scope (25)",
            f"k_0 = {PAPER_FIT[0]}",
            f"the exact limit is {limit_k():.5f}; k_0 is the "
            "constant of a fit on N up to 100 whose exponential dies out faster than the k_N, which approach it as 1/N",
            f"{limit_k():.5f}",
        ),
    )


def _impossible_units() -> tuple[Impossible, ...]:
    first, density = meant(TABLE_1), meant(TABLE_2)["electrical_wavenumber"]
    coulomb, stiffness = first["coulomb_force"], first["bristle_stiffness"]
    return (
        Impossible(
            "K_f, tables 2 and 3",
            "-133.8 N, 80.63 N",
            "force per current has the unit N/A; a force in N would not depend on the current",
            "N/A",
        ),
        Impossible(
            "sigma_0, tables 1 to 3",
            "11.69 N/m",
            f"the bristle would give by F_C/sigma_0 = "
            f"{1e6 * coulomb / stiffness:.0f} mm before the forcer slides, of a stroke of 780 mm",
            f"11.69 N/mm: {1e6 * coulomb / stiffness / 1e3:.2f} mm",
        ),
        Impossible(
            "sigma_1, sigma_2, tables 1 to 3",
            "92.14 and 2.517 N s/mm",
            f"at 1 m/s sigma_2 alone would brake with "
            f"{1e3 * first['viscous_friction']:.0f} N; the drive's peak is {_PEAK_THRUST:.0f} N",
            "N s/m",
        ),
        Impossible(
            "z_0, table 3",
            "1.047 1/mm",
            f"a pole pitch of {math.pi / 2 / 1.047:.1f} mm, where table 2 says "
            f"{1e3 * math.pi / density:.2f} mm; by eq. 35 z_0 = omega_g/2 = {density / 2e3:.3f} 1/mm",
            f"perhaps 1.047 1/cm: {10 * math.pi / 2 / 1.047:.1f} mm; or rows are mixed up, for 1.047 is pi/3, the "
            "z_p of windings 120 degrees apart",
        ),
    )


def _impossible_windings(table_2_thrust: tuple[float, float]) -> tuple[Impossible, ...]:
    second, third = meant(TABLE_2), meant(TABLE_3)
    low, high = table_2_thrust
    return (
        Impossible(
            "alpha_p and z_p",
            "0.5368 and 1.513",
            f"both describe the same windings, so alpha_p = 2 z_p; they differ: "
            f"{second['winding_displacement']:.3f} against {2 * third['winding_displacement']:.3f} rad",
            "windings 120 degrees apart: alpha_p = 2.094, z_p = 1.047",
        ),
        Impossible(
            "z_L, table 3",
            "-1.376",
            f"by (37) a coil of {4.0 * abs(third['winding_length']) / math.pi:.2f} pole pitches, hardly to be put "
            "beside others two thirds of a pitch away",
            f"perhaps 2 z_L, the electrical angle: {2.0 * abs(third['winding_length']) / math.pi:.2f} pole pitches",
        ),
        Impossible(
            "q_0, table 3",
            "0.493",
            f"k = {k_of(third['nome']):.3f} by (35), where sec. 4.1 has k = 0.5 for magnets without space between them",
            "no Gaussians: the third harmonic of flat-topped fields can be as small",
        ),
        Impossible(
            "alpha_p, table 2",
            "0.5368",
            f"1 A of three-phase current would push by {low:.0f} N at one place and by "
            f"{high:.0f} N at another, within a pole pitch",
            "as above; a motor identified so shakes at each step of "
            "the current, which may be what the paper saw with square waves",
        ),
    )


def _scope() -> Claim:
    return Claim(
        f"The sine model is for motors with k = {PAPER_FIT[0]}.",
        "sec. 4.1, eq. 25, fig. 6",
        "holds in part",
        f"The optimum of a cosine whose amplitude is held at B_0 lies at k = {limit_k():.5f}.",
        "An identified force constant is free, and then a sine is the better the larger k is; what counts are the "
        "harmonics, and of these the third cancels while the currents sum to zero.",
    )


def _free_wheels(evidence: Evidence) -> Claim:
    wheels = {
        name: max(m.gap.free_run for m in fitted.measured.values() if m.gap.kind == "free_wheel")
        for name, fitted in (("friction", evidence.friction), ("sine", evidence.sine), ("theta", evidence.theta))
    }
    floor = max(m.gap.free_run_floor for m in evidence.friction.measured.values() if m.gap.kind == "free_wheel")
    worst = max(wheels.values())
    verdict: Verdict = "holds" if worst < _CLEARLY * max(wheels["friction"], floor) else "does not hold"
    listed = ", ".join(f"{name} {100 * share:.2g} %" for name, share in wheels.items())
    return Claim(
        "Sine and theta keep the fidelity to the free wheels, although their friction differs.",
        "secs. 5.2, 5.3",
        verdict,
        f"Largest free-run error of the free wheels: {listed}; floor {100 * floor:.2g} %.",
        "Free wheels and driven recordings are fitted together, each weighed by its own noise.",
    )


def _square_waves(evidence: Evidence) -> Claim:
    found, ratios = [], []
    stands = (
        ("this stand", evidence.sine, evidence.theta),
        ("narrow magnets", evidence.narrow_sine, evidence.narrow_theta),
    )
    for name, sine, theta in stands:
        one, other = (_force(_of(fitted, (SQUARE,))) for fitted in (sine, theta))
        floor = max(m.gap.force_floor for m in _of(theta, (SQUARE,)))
        ratios.append(one / other)
        found.append(f"{name}: {one:.3g} N by sine, {other:.3g} N by theta (floor {floor:.2g} N)")
    worse = [ratio > _CLEARLY for ratio in ratios]
    verdict: Verdict = "holds" if all(worse) else "holds in part" if any(worse) else "does not hold"
    return Claim(
        "Under square-wave currents the sine model shakes, unlike the machine; theta follows.",
        "secs. 5.2, 5.3, 6",
        verdict,
        "Force error on square waves, " + "; ".join(found) + ".",
        "It depends on the magnets, not on the currents' shape: at the nome of table 3 nothing is left of the fifth "
        "harmonic, the first that currents with the sum zero leave, and both models push alike; narrow magnets have "
        "it. No balance is drawn up about the steps themselves, which fall between the samples of the currents. The "
        "windings of table 2 (see below) shake by themselves.",
    )


def _signs(signs: Signs) -> Claim:
    return Claim(
        "A negative force constant (or z_L) means that the phases are in inverted order.",
        "secs. 5.2, 5.3",
        "does not hold" if signs.exchanged_negated > 0.1 else "holds",
        f"K_f negative and the shift moved by half a turn: the same thrust (difference {signs.negated:.1g}). Phases "
        f"exchanged: the same thrust if alpha_p changes its sign ({signs.exchanged:.1g}); with K_f negative instead "
        f"the best shift still misses {100 * signs.exchanged_negated:.0f} %.",
        "The sign of K_f only says which pole is called north. The order of the phases is the sign of alpha_p.",
    )


def _drift(evidence: Evidence) -> Claim:
    names = [m.gap.recording for m in _of(evidence.sine, OPEN_LOOP)]
    means = {
        name: math.sqrt(math.fsum(m.drift**2 for m in _of(fitted, OPEN_LOOP)) / len(names))
        for name, fitted in (("sine", evidence.sine), ("theta", evidence.theta))
    }
    pairs = [(evidence.sine.measured[name].drift, evidence.theta.measured[name].drift) for name in names]
    drifts = [f"{name} {1e3 * a:+.1f} and {1e3 * b:+.1f} mm" for name, (a, b) in zip(names, pairs, strict=True)]
    gaps = [m.gap for fitted in (evidence.sine, evidence.theta) for m in _of(fitted, OPEN_LOOP)]
    within = all(gap.free_run < _CLEARLY * gap.free_run_floor or gap.free_run_floor > _LOST for gap in gaps)
    low, high = (pick(gap.free_run_floor for gap in gaps) for pick in (min, max))
    less = means["theta"] < means["sine"] / _CLEARLY
    verdict: Verdict = "cannot be told" if within else "holds" if less else "does not hold"
    return Claim(
        "Theta drifts less than sine.",
        "secs. 5.2, 5.3",
        verdict,
        f"Position error at the end of the free run, sine and theta: {'; '.join(drifts)}. The sensors' noise alone "
        f"would leave {low:.2g} to {high:.2g} times the motion (RMS).",
        "The noise of the logged currents does it: an axis driven by currents has no spring to bring it back. Where "
        "such noise alone loses step, how far which model goes is chance. When square waves step between two samples "
        "is found well enough: by currents without noise and this stand's own parameters they are followed."
        if within
        else "Beyond what the noise of the logged currents does.",
    )


def _nome(evidence: Evidence) -> Claim:
    estimate = next(e for e in evidence.theta.result.estimates if e.name == "nome")
    told = estimate.status == "fitted"
    interval = f"{estimate.low:.3g} to {estimate.high:.3g}"
    return Claim(
        "The identified nome 0.493 shows that a sine suits this motor.",
        "sec. 6",
        "holds" if told else "cannot be told",
        f"q_0 = {estimate.value:.3g}, 95 % interval {interval}."
        if told
        else f"The fit gives q_0 = {estimate.value:.3g}, and says that the recordings do not tell it.",
        "While the currents sum to zero, the third harmonic cancels, and K_f', q_0 and z_L act together as one "
        "constant. Feed one phase alone to tell them apart.",
    )


def _time(times: Times) -> Claim:
    verdict: Verdict = "holds" if times.ratio >= 10.0 else "does not hold"
    return Claim(
        "One simulation of theta takes ten to twenty times as long as one of sine.",
        "sec. 6",
        verdict,
        f"{times.ratio:.2f} times: {1e3 * times.theta:.2f} ms against {1e3 * times.sine:.2f} ms for {times.recording}. "
        f"Theta's force term by term as in (45) takes {times.term_by_term:.0f} times a sine's.",
        "All harmonics follow from one sine and one cosine by angle addition. Times are of the machine that made this "
        "page.",
    )


def _generations(searches: Mapping[str, Search]) -> Claim:
    sine, theta = searches["sine"], searches["theta"]
    claim, source = "Sine takes over 10 000 generations to converge, theta only 2 000.", "sec. 6"
    if min(sine.all, theta.all) == 0:
        return Claim(claim, source, "cannot be told", "The models come from no search.", "Give the results of fits.")
    longest = max(sine.generations, theta.generations)
    fewer = f"{10_000 // longest} times fewer generations" if longest else "no generation is needed for that"
    return Claim(
        claim,
        source,
        "holds" if sine.generations > 10_000 else "does not hold",
        f"Within 1 % of the search's last cost after {sine.generations} generations (sine) and {theta.generations} "
        f"(theta); {sine.evaluations} and {theta.evaluations} candidates simulated in all.",
        "The first candidates come from a regression along the measured motion and are refined by least squares before "
        f"the search: "
        f"{fewer}. Why theta should need fewer than sine, which it contains, was not to be seen.",
    )


def _of(fitted: Fitted, modes: Sequence[str]) -> list[Measured]:
    """The recordings of some scope modes, by their names."""
    return [m for name, m in sorted(fitted.measured.items()) if name.startswith(tuple(modes))]


def _force(measured: Sequence[Measured]) -> float:
    """RMS force error over recordings, N."""
    return math.sqrt(math.fsum(m.gap.force**2 for m in measured) / len(measured))
