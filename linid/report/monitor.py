"""What has changed since a model, over campaigns: rows, a table for the console, and one page with trends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from linid.report.display import display_unit
from linid.report.numbers import format_number, with_interval
from linid.report.page.pieces import Plot, base_layout, short
from linid.report.style import MEASURED, MUTED
from linid.report.symbols import unit_label
from linid.report.tables import console_table

if TYPE_CHECKING:
    from rich.table import Table

    from linid.identification.result import FitResult

PARAMETERS = ("coulomb_force", "static_force", "viscous_friction", "force_constant", "commutation_offset", "mass")
# Following errors in the drive's loops, by key in `diagnosis.json`.
FOLLOWING = {
    "without": "without feed-forward",
    "base": "with the feed-forward of the model as it stands",
    "full": "with that of the model of this day",
}
_HEIGHT = 260
_DIGITS = 9  # of parameters that are known to many


@dataclass(frozen=True)
class Brief:
    """A campaign in short: what has changed, as words; following: what the axis does under feed-forwards, "" where
    nothing has changed or nothing tells."""

    campaign: str
    recorded: str
    status: str
    changes: tuple[str, ...]
    effects: tuple[str, ...]
    ahead: float | None
    following: str


@dataclass(frozen=True)
class Visit:
    """One campaign beside the model. recorded: ISO day or moment, "" if not given; diagnosis: content of its
    `diagnosis.json`, SI."""

    label: str
    recorded: str
    diagnosis: dict[str, Any]

    @property
    def changed(self) -> bool:
        """Whether anything differs from the model."""
        return bool(self.diagnosis["verdict"]["status"] != "none")

    @property
    def changes(self) -> dict[str, dict[str, Any]]:
        """The parameters that are others, by name."""
        return {one["parameter"]: one for one in self.diagnosis["changes"]}

    def effects(self) -> tuple[dict[str, Any], ...]:
        """Named effects that are no changed parameters, with their shares of the gap."""
        stand_for = {one["effect"] for one in self.diagnosis["changes"]}
        return tuple(one for one in self.diagnosis["budget"]["entries"] if one["effect"] not in stand_for)

    def error(self, measure: str, when: str = "before") -> float | None:
        """A measure over the held-out recordings by the model as it stands, SI."""
        found = self.diagnosis["measures"].get(measure, {}).get(when)
        return None if found is None else float(found)

    def following(self) -> dict[str, dict[str, Any]]:
        """RMS following errors with their intervals in m (rotary: rad), by keys of `FOLLOWING`; none where nothing
        tells them."""
        told = self.diagnosis.get("compensation")
        if not told or told["refused"]:
            return {}
        return {case: told[case]["rms"] for case in FOLLOWING}

    def rows(self) -> Iterator[tuple[object, ...]]:
        """Rows of the table: changed parameters, effects, what stays unexplained, the errors."""
        start = (self.label, self.recorded, self.diagnosis["verdict"]["status"])
        for name, one in self.changes.items():
            yield *start, name, "parameter", one["after"], one["low"], one["high"], one["unit"], one["before"]
        for entry in self.effects():
            yield *start, entry["effect"], "share of the gap", entry["share"], entry["low"], entry["high"], "1", 0.0
        if self.changed:
            unexplained = self.diagnosis["budget"]["unexplained"]
            span = (unexplained["share"], unexplained["low"], unexplained["high"])
            yield *start, "unexplained", "share of the gap", *span, "1", 0.0
        unit = "rad" if self.diagnosis["axis"] == "rotary" else "m"
        for case, one in self.following().items():
            yield *start, FOLLOWING[case], "following error", one["value"], one["low"], one["high"], unit, None
        for measure in self.diagnosis["measures"]:
            yield *start, measure, "error", self.error(measure), None, None, "SI", self.error(measure, "floor")

    def brief(self) -> Brief:
        """The campaign in short."""
        changes = []
        for name, one in self.changes.items():
            share = "" if one["share"] is None else f" ({100.0 * one['share']:+.3g} %)"
            value = with_interval(one["after"], one["low"], one["high"])
            changes.append(f"{name.replace('_', ' ')} {value} {unit_label(one['unit'])}{share}")
        effects = tuple(f"{e['effect'].replace('_', ' ')} {100.0 * e['share']:.2g} %" for e in self.effects())
        status = self.diagnosis["verdict"]["status"]
        ahead = self.error("ahead")
        return Brief(self.label, self.recorded, status, tuple(changes), effects, ahead, self._following_words())

    def _following_words(self) -> str:
        found = self.following()
        if not self.changed or not found:
            return ""
        display = display_unit("position", self.diagnosis["axis"], found["without"]["value"])
        without, base, full = (format_number(display.factor * found[case]["value"]) for case in FOLLOWING)
        return f"{base} {display.unit} with the model's feed-forward, {full} with today's ({without} with none)"


def monitor_console(found: Sequence[Visit]) -> Table:
    """One row per campaign."""
    from rich.text import Text

    table = console_table("Since the model was identified")
    for title in ("Campaign", "Recorded", "Changed parameters", "What else came", "Following error"):
        table.add_column(title, overflow="fold")
    for one in found:
        brief = one.brief()
        nothing = "nothing" if not one.changed else "-"
        changed = "; ".join(brief.changes) or nothing
        cells = (brief.campaign, brief.recorded or "-", changed, _else(one, brief), brief.following or "-")
        table.add_row(*(Text(cell) for cell in cells))
    return table


def _else(one: Visit, brief: Brief) -> str:
    """What differs besides changed parameters."""
    texts = list(brief.effects)
    if one.diagnosis["verdict"]["status"] in ("unknown", "partly explained"):
        texts.append(f"unexplained {100.0 * one.diagnosis['budget']['unexplained']['share']:.2g} %")
    return "; ".join(texts) or "-"


def monitor_page(found: Sequence[Visit], since: FitResult) -> str:
    """One page with a table and trends; equal content gives equal bytes."""
    import json
    from importlib.resources import files

    import jinja2
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    folder = files("linid.report.page")
    texts = {name: (folder / name).read_text(encoding="utf-8") for name in ("monitor.html.j2", "page.css", "page.js")}
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    plots = [*_trends(found, since), *_shares(found), *_errors(found, since)]
    data = json.dumps([vars(plot) for plot in plots], separators=(",", ":")).replace("</", "<\\/")
    rows = [(one.brief(), _else(one, one.brief()), one.changed) for one in found]
    return environment.from_string(texts["monitor.html.j2"]).render(
        rows=rows,
        model=since.model,
        plots=plots,
        css=texts["page.css"],
        script=texts["page.js"],
        plotly=get_plotlyjs(),
        figures=Markup(data),
    )


def _places(found: Sequence[Visit]) -> list[str]:
    """Where the campaigns stand on the axis: by their days, or by their names."""
    return [one.recorded for one in found] if all(one.recorded for one in found) else [one.label for one in found]


def _trends(found: Sequence[Visit], since: FitResult) -> list[Plot]:
    """Each parameter over the campaigns, with the commissioned value."""
    out = []
    for estimate in since.estimates:
        if estimate.name not in PARAMETERS or estimate.value == 0.0:
            continue
        values, errors = [], []
        for one in found:
            change = one.changes.get(estimate.name)
            values.append(estimate.value if change is None else float(change["after"]))
            ends = estimate.interval if change is None else (float(change["low"]), float(change["high"]))
            errors.append(0.5 * (ends[1] - ends[0]))
        name = estimate.name.replace("_", " ")
        layout = _layout(f"{name} ({unit_label(estimate.unit)})")
        layout["shapes"] = [_level(estimate.value)]
        alt = f"{name} over {len(found)} campaigns, commissioned {format_number(estimate.value)} {estimate.unit}"
        out.append(Plot(f"trend-{estimate.name}", alt, [_points(_places(found), values, errors)], layout))
    return out


def _shares(found: Sequence[Visit]) -> list[Plot]:
    """The budget of each campaign: what causes the gap to the model, changed parameters and effects."""
    if not any(one.changed for one in found):
        return []
    names = dict.fromkeys(entry["effect"] for one in found for entry in one.diagnosis["budget"]["entries"])
    data = []
    for name in (*names, "unexplained"):
        shares = []
        for one in found:
            known = {entry["effect"]: entry["share"] for entry in one.diagnosis["budget"]["entries"]}
            known["unexplained"] = one.diagnosis["budget"]["unexplained"]["share"]
            shares.append(100.0 * max(known.get(name) or 0.0, 0.0) if one.changed else 0.0)
        bars: dict[str, Any] = {"type": "bar", "name": name.replace("_", " "), "x": _places(found), "y": short(shares)}
        if name == "unexplained":
            bars["marker"] = {"color": MUTED}
        data.append(bars)
    layout = {**_layout("share of the gap (%)"), "barmode": "stack", "showlegend": True}
    layout["xaxis"]["type"] = "category"
    return [Plot("shares", "Shares of the gap by campaign", data, layout)]


def _errors(found: Sequence[Visit], since: FitResult) -> list[Plot]:
    """The prediction 0.1 s ahead by the model as it stands."""
    factor, unit = 1e6, "µrad" if since.axis == "rotary" else "µm"
    values = [factor * (one.error("ahead") or float("nan")) for one in found]
    floors = [factor * (one.error("ahead", "floor") or float("nan")) for one in found]
    places = _places(found)
    floor = {**_points(places, floors, None), "name": "noise floor", "marker": {"color": MUTED, "size": 7}}
    data = [{**_points(places, values, None), "name": "model as it stands"}, floor]
    layout = {**_layout(f"error 0.1 s ahead ({unit})"), "showlegend": True}
    layout["yaxis"] |= {"type": "log", "tickformat": ".3~g"}
    return [Plot("ahead", "Prediction 0.1 s ahead of the model as it stands", data, layout)]


def _points(x: list[str], y: Sequence[float], errors: Sequence[float] | None) -> dict[str, Any]:
    data: dict[str, Any] = {
        "type": "scatter",
        "mode": "lines+markers",
        "x": x,
        "y": short(y, _DIGITS),
        "line": {"width": 1},
        "marker": {"color": MEASURED, "size": 9},
    }
    if errors is not None:
        data["error_y"] = {"type": "data", "array": short(errors, _DIGITS), "color": MEASURED}
    return data


def _level(value: float) -> dict[str, Any]:
    ends = {"x0": 0, "x1": 1, "xref": "paper", "y0": value, "y1": value}
    return {"type": "line", **ends, "line": {"color": MUTED, "dash": "dash", "width": 1}}


def _layout(title: str) -> dict[str, Any]:
    return base_layout("", title, _HEIGHT)
