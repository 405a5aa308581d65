"""reproduce: counterparts of the paper's tables and figures, and its claims beside what was found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import DataError
from linid.interface.reading import file_record
from linid.workflow.commands.reproduce_figures import CASES, drawn_by_voltage, drawn_in_closed_loop, figures
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import identity_of, open_run_folder, recorded, write_text

if TYPE_CHECKING:
    from linid.diagnosis.gap import Trace
    from linid.identification.result import FitResult
    from linid.physics.field.geometry import MotorDesign
    from linid.recording import Recording
    from linid.report.reproduction.page import Picture
    from linid.reproduction.evidence import Fitted
    from linid.reproduction.further_evidence import Further
    from linid.workflow.commands.reproduce_figures import Drawn
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

COMMAND = "reproduce"
VOLTAGE = "voltage_model"  # a MODEL that knows the windings
_IN_PRINT = tuple(f"figure_{number}_" for number in (14, 15, 16, 17))  # drawn as vectors too


def reproduce(
    request: Request,
    reporter: Reporter,
    *,
    models: Mapping[str, Path],
    narrow: Sequence[Path],
    geometry: Path,
    voltage: Sequence[Path] = (),
) -> Outcome:
    """Write tables 1 to 3, figures 3 and 5 to 17 and the page of claims from fits of two stands.

    models: MODELs friction, sine, theta, narrow_sine, narrow_theta and, with voltage, voltage_model; narrow: recordings
    of the stand whose field a sine cannot follow; geometry: dimensions of the motor; voltage: recordings of one driven
    by voltages. Raises ConfigError or DataError.
    """
    from linid import api
    from linid.physics.field.geometry import design, load_geometry

    results = {name: api.load(path).result for name, path in models.items() if name != VOLTAGE}
    made = design(load_geometry(geometry))
    stand = api.read(*request.files, **request.settings.given())
    other = api.read(*narrow, **request.settings.given())
    imposed = api.read(*voltage, **request.settings.given()) if voltage else None
    _check(stand.recordings, request.files)
    runs = {} if imposed is None else drawn_by_voltage(api.load(models[VOLTAGE]).result, imposed.recordings, voltage)
    folder = open_run_folder(COMMAND, request.out, overwrite=True)
    read = [*stand.files, *other.files, *(() if imposed is None else imposed.files)]
    inputs = [*read, *(file_record(path) for path in (*models.values(), geometry))]
    folder.begin(
        identity=identity_of(COMMAND, inputs),
        config="# linid batch, command reproduce\n",
        inputs=inputs,
        seed=request.settings.seed,
        jobs=request.jobs,
    )
    with recorded(folder), reporter:
        traces = _Traces(reporter, request.jobs, request.settings.seed)
        narrow_cases = [r for r in other.recordings if r.name.startswith(CASES)]
        fitted = {
            name: traces.fitted(name, result, narrow_cases if name.startswith("narrow") else stand.recordings)
            for name, result in results.items()
        }
        further = _further(traces.of, results["friction"], made)
        evidence = _evidence(fitted, stand.recordings, further, request.settings.seed)
        tables = _tables(results, _truth(request.files))
        drawn = figures(made, fitted, traces.of, stand.recordings)
        drawn |= drawn_in_closed_loop(results["theta"], stand.recordings) | runs
        pictures = _save(drawn, folder.path, request.settings.figure_formats, reporter)
        _write(folder.path, evidence, tables, pictures, _name(request.files))
        folder.end("done", DONE)
    from linid.reproduction.claims import claims

    verdicts = [{"claim": c.claim, "verdict": c.verdict, "found": c.found} for c in claims(evidence)]
    summary = {"command": COMMAND, "folder": str(folder.path), "claims": verdicts, "exit_code": DONE}
    holding = sum(row["verdict"] == "holds" for row in verdicts)
    return Outcome(COMMAND, folder.path, DONE, f"{holding} of {len(verdicts)} claims hold", (), summary)


def _check(recordings: Sequence[Recording], files: Sequence[Path]) -> None:
    """Refuse a campaign that lacks what the figures show."""
    for case in CASES:
        for split in ("fit", "held_out"):
            if not any(r.name.startswith(case) and r.split == split for r in recordings):
                raise DataError(
                    ", ".join(str(path) for path in files),
                    f"holds no {split} recording called {case}_...",
                    "Take the campaign of a stand such as configs/stand_axis.yaml.",
                )
    if len({r.added_mass for r in recordings if r.kind == "free_wheel"}) < 3:
        raise DataError(
            ", ".join(str(path) for path in files),
            "holds free wheels with fewer than three added masses",
            "Take the campaign of a stand such as configs/stand_axis.yaml.",
        )


def _name(files: Sequence[Path]) -> str:
    return f"the generated stand ({', '.join(path.parent.name for path in files)})"


class _Traces:
    """Gaps and traces of models on recordings; the traces are kept for the figures."""

    def __init__(self, reporter: Reporter, jobs: int, seed: int) -> None:
        self.reporter = reporter
        self.jobs = jobs
        self.seed = seed
        self.of: dict[str, dict[str, Trace]] = {}

    def fitted(self, name: str, result: FitResult, recordings: Sequence[Recording]) -> Fitted:
        """A fit and what it makes of recordings; its traces are kept under the name."""
        from linid import api
        from linid.interface.measuring import residual_recordings
        from linid.reproduction.evidence import Fitted, measured_of

        chosen = residual_recordings(recordings, result)
        found = api.validate(api.Fit(result), chosen, jobs=self.jobs, seed=self.seed, progress=self.reporter.step)
        self.of[name] = {trace.recording: trace for trace in found.traces}
        return Fitted(result, measured_of(found.gaps, found.traces))


def _further(traces: Mapping[str, Mapping[str, Trace]], friction: FitResult, made: MotorDesign) -> Further:
    from linid.reproduction.claims import SQUARE
    from linid.reproduction.further_evidence import further_evidence

    # A friction model is measured on free wheels alone.
    squares = [trace for name, trace in sorted(traces["sine"].items()) if name.startswith(SQUARE)]
    return further_evidence(list(traces["friction"].values()), squares, friction.value("coulomb_force"), made.geometry)


def _evidence(fitted: Mapping[str, Fitted], recordings: Sequence[Recording], further: Further, seed: int) -> Any:
    from linid.reproduction.claims import Evidence
    from linid.reproduction.evidence import search_of, signs_of, simulation_times, table_2_thrust

    sine, theta = fitted["sine"].result, fitted["theta"].result
    timed = next(r for r in recordings if r.name.startswith("sine_position"))
    return Evidence(
        **fitted,
        times=simulation_times(sine, theta, timed),
        searches={"sine": search_of(sine), "theta": search_of(theta)},
        signs=signs_of({e.name: e.value for e in sine.estimates}, seed),
        table_2_thrust=table_2_thrust(),
        further=further,
    )


def _truth(files: Sequence[Path]) -> dict[str, dict[str, float]]:
    """The stand's true parameters by model kind, from truth.yaml beside its campaign; empty where there is none."""
    import yaml

    from linid.physics.motors.theta import fundamental_force_constant

    path = files[0].parent / "truth.yaml"
    if not path.exists():
        return {"friction": {}, "sine": {}, "theta": {}}
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    values = {name: float(value) for name, value in data["parameters"].items()}
    if data["motor"] != "theta":
        return {"friction": values, "sine": values, "theta": {}}
    doubled = {
        name: 2.0 * values[name] for name in ("electrical_wavenumber", "winding_displacement", "commutation_offset")
    }
    first = fundamental_force_constant(values["force_constant"], values["winding_length"], values["nome"])
    return {"friction": values, "theta": values, "sine": {**values, **doubled, "force_constant": first}}


def _tables(results: Mapping[str, FitResult], truth: Mapping[str, dict[str, float]]) -> dict[str, Any]:
    from linid.report.reproduction.tables import table
    from linid.reproduction.printed import TABLE_1, TABLE_2, TABLE_3

    named = {
        "friction": ("Table 1. Resistive force model", TABLE_1),
        "sine": ("Table 2. Sine model", TABLE_2),
        "theta": ("Table 3. Elliptic theta model", TABLE_3),
    }
    return {
        f"table_{number}_{kind}": table(title, printed, results[kind], truth[kind])
        for number, (kind, (title, printed)) in enumerate(named.items(), 1)
    }


def _save(drawn: Mapping[str, Drawn], folder: Path, formats: Sequence[str], reporter: Reporter) -> list[Picture]:
    from linid.report.reproduction.page import Picture
    from linid.report.style import save

    pictures = []
    for number, (stem, (title, draw)) in enumerate(drawn.items(), 1):
        vector = ["pdf"] if stem.startswith(_IN_PRINT) and not stem.endswith("free_run") else []
        paths = save(draw(), folder / "figures" / stem, tuple(dict.fromkeys(["png", *vector, *formats])))
        png = next(path for path in paths if path.suffix == ".png")
        pictures.append(Picture(title, stem, png.read_bytes()))
        reporter.step("figures", number, len(drawn))
    return pictures


def _write(folder: Path, evidence: Any, tables: Mapping[str, Any], pictures: Sequence[Picture], name: str) -> None:
    from linid.report.reproduction.page import page_html, page_markdown
    from linid.report.reproduction.tables import table_csv, table_latex
    from linid.reproduction.claims import claims, impossible

    for stem, made in tables.items():
        write_text(folder / f"{stem}.csv", table_csv(made))
        write_text(folder / f"{stem}.tex", table_latex(made))
    said, cannot = claims(evidence), impossible(evidence.table_2_thrust)
    write_text(folder / "paper.md", page_markdown(name, said, cannot))
    write_text(folder / "paper.html", page_html(name, said, cannot, list(tables.values()), pictures))
