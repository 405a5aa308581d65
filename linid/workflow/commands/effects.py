"""effects: what a model can have besides friction and motor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from linid.errors import UsageError
from linid.workflow.run.outcome import Outcome

if TYPE_CHECKING:
    from linid.physics.effects.effect import Effect


def list_effects(name: str | None) -> Outcome:
    """All effects in one table, or one of them in full; raises UsageError for an unknown name."""
    from linid.physics.effects.registry import EFFECTS, find_effect

    try:
        chosen = EFFECTS if name is None else (find_effect(name),)
    except UsageError as error:
        raise UsageError("NAME", error.fact, error.remedy) from None
    table = _overview(chosen) if name is None else _one(chosen[0])
    return Outcome("effects", None, tables=(table,), summary={"effects": [_row(effect) for effect in chosen]})


def _row(effect: Effect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "slot": effect.slot,
        "physics": effect.physics,
        "models": list(effect.kinds),
        "depends_on": [list(answer) for answer in effect.depends_on],
        "exposed_by": effect.exposed_by,
        "confused_with": list(effect.confused_with),
        "parameters": [
            {
                "name": p.name,
                "symbol": p.symbol,
                "unit": p.unit,
                "unit_rotary": p.unit_on("rotary"),
                "lower": p.lower,
                "upper": p.upper,
                "role": _role(effect, p.name),
                "meaning": p.meaning,
            }
            for p in effect.parameters
        ],
    }


def _role(effect: Effect, name: str) -> str:
    """amplitude (0: the effect is absent), given (set by the recordings, not searched) or shape."""
    if name in effect.amplitudes:
        return "amplitude"
    return "given" if name in effect.preset else "shape"


def _overview(effects: tuple[Effect, ...]) -> Any:
    table = _table()
    for title in ("Effect", "Slot", "Physics"):
        table.add_column(title, overflow="fold")
    for effect in effects:
        table.add_row(effect.name, effect.slot, effect.physics)
    table.add_row(
        "NAME: FORMULA", "FORCE", "Your own term, such as my_drag: -c * v * abs(v); see linid effects --help."
    )
    return table


def _one(effect: Effect) -> Any:
    from linid.physics.wording import fitting_words

    table = _table(header=False)
    table.add_row("effect", f"{effect.short} ({effect.slot})")
    table.add_row("physics", effect.physics)
    table.add_row("models", ", ".join(effect.kinds))
    for p in effect.parameters:
        rotary = p.unit_on("rotary")
        unit = p.unit if rotary == p.unit else f"{p.unit}, rotary {rotary}"
        scale = "set by the recordings" if p.name in effect.preset else f"within {p.lower:g} to {p.upper:g}"
        table.add_row("parameter", f"{p.name} ({p.symbol}) in {unit}: {p.meaning}; {_role(effect, p.name)}, {scale}")
    if effect.depends_on:
        usual = ", ".join(effect.depends_on[0]) or "nothing: it is the same everywhere"
        table.add_row("depends on", usual.replace("_", " "))
    table.add_row("shown by", effect.exposed_by)
    rotary_words = fitting_words(effect.exposed_by, "rotary", "sine")
    if rotary_words != effect.exposed_by:
        table.add_row("rotary", rotary_words)
    table.add_row("confused with", ", ".join(effect.confused_with) or "-")
    return table


def _table(header: bool = True) -> Any:
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, show_header=header)
