"""inspect: what is understood of a recording or a campaign."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linid.errors import UsageError
from linid.report.files import finite
from linid.workflow.commands.inspect_plot import write_plot
from linid.workflow.run.outcome import DONE, Outcome
from linid.workflow.run.run_folder import write_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from linid.recording import Axis, ChannelMapping, Inspection, RecordedCampaign, Recording, RecordingChecks

COMMAND = "inspect"
_OWN_TEXTS = (b"# Starter mapping for ", b"# Campaign proposed by `linid inspect")


def inspect_path(
    file: Path,
    *,
    channels: Path | None = None,
    axis: Axis | None = None,
    mapping: Path | None = None,
    plot: Path | None = None,
    campaign: Path | None = None,
    overwrite: bool = False,
) -> Outcome:
    """Show layout, rate, columns, units and notes of a file, a starter mapping (written where `mapping` says) and the
    checks of what it holds; of a campaign its recordings and their checks; of a folder a proposed campaign.

    plot: PNG of what was understood; campaign: where the proposed campaign goes (None: it is only shown).

    Exit code 4 when the file cannot be fitted as it is. Raises DataError when no table of numbers can be read,
    UsageError for options that do not suit and files that are in the way.
    """
    from linid.recording import (
        ChannelMapping,
        checks_of,
        inspect_file,
        is_campaign,
        read_campaign,
        read_recording,
        starter_mapping,
    )
    from linid.workflow.run.settings import read_mapping

    given = None if channels is None else ChannelMapping.model_validate(read_mapping(channels))
    written = [path for path in (mapping, plot, campaign) if path is not None]
    for path in written:
        _may_be_written(path, file, overwrite)
    if file.is_dir():
        return _folder(file, given, axis, campaign)
    if campaign is not None:
        raise UsageError("--campaign", f"{file} is no folder", "Name a folder of recordings, or use --mapping.")
    if is_campaign(file):
        return _campaign(read_campaign(file))
    found = inspect_file(file, given, axis)
    recording = read_recording(file, channels=given, axis=_axis(found)) if found.problem is None else None
    if recording is not None:  # what is done to make it regular, too
        found = replace(found, notes=recording.notes)
    starter = starter_mapping(found)
    if mapping is not None:
        write_text(mapping, starter)
    drawn = () if plot is None else (f"Picture written to {write_plot(plot, file, given, _axis(found), recording)}.",)
    summary = {name: _plain(value) for name, value in asdict(found).items()}
    summary |= {"command": COMMAND, "starter_mapping": starter, "exit_code": 0 if found.problem is None else 4}
    checks = checks_of([recording]) if recording is not None else ()
    summary["checks"] = _checks_summary(checks)
    said = f"Starter mapping written to {mapping}; check it, then give it by --channels." if mapping else starter
    return Outcome(
        COMMAND,
        None,
        DONE if found.problem is None else 4,
        "",
        (_facts(found), _columns(found), said, *drawn, *_checks(checks)),
        summary,
    )


def _may_be_written(path: Path, source: Path, overwrite: bool) -> None:
    """Refuse to write over a file without leave, and over what is no file of this command with it."""
    if not path.exists():
        return
    if path.is_dir() or path.samefile(source) or not _is_own(path):
        raise UsageError(
            str(path), "is no file that `linid inspect` has written, and stays as it is", "Choose another name."
        )
    if not overwrite:
        raise UsageError(str(path), "the file exists", "Choose another name, or allow --overwrite.")


def _is_own(path: Path) -> bool:
    """Whether a file is a mapping, a campaign or a picture of this command."""
    with path.open("rb") as file:
        head = file.read(4096)
    return head.startswith(_OWN_TEXTS) or (head.startswith(b"\x89PNG") and b"linid inspect" in head)


def _folder(folder: Path, channels: ChannelMapping | None, axis: Axis | None, campaign: Path | None) -> Outcome:
    """What the files of a folder may be used for."""
    from linid.recording.proposal import campaign_text, candidates_in, propose

    files = candidates_in(folder)
    if not files:
        raise UsageError(str(folder), "holds no file that may be a recording", "Name a recording or its folder.")
    found = propose(folder, files, channels, axis)
    text = campaign_text(found, channels)
    if campaign is not None:
        if campaign.resolve().parent != folder.resolve():
            raise UsageError(
                f"--campaign {campaign}",
                "a campaign lies beside its recordings",
                f"Write it to {folder / campaign.name}.",
            )
        write_text(campaign, text)
    said = f"Campaign written to {campaign}; check it, then give it to a fit or `linid diagnose`." if campaign else text
    summary = {
        "command": COMMAND,
        "folder": str(folder),
        "campaign": text,
        "recordings": [
            {"file": str(e.recording.source), "kind": e.recording.kind, "split": e.split, "repeat_of": e.repeat_of}
            for e in found.entries
        ],
        "unusable": [{"file": str(u.path), "problem": u.problem} for u in found.unusable],
        "exit_code": DONE if found.entries else 4,
    }
    table = _table()
    for title in ("File", "Kind", "Split", "Repeats", "Seconds", "Hz"):
        table.add_column(title, overflow="fold")
    for e in found.entries:
        r = e.recording
        table.add_row(
            r.source.name if r.source else r.name,
            r.kind,
            e.split,
            e.repeat_of or "-",
            f"{r.duration:.4g}",
            f"{1.0 / r.period:.5g}",
        )
    problems = [f"NOT USABLE {u.path.name}: {u.problem}" for u in found.unusable]
    return Outcome(COMMAND, None, summary["exit_code"], "", (table, *problems, said), summary)  # type: ignore[arg-type]


def _axis(found: Inspection) -> Axis:
    """The axis as the inspection took it, from the position's unit in SI."""
    return "rotary" if any(c.channel == "position" and c.si == "rad" for c in found.columns) else "linear"


def _checks_summary(checks: Sequence[RecordingChecks]) -> dict[str, Any]:
    """The checks for `--json`: numbers by recording, and all findings, warnings first."""
    from linid.recording import all_findings, checks_data

    return {"recordings": checks_data(checks), "findings": [asdict(f) for f in all_findings(checks)]}


def _checks(checks: Sequence[RecordingChecks]) -> tuple[Any, ...]:
    """What is printed of the checks: a table, a line on how to read it, and the findings."""
    from linid.recording.checks import checks_legend, checks_table, joined_findings
    from linid.report.symbols import typeset

    if not checks:
        return ()
    header, rows = checks_table(checks)
    told = [k for k in range(len(header)) if any(row[k] != "-" for row in rows)]
    table = _table()
    for k in told:
        first = k == 0
        table.add_column(header[k], overflow="fold", justify="left" if first else "right", min_width=17 if first else 5)
    for row in rows:
        table.add_row(*(row[k] for k in told))
    said = [f"{level.upper()} {where}: {typeset(text)}." for level, where, text in joined_findings(checks)]
    return (table, checks_legend([header[k] for k in told]), *(said or ["Nothing to object to."]))


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return finite(value)


def _facts(found: Inspection) -> Any:
    table = _table(header=False)
    rows = [
        ("file", str(found.path)),
        ("layout", f"{found.layout}, {found.encoding}, {found.dialect}"),
        ("lines", f"header in line {found.header_line}, data from line {found.first_data_line}, {found.rows} rows"),
    ]
    if found.rate is not None and found.t_start is not None and found.t_end is not None:
        jitter = f", jitter {100 * found.jitter:.2g} %" if found.jitter and found.jitter > 1e-4 else ""
        rows.append(("time", f"{found.t_start:.6g} to {found.t_end:.6g} s at {found.rate:.6g} Hz{jitter}"))
    if found.groups > 1:
        rows.append(("time groups", str(found.groups)))
    rows += [("note", note) for note in found.notes]
    if found.problem is not None:
        rows.append(("PROBLEM", found.problem))
    for row in rows:
        table.add_row(*row)
    return table


def _columns(found: Inspection) -> Any:
    table = _table()
    table.add_column("#", justify="right")
    table.add_column("Column", overflow="fold")
    table.add_column("Read as", overflow="fold")
    table.add_column("Declared -> SI", overflow="fold")
    table.add_column("From", justify="right")
    table.add_column("To", justify="right")
    for column in found.columns:
        units = f"{column.declared or '?'} -> {column.si}" if column.si else (column.declared or "?")
        table.add_row(
            str(column.number),
            column.header,
            column.channel or "-",
            units,
            f"{column.minimum:.5g}",
            f"{column.maximum:.5g}",
        )
    return table


def _inputs(r: Recording) -> str:
    """The drive's logged inputs in short."""
    named = {"3 currents": r.phase_currents, "3 voltages": r.phase_voltages}
    if r.phase_currents is None:
        named[r.input_unit] = r.drive_input
    return ", ".join(name for name, x in named.items() if x is not None) or "-"


def _campaign(campaign: RecordedCampaign) -> Outcome:
    from linid.recording import checks_of

    checks = checks_of(campaign.recordings)
    table = _table()
    for title in ("Recording", "Kind", "Split", "Samples", "Hz", "Seconds", "Added kg", "Inputs"):
        table.add_column(title, overflow="fold", min_width=17 if title == "Recording" else None)
    rows = []
    for r in campaign.recordings:
        inputs = _inputs(r)
        rows.append(
            {
                "recording": r.name,
                "kind": r.kind,
                "split": r.split,
                "samples": int(r.t.size),
                "rate": 1.0 / r.period,
                "duration": r.duration,
                "added_mass": r.added_mass,
                "inputs": inputs,
                "notes": list(r.notes),
                "sha256": r.sha256,
            }
        )
        table.add_row(
            r.name,
            r.kind,
            r.split,
            str(r.t.size),
            f"{1.0 / r.period:.5g}",
            f"{r.duration:.4g}",
            f"{r.added_mass:g}",
            inputs,
        )
    summary = {
        "command": COMMAND,
        "campaign": campaign.name,
        "axis": campaign.axis,
        "known": campaign.known,
        "recordings": rows,
        "checks": _checks_summary(checks),
        "exit_code": DONE,
    }
    return Outcome(COMMAND, None, DONE, "", (table, *_checks(checks)), summary)


def _table(header: bool = True) -> Any:
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0), show_header=header)
