"""What the public functions give back: fits, gaps and diagnoses, which show themselves as tables, text and HTML."""

from __future__ import annotations

import html
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.report.files import write_atomic

if TYPE_CHECKING:
    import pandas as pd

    from linid.diagnosis.diagnose import Found
    from linid.diagnosis.gap import RecordingGap, Trace
    from linid.diagnosis.report_data import Budget, ProposedTerm, Verdict
    from linid.identification.result import Estimate, FitResult


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
        from linid.report.tables import identifiability_notes

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
        from linid.report.tables import parameter_table_console, table_text

        return table_text(parameter_table_console(self.result), 100)

    def save(self, path: str | Path) -> Path:
        """Write the model as JSON, which `linid.load` and the command line read; raises OSError."""
        from linid.identification.model_file import model_to_text

        return write_atomic(Path(path), model_to_text(self.result).encode())

    def _repr_html_(self) -> str:
        table = self.to_frame()[["symbol", "value", "std", "low", "high", "unit", "status"]]
        said = "".join(f"<li>{html.escape(text)}</li>" for text in self.warnings)
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
        from linid.report.tables import gap_table_console, table_text

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
    def proposal(self) -> ProposedTerm | None:
        """A term for what no effect explains: its arguments, its curve, how far it closes; None where none is."""
        return self.found.diagnosis.proposal

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
        from linid.report.diagnosis.files import diagnosis_data

        return diagnosis_data(self.found.diagnosis)

    def summary(self) -> str:
        """Verdict and tables as text."""
        from rich.console import Console

        from linid.report.diagnosis.console import diagnosis_console

        console = Console(width=100, color_system=None, force_terminal=False)
        with console.capture() as caught:
            console.print(diagnosis_console(self.found.diagnosis))
        return caught.get()

    def report(self, path: str | Path) -> Path:
        """Write the page with all figures (one HTML file that needs no network); raises OSError."""
        from linid.report.page.build import page_html

        return write_atomic(Path(path), page_html(self.found.diagnosis).encode())

    def _repr_html_(self) -> str:
        import pandas as pd

        rows = [{"effect": e.effect, "share": e.share, "low": e.low, "high": e.high} for e in self.budget.entries]
        table = pd.DataFrame(rows, columns=["effect", "share", "low", "high"])
        sentence = f"<p><b>{html.escape(self.verdict.status)}</b>: {html.escape(self.verdict.sentence)}</p>"
        if self.proposal is not None:
            sentence += f"<p>{html.escape(self.proposal.sentence)}</p>"
        return sentence + str(table.to_html(index=False, float_format="{:.3f}".format))
