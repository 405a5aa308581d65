"""The descriptions of an FMU: its variables with units and starts, as FMI 2.0 and 3.0 want them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from linid.export.program.build import ModelProgram
from linid.export.program.words import title_of, unit_of_inputs
from linid.export.target import Exported

# Exponents of kg, m, s, A, rad in SI units with names of their own.
_BASE = ("kg", "m", "s", "A", "rad")
_UNITS = {
    "N": (1, 1, -2, 0, 0),
    "V": (1, 2, -3, -1, 0),
    "Hz": (0, 0, -1, 0, 0),
    **{name: tuple(int(name == other) for other in _BASE) for name in _BASE},
}
ORDER = 1  # of the inputs between communication points, unless the user says otherwise


@dataclass(frozen=True)
class Variable:
    """One variable: its place in the list is its value reference. start: None for what is calculated."""

    name: str
    unit: str
    causality: str
    variability: str
    start: float | None
    words: str

    @property
    def initial(self) -> str:
        """Its attribute `initial`, after a blank, where it needs one."""
        kinds = {"output": "calculated", "parameter": "exact"}
        return f' initial="{kinds[self.causality]}"' if self.causality in kinds else ""


def variables_of(exported: Exported, program: ModelProgram) -> tuple[Variable, ...]:
    """All variables, in the order of their value references."""
    rotary = exported.result.axis == "rotary"
    way, force, mass = ("rad", "N m", "kg m^2") if rotary else ("m", "N", "kg")
    if exported.result.per_mass:
        force, mass = f"{force}/({mass})", "1"
    given = unit_of_inputs(exported)
    rows = [Variable("time", "s", "independent", "continuous", None, "time")]
    rows += [Variable(name, given, "input", "continuous", 0.0, "drives the axis") for name in program.inputs]
    outputs = (
        ("position", way, "reading of the position"),
        ("speed", f"{way}/s", "speed"),
        ("friction_force", force, "friction"),
        ("thrust", force, "force of the motor"),
    )
    rows += [Variable(name, unit, "output", "continuous", None, words) for name, unit, words in outputs]
    fixed = (
        ("start_position", way, 0.0, "position at the start"),
        ("start_speed", f"{way}/s", 0.0, "speed at the start"),
        ("record", "1", 0.0, "number of the recording in its campaign, for what acts in single ones"),
        ("elapsed", "s", 0.0, "running time of the campaign at time 0"),
        ("added_mass", mass, 0.0, "mass on the mover besides its own"),
        ("internal_step", "s", exported.step, "longest internal step"),
        ("input_order", "1", float(ORDER), "inputs within a step: 0 held, 1 line, 2 parabola through the last ones"),
    )
    rows += [Variable(name, unit, "parameter", "fixed", start, words) for name, unit, start, words in fixed]
    for slot in (*program.parameters, *program.own):
        rows.append(Variable(slot.name, slot.unit, "parameter", "tunable", slot.value, slot.meaning or slot.name))
    return tuple(rows)


def fmi2_description(exported: Exported, program: ModelProgram, token: str, sources: Iterable[str]) -> str:
    """modelDescription.xml of FMI 2.0."""
    variables = variables_of(exported, program)
    lines = []
    for number, one in enumerate(variables):
        real = f"<Real unit={quoteattr(one.unit)}" + ("" if one.start is None else f' start="{one.start!r}"') + "/>"
        lines.append(
            f'<ScalarVariable name="{one.name}" valueReference="{number}" causality="{one.causality}" '
            f'variability="{one.variability}"{one.initial} description={quoteattr(one.words)}>{real}</ScalarVariable>'
        )
    outputs = [k + 1 for k, one in enumerate(variables) if one.causality == "output"]
    unknowns = "".join(f'<Unknown index="{k}"/>' for k in outputs)
    files = "".join(f'<File name="{name}"/>' for name in sources)
    equal = "false" if program.delayed else "true"
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{exported.name}" guid="{token}"
    description={quoteattr(title_of(exported))} generationTool="linid" variableNamingConvention="flat">
<CoSimulation modelIdentifier="{exported.name}" canHandleVariableCommunicationStepSize="{equal}"
    canNotUseMemoryManagementFunctions="true" canGetAndSetFMUstate="true" canSerializeFMUstate="true">
<SourceFiles>{files}</SourceFiles>
</CoSimulation>
<UnitDefinitions>
{_units(variables)}
</UnitDefinitions>
<DefaultExperiment startTime="0.0" stopTime="1.0" stepSize="{_step(exported)!r}"/>
<ModelVariables>
{chr(10).join(lines)}
</ModelVariables>
<ModelStructure><Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""


def fmi3_description(exported: Exported, program: ModelProgram, token: str) -> str:
    """modelDescription.xml of FMI 3.0."""
    variables = variables_of(exported, program)
    lines = []
    for number, one in enumerate(variables):
        start = "" if one.start is None else f' start="{one.start!r}"'
        lines.append(
            f'<Float64 name="{one.name}" valueReference="{number}" causality="{one.causality}" '
            f'variability="{one.variability}"{one.initial} description={quoteattr(one.words)} '
            f"unit={quoteattr(one.unit)}{start}/>"
        )
    outputs = [k for k, one in enumerate(variables) if one.causality == "output"]
    structure = "".join(f'<Output valueReference="{k}"/>' for k in outputs)
    structure += "".join(f'<InitialUnknown valueReference="{k}"/>' for k in outputs)
    equal = "false" if program.delayed else "true"
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{exported.name}" instantiationToken="{token}"
    description={quoteattr(title_of(exported))} generationTool="linid" variableNamingConvention="flat">
<CoSimulation modelIdentifier="{exported.name}" canHandleVariableCommunicationStepSize="{equal}"
    canGetAndSetFMUState="true" canSerializeFMUState="true"/>
<UnitDefinitions>
{_units(variables)}
</UnitDefinitions>
<DefaultExperiment startTime="0.0" stopTime="1.0" stepSize="{_step(exported)!r}"/>
<ModelVariables>
{chr(10).join(lines)}
</ModelVariables>
<ModelStructure>{structure}</ModelStructure>
</fmiModelDescription>
"""


def build_description(exported: Exported, sources: Iterable[str]) -> str:
    """sources/buildDescription.xml of FMI 3.0."""
    files = "".join(f'<SourceFile name="{name}"/>' for name in sources)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
<BuildConfiguration modelIdentifier="{exported.name}">
<SourceFileSet language="C99">{files}</SourceFileSet>
</BuildConfiguration>
</fmiBuildDescription>
"""


def _step(exported: Exported) -> float:
    """A usual communication step, s."""
    return exported.step * exported.result.substeps


def _units(variables: Iterable[Variable]) -> str:
    lines = []
    for unit in sorted({one.unit for one in variables}):
        powers = exponents(unit)
        base = ""
        if powers is not None:
            base = " ".join(f'{name}="{power}"' for name, power in zip(_BASE, powers, strict=True) if power)
            base = f"<BaseUnit {base}/>".replace(" />", "/>")
        lines.append(f"<Unit name={quoteattr(unit)}>{base}</Unit>")
    return "\n".join(lines)


def exponents(unit: str) -> tuple[int, ...] | None:
    """Exponents of kg, m, s, A, rad of a unit such as "N s^2/m^2"; None for one that has a name unknown here."""
    total = [0] * len(_BASE)
    for sign, part in zip((1, -1), unit.replace("(", "").replace(")", "").split("/"), strict=False):
        for word in part.split():
            found = re.fullmatch(r"([A-Za-z]+|1)(?:\^(-?\d+))?", word)
            if found is None or (found[1] != "1" and found[1] not in _UNITS):
                return None
            power = sign * int(found[2] or 1)
            for k, one in enumerate(_UNITS.get(found[1], (0,) * len(_BASE))):
                total[k] += power * one
    return tuple(total)
