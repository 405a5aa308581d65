"""The target `twincat`: the function block as text and as TcPOU, and the friction table of TF5200."""

from __future__ import annotations

import math
import uuid
from dataclasses import replace
from xml.sax.saxutils import quoteattr

import numpy as np

from linid.export.simpler import thrust_per_current
from linid.export.target import Exported, Target
from linid.export.targets.twincat.feed_forward import NAME, declaration, units_of
from linid.export.targets.twincat.form import form, lacks
from linid.export.targets.twincat.tables import FRICTION_ENTRIES, friction_table

_SPACE = uuid.UUID("a1f6a1de-7a33-5d0e-9c1e-6f2f3f1f0b11")  # of identifiers that a name alone decides
# TF5200 counts speeds in um/s (rotary: 0.001 degrees/s); what it gives out is in units of the drive.
_LINEAR_SPEED, _ROTARY_SPEED, _OUT = 1e6, 1e3 * 180.0 / math.pi, 1e6


def tc_pou(head: str, body: str) -> str:
    """The function block as TwinCAT 3 keeps it in a project. head, body: declaration and implementation."""
    number = uuid.uuid5(_SPACE, NAME)
    return "\n".join(
        [
            '<?xml version="1.0" encoding="utf-8"?>',
            '<TcPlcObject Version="1.1.0.1">',
            f'  <POU Name={quoteattr(NAME)} Id="{{{number}}}" SpecialFunc="None">',
            f"    <Declaration><![CDATA[{head}]]></Declaration>",
            "    <Implementation>",
            f"      <ST><![CDATA[{body}]]></ST>",
            "    </Implementation>",
            "  </POU>",
            "</TcPlcObject>",
            "",
        ]
    )


def friction_list(exported: Exported) -> str:
    """The compensation value list of TF5200 (P-COMP-00041 to 00047): friction over speed, both ways alike."""
    table, unit, thrust = friction_table(exported), units_of(exported.result), abs(thrust_per_current(exported))
    rotary = exported.result.axis == "rotary"
    scale, place = (_ROTARY_SPEED, "0.001 degrees/s") if rotary else (_LINEAR_SPEED, "um/s")
    out = f"1e-6 {exported.result.input_unit}" if thrust else f"1e-6 {unit.force}"
    per_out = _OUT / (thrust or 1.0)
    rows = [(round(v * scale), round(f * per_out)) for v, f in zip(table.v, table.force, strict=True)]
    rows = [row for k, row in enumerate(rows) if row[0] > 0 and (k == 0 or row[0] > rows[k - 1][0])]
    places, force = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
    rounded = replace(table, v=places / scale, force=force / per_out)
    top = float(table.speeds[-1])
    return "\n".join(
        [
            f"# {exported.name}: friction over speed for TF5200, at most {FRICTION_ENTRIES} entries.",
            f"# .in: {place}; .out: {out}, to be scaled to the drive's unit by scaling_factor.",
            f"# Straight lines between the entries miss the friction by at most {rounded.error:.3g} {unit.force}"
            f" up to {top:.3g} {unit.place}/s.",
            "# The same both ways: what differs by direction or position is in the function block alone.",
            "frict_comp.mode 3",
            f"frict_comp.table_entries {len(rows)}",
            "frict_comp.position_delay 0",
            "frict_comp.reversal_lookahead 0",
            "frict_comp.scaling_factor 1",
            "frict_comp.delay_cycles 0",
            *(f"frict_comp.table[{k}].in {v}\nfrict_comp.table[{k}].out {f}" for k, (v, f) in enumerate(rows)),
            "",
        ]
    )


def files(exported: Exported) -> dict[str, bytes]:
    """The function block (.st and .TcPOU) and friction.lis; raises UsageError as `form` does."""
    head, body = declaration(exported, form(exported), lacks(exported))
    texts = {
        f"{NAME}.st": f"{head}\n{body}END_FUNCTION_BLOCK\n",
        f"{NAME}.TcPOU": tc_pou(head, body),
        "friction.lis": friction_list(exported),
    }
    return {name: text.encode() for name, text in texts.items()}


TARGET = Target(
    name="twincat",
    purpose="TwinCAT 3: a feed-forward in Structured Text, and the friction table of TF5200.",
    files=files,
    simplified=form,
    lacks=lacks,
)
