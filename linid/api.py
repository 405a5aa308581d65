"""The public Python interface: read, fit, simulate, validate, diagnose; what the command line does, without files.

All quantities are in SI units (rotary axes: rad, N m, kg m^2). Nothing here writes a file unless a path is given, and
the interpreter's random generators stay as they are; equal arguments give equal results, whatever `jobs` is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from threadpoolctl import threadpool_limits

from linid.diagnosis.diagnose import Found
from linid.diagnosis.diagnose import diagnose as find_effects
from linid.diagnosis.gap import RecordingGap, Trace
from linid.diagnosis.means import Means
from linid.diagnosis.measures import measure_gaps
from linid.errors import ConfigError, DataError, LinidError, UsageError
from linid.identification.model_file import load_model, model_to_text
from linid.identification.result import Estimate, FitResult, ModelKind
from linid.identification.settings import Hooks
from linid.physics.motors import MOTORS
from linid.recording.recording import Recording, in_order
from linid.report.diagnosis.console import diagnosis_console
from linid.report.diagnosis.files import diagnosis_data
from linid.report.page.build import page_html
from linid.report.tables import gap_table_console, identifiability_notes, parameter_table_console, table_text
from linid.workflow.commands.diagnose import base_kind
from linid.workflow.commands.fit_friction import checked_friction_task
from linid.workflow.commands.fit_motor import motor_tasks
from linid.workflow.run.inputs import Inputs, read_inputs
from linid.workflow.run.results import residual_recordings
from linid.workflow.run.run_folder import write_text
from linid.workflow.run.settings import make_settings
from linid.workflow.run.stage import fitted

if TYPE_CHECKING:
    import pandas as pd

    from linid.diagnosis.report_data import Budget, Verdict

__all__ = [
    "Campaign",
    "ConfigError",
    "DataError",
    "Diagnosed",
    "Fit",
    "Gaps",
    "LinidError",
    "Recording",
    "UsageError",
    "diagnose",
    "fit",
    "load",
    "read",
    "simulate",
    "validate",
]

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Campaign:
    """Recordings of one axis: some to be fitted, others held out as judges.

    recordings: in their order; axis: linear or rotary; known: SI values by parameter name; name: for titles; notes:
    what reading the files noticed.
    """

    recordings: tuple[Recording, ...]
    axis: str = "linear"
    known: dict[str, float] = field(default_factory=dict)
    name: str = "campaign"
    notes: tuple[str, ...] = field(default=(), repr=False)

    @classmethod
    def of(
        cls, recordings: Iterable[Recording], *, known: dict[str, float] | None = None, name: str = "campaign"
    ) -> Campaign:
        """A campaign of recordings made in Python; raises UsageError for none, or for mixed axes or equal names."""
        chosen = in_order(recordings)
        axes = {r.axis for r in chosen}
        if len(axes) != 1:
            fact = "no recording is given" if not chosen else "linear and rotary recordings are mixed"
            raise UsageError("recordings", fact, "Give the recordings of one axis.")
        if len({r.name for r in chosen}) < len(chosen):
            raise UsageError("recordings", "two of them have the same name", "Rename one.")
        return cls(chosen, axes.pop(), dict(known or {}), name)

    @property
    def fitted(self) -> tuple[Recording, ...]:
        """Recordings that fits follow."""
        return tuple(r for r in self.recordings if r.split == "fit")

    @property
    def held_out(self) -> tuple[Recording, ...]:
        """Recordings that only judge."""
        return tuple(r for r in self.recordings if r.split == "held_out")

    def __getitem__(self, name: str) -> Recording:
        """The recording called `name`; KeyError if there is none."""
        for recording in self.recordings:
            if recording.name == name:
                return recording
        raise KeyError(name)

    def __iter__(self) -> Iterator[Recording]:
        return iter(self.recordings)

    def __len__(self) -> int:
        return len(self.recordings)

    def to_frame(self) -> pd.DataFrame:
        """One row per recording: kind, split, samples, sampling period and duration in s, added mass in kg."""
        import pandas as pd

        rows = [
            {
                "recording": r.name,
                "kind": r.kind,
                "split": r.split,
                "samples": r.t.size,
                "period": r.period,
                "duration": r.duration,
                "added_mass": r.added_mass,
            }
            for r in self.recordings
        ]
        return pd.DataFrame(rows).set_index("recording")

    def _repr_html_(self) -> str:
        return f"<p><b>{_escaped(self.name)}</b>, {self.axis} axis</p>" + str(self.to_frame().to_html())


@dataclass(frozen=True)
class Fit:
    """Identified parameters with their uncertainty. result: all that the fit has found, as in `parameters.json`."""

    result: FitResult

    @property
    def model(self) -> str:
        """friction, force, sine or theta."""
        return self.result.model

    @property
    def parameters(self) -> tuple[Estimate, ...]:
        """All parameters with what follows from them, in table order."""
        return (*self.result.estimates, *self.result.derived)

    @property
    def converged(self) -> bool:
        """Whether the search and the least squares after it stopped for a good reason."""
        return self.result.converged

    @property
    def warnings(self) -> tuple[str, ...]:
        """What should be known before the values are used."""
        return (*self.result.warnings, *identifiability_notes(self.result))

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of a parameter: value, std, interval (95 %), unit, status; KeyError if the model has none."""
        for estimate in self.parameters:
            if estimate.name == name:
                return estimate
        raise KeyError(f"{name}; the {self.model} model has {', '.join(e.name for e in self.parameters)}")

    def to_frame(self) -> pd.DataFrame:
        """One row per parameter in SI units: symbol, value, std, low, high (95 %), unit, status, note."""
        import pandas as pd

        names = ("name", "symbol", "value", "std", "low", "high", "unit", "status", "note")
        rows = [{name: getattr(e, name) for name in names} for e in self.parameters]
        return pd.DataFrame(rows).set_index("name")

    def summary(self) -> str:
        """The parameter table as text."""
        return table_text(parameter_table_console(self.result), 100)

    def save(self, path: str | Path) -> Path:
        """Write the model as JSON, which `linid.load` and the command line read; raises OSError."""
        return write_text(Path(path), model_to_text(self.result))

    def _repr_html_(self) -> str:
        table = self.to_frame()[["symbol", "value", "std", "low", "high", "unit", "status"]]
        said = "".join(f"<li>{_escaped(text)}</li>" for text in self.warnings)
        return (
            f"<p><b>{self.model}</b> model</p>{table.to_html(float_format='{:.5g}'.format, na_rep='')}<ul>{said}</ul>"
        )


@dataclass(frozen=True)
class Gaps:
    """The sim-to-real gap of a model per recording (see `RecordingGap`), and the traces behind it."""

    gaps: tuple[RecordingGap, ...]
    traces: tuple[Trace, ...]
    axis: str

    def __iter__(self) -> Iterator[RecordingGap]:
        return iter(self.gaps)

    def __len__(self) -> int:
        return len(self.gaps)

    def to_frame(self) -> pd.DataFrame:
        """One row per recording: the three measures with their floors, in SI units."""
        import pandas as pd

        return pd.DataFrame([gap.__dict__ for gap in self.gaps]).set_index("recording")

    def summary(self) -> str:
        """The gap table as text."""
        return table_text(gap_table_console(self.gaps, self.axis), 100)

    def _repr_html_(self) -> str:
        return str(self.to_frame().to_html(float_format="{:.3g}".format))


@dataclass(frozen=True)
class Diagnosed:
    """Where a simulation differs from the machine, which effects it lacks, and how far the gap shrinks with them."""

    found: Found

    @property
    def verdict(self) -> Verdict:
        """The verdict: `status`, `effects`, `sentence`, `next_experiment`."""
        return self.found.diagnosis.verdict

    @property
    def budget(self) -> Budget:
        """The gap as a sum: one entry per effect with its share, and what is left."""
        return self.found.diagnosis.budget

    @property
    def before(self) -> Fit:
        """The model without the effects that were found."""
        return Fit(self.found.before)

    @property
    def after(self) -> Fit:
        """The model with them."""
        return Fit(self.found.after)

    def to_dict(self) -> dict[str, Any]:
        """All that was found, as in `diagnosis.json`."""
        return diagnosis_data(self.found.diagnosis)

    def summary(self) -> str:
        """Verdict and tables as text."""
        from rich.console import Console

        console = Console(width=100, color_system=None, force_terminal=False)
        with console.capture() as caught:
            console.print(diagnosis_console(self.found.diagnosis))
        return caught.get()

    def report(self, path: str | Path) -> Path:
        """Write the page with all figures (one HTML file that needs no network); raises OSError."""
        return write_text(Path(path), page_html(self.found.diagnosis))

    def _repr_html_(self) -> str:
        import pandas as pd

        rows = [{"effect": e.effect, "share": e.share, "low": e.low, "high": e.high} for e in self.budget.entries]
        table = pd.DataFrame(rows, columns=["effect", "share", "low", "high"])
        sentence = f"<p><b>{_escaped(self.verdict.status)}</b>: {_escaped(self.verdict.sentence)}</p>"
        return sentence + str(table.to_html(index=False, float_format="{:.3f}".format))


def read(*files: str | Path, **settings: Any) -> Campaign:
    """Read scope exports or campaign files; free wheels that begin with a push are cut to their coast-down.

    files: paths of recordings, or of one campaign (YAML). settings: of bare recordings, as in `--config` (`channels`,
    `kind`, `axis`, `window` and `period` in s, `added_mass` in kg ...).
    Returns a Campaign in SI units. Raises UsageError, ConfigError or DataError, each with place, fact and remedy.
    """
    inputs = read_inputs([Path(file) for file in files], make_settings(settings))
    notes = (*inputs.warnings(), *inputs.notes())
    return Campaign(inputs.recordings, inputs.axis, dict(inputs.known), inputs.name, notes)


def fit(
    campaign: Campaign,
    model: str = "theta",
    *,
    start: Fit | None = None,
    jobs: int = 1,
    progress: Callable[[str, int, int, float], None] | None = None,
    **settings: Any,
) -> Fit:
    """Identify a model on the recordings of a campaign that are to be fitted.

    model: friction (free wheels), force, sine (paper, 31 and 44) or theta (39 and 45); start: an earlier fit for first
    values (None: the free wheels of the campaign are fitted first); jobs: threads, which never change a result;
    progress(stage, done, total, best cost): called as the search goes on; settings: as in `--config` (`effects`,
    `known` and `bounds` in SI by parameter name, `seed`, `objective`, `method`, `profiles` ...).
    Returns a Fit. Raises UsageError, ConfigError or DataError.
    """
    if model not in MOTORS:
        raise UsageError("model", f"there is no model {model!r}", f"Choose one of {', '.join(MOTORS)}.")
    chosen = make_settings(settings)
    inputs = _inputs(campaign)
    before = None if start is None else start.result
    hooks = Hooks(progress=progress or (lambda stage, done, total, best: None))
    kind: ModelKind = model  # type: ignore[assignment]
    with threadpool_limits(1):
        if kind == "friction":
            return Fit(fitted(replace(checked_friction_task(inputs, chosen), start=before), jobs, hooks))
        first, task = motor_tasks(inputs, chosen, kind, before)
        if first is not None:
            task = replace(task, start=fitted(first, jobs, hooks))
        return Fit(fitted(task, jobs, hooks))


def load(path: str | Path) -> Fit:
    """The fit that `save` or the command line has written (MODEL.json); raises ConfigError."""
    return Fit(load_model(Path(path)))


def validate(fit: Fit, recordings: Campaign | Iterable[Recording], *, jobs: int = 1, seed: int = 1) -> Gaps:
    """The gap between a model and recordings, each measure beside its noise floor.

    recordings: of which those are taken that the model can be asked for; a Campaign also lends repeats for the floor.
    Returns Gaps. Raises DataError where none can be measured.
    """
    return _measured(fit, tuple(recordings), jobs, seed)


def _measured(fit: Fit, given: tuple[Recording, ...], jobs: int = 1, seed: int = 1, *, floors: bool = True) -> Gaps:
    chosen = residual_recordings(given, fit.result)
    if not chosen:
        raise DataError(
            "recordings",
            f"hold none that a {fit.model} model can be asked for",
            "Give free wheels, or recordings with the channels that the model needs.",
        )
    with threadpool_limits(1):
        gaps, traces = measure_gaps(fit.result, chosen, jobs=jobs, seed=seed, among=given, floors=floors)
    return Gaps(gaps, traces, fit.result.axis)


def simulate(fit: Fit, recording: Recording) -> Trace:
    """The free run of a model under a recording's inputs, from its measured start.

    Returns a Trace: t in s, y_simulated and y_measured in m, velocity_simulated in m/s, (n,) each.
    Raises DataError where the recording lacks the channels that the model needs.
    """
    return _measured(fit, (recording,), floors=False).traces[0]


def diagnose(
    campaign: Campaign,
    model: str | None = None,
    *,
    effects: Sequence[str] = (),
    known: dict[str, float] | None = None,
    seed: int = 1,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Diagnosed:
    """Where the simulation differs from the machine, which effects are missing, how far the gap shrinks with them.

    model: of the base (None: what the recordings allow); effects: those that the base has already; known: SI values
    besides the campaign's; jobs: threads; progress(stage, done, total). Held-out recordings judge.
    Returns Diagnosed. Raises UsageError without held-out recordings, DataError for unfit ones.
    """
    kind: ModelKind = base_kind(campaign.recordings) if model is None else model  # type: ignore[assignment]
    with threadpool_limits(1):
        found = find_effects(
            campaign.name,
            campaign.recordings,
            kind,
            effects=effects,
            known={**campaign.known, **(known or {})},
            means=Means(jobs=jobs, seed=seed, progress=progress),
        )
    return Diagnosed(found)


def _inputs(campaign: Campaign) -> Inputs:
    return Inputs(campaign.recordings, campaign.axis, campaign.known, (), name=campaign.name)


def _escaped(text: str) -> str:
    import html

    return html.escape(text)
