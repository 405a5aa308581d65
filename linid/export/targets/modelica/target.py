"""The target `modelica`: one package, with the axis as a sampled block, of the whole model."""

from __future__ import annotations

import html
import math
import re
from typing import TYPE_CHECKING

from linid.export.target import Exported, Target

if TYPE_CHECKING:
    from linid.export.program.build import ModelProgram
    from linid.export.translate.writers.modelica import ModelicaWriter

_REMEMBERED = 16  # samples of inputs that act late, at least
_ORDER = 1  # of the inputs between samples, as that of the FMU


def modelica_unit(unit: str) -> str:
    """A unit such as `N s^2/m^2` as Modelica writes it: `N.s2/m2`."""
    over, _, under = unit.replace("^", "").partition("/")
    below = ".".join(under.strip("()").split())
    return ".".join(over.split()) + (f"/({below})" if "." in below else f"/{below}" if below else "")


def _files(exported: Exported) -> dict[str, bytes]:
    from linid.export.program.build import program_of

    return {f"{exported.name}.mo": package(exported, program_of(exported)).encode("utf-8")}


def package(exported: Exported, program: ModelProgram) -> str:
    """The package's text."""
    from linid.export.program.words import inputs_in_words, title_of, units_of
    from linid.export.targets.modelica.texts import ABOUT, BLOCK, DRIVER, EXAMPLE, FIELD_OF, PACKAGE
    from linid.export.translate.writers.modelica import ModelicaWriter, quoted

    writer = ModelicaWriter()
    functions = writer.program(list(program.functions))
    marks = {
        "block": BLOCK,
        "driver": DRIVER,
        "example": EXAMPLE,
        "field_of": FIELD_OF if _with_field(writer, program) else "",
        "functions": "\n".join(f"    {line}".rstrip() for line in functions.splitlines()),
        "about": quoted(ABOUT.replace("\n", " ")),
        "title": quoted(title_of(exported)),
        "title_html": html.escape(title_of(exported)),
        "what": inputs_in_words(exported)[0].upper() + inputs_in_words(exported)[1:],
        "units": units_of(exported),
    }
    marks |= _numbers(exported, program) | _declarations(exported, program, writer) | _calls(program, writer)
    text = PACKAGE
    for mark, value in marks.items():
        text = text.replace(f"@{mark}@", value)
    return text.replace("@name@", exported.name)


def _with_field(writer: ModelicaWriter, program: ModelProgram) -> bool:
    """Whether the model works with harmonics of a motor's field."""
    return "field" in writer.changed(program.entries["prepare"])


def _numbers(exported: Exported, program: ModelProgram) -> dict[str, str]:
    from linid.export.program.build import GOING

    kept = len(GOING) + 2  # and time and the number of samples
    period = exported.step * exported.result.substeps
    return {
        "tolerance": repr(program.tolerance),
        "period": repr(period),
        "step": repr(exported.step),
        "order": str(_ORDER),
        "remembered": str(_remembered(exported, period) if program.delayed else 1),
        "substeps": str(program.substeps),
        "count": str(max(len(program.inputs), 1)),
        "count_p": str(len(program.parameters)),
        "count_s": str(len(program.state)),
        "first_s": str(kept + 1),
        "memory": str(kept + len(program.state)),
        "table": str(program.table),
        **{name: str(GOING.index(name) + 1) for name in ("followed", "halvings")},
        "glide": str(GOING.index("glide_1") + 1),
    }


def _name(writer: ModelicaWriter, parameter: str) -> str:
    """A model's parameter as the block calls it: neither as a word of the language nor as one of its variables."""
    from linid.export.targets.modelica.texts import BLOCK

    taken = parameter in re.findall(r"(?:Real|Integer) (\w+)", BLOCK)
    return f"{parameter}_" if taken else writer.variable(parameter)


def _remembered(exported: Exported, period: float) -> int:
    """Samples of inputs that act late: four times as many as the identified delays take."""
    from linid.physics.effects.registry import find_effect

    late = [effect for effect in map(find_effect, exported.model.effects) if effect.delay is not None]
    delay = sum(abs(exported.values[p.name]) for effect in late for p in effect.parameters if p.unit == "s")
    return max(_REMEMBERED, math.ceil(4.0 * delay / period))


def _declarations(exported: Exported, program: ModelProgram, writer: ModelicaWriter) -> dict[str, str]:
    """Constants, inputs and parameters."""
    from linid.export.program.build import GOING
    from linid.export.program.words import unit_of_inputs
    from linid.export.translate.writers.modelica import quoted

    rotary, per_mass = exported.result.axis == "rotary", exported.result.per_mass
    force = "N.m" if rotary else "N"
    mass = "kg.m2" if rotary else "kg"
    slots = (*program.parameters, *program.own)
    places = [("P", [one.name for one in program.parameters]), ("OWN", [one.name for one in program.own])]
    places += [("S", list(program.state))]
    constants = [f"  constant Integer {a}_{one} = {k};" for a, names in places for k, one in enumerate(names, 1)]
    constants += [f"  constant Integer T = {len(GOING) + 1};", f"  constant Integer KNOWN = {len(GOING) + 2};"]
    unit = modelica_unit(unit_of_inputs(exported))
    angle = "6.283185307179586 * (frequency * time - {}.0 / 3.0)"
    drives = [f"axis.{name} = amplitude * sin({angle.format(k)});" for k, name in enumerate(program.inputs)]
    return {
        "places": "\n".join(constants),
        "inputs": "\n".join(f'    input Real {one}(unit = "{unit}") "Drives the axis";' for one in program.inputs),
        "parameters": "\n".join(
            f'    parameter Real {_name(writer, one.name)}(unit = "{modelica_unit(one.unit)}") = {one.value!r} '
            f"{quoted(one.meaning or one.name)};"
            for one in slots
        ),
        "way": "rad" if rotary else "m",
        "force": ("m/s2" if not rotary else "rad/s2") if per_mass else force,
        "mass": "1" if per_mass else mass,
        "list_inputs": ", ".join(program.inputs) or "0.0",
        "list_p": ", ".join(_name(writer, one.name) for one in program.parameters),
        "drives": "\n".join(f"    {one}" for one in drives),
    }


def _calls(program: ModelProgram, writer: ModelicaWriter) -> dict[str, str]:
    """What the functions around the simulation's own hand on."""
    own, field = bool(program.own), _with_field(writer, program)
    given = ["parameters", *(["own_parameters"] if own else [])]
    take = [f"    input Real {name}[:];" for name in given]
    table, names = program.table, [_name(writer, one.name) for one in program.own]
    return {
        "take": "\n".join(take),
        "take_field": "\n".join([*take, *(["    input Real field[:];"] if field else [])]),
        "given": ", ".join(given),
        "given_field": ", ".join([*given, *(["field"] if field else [])]),
        "local_field": f"\n    Real field[{table}];" if field else "",
        "zero_field": f"\n    field := zeros({table});" if field else "",
        "make_field": f"\n    field := field_of({', '.join(given)});" if field else "",
        "own": f"\n    final parameter Real own_parameters[{len(program.own)}] = {{{', '.join(names)}}};"
        if own
        else "",
        "field": f"\n    final parameter Real field[{table}] = field_of({', '.join(given)});" if field else "",
        **{f"call_{entry}": _call(program, writer, entry) for entry in program.entries},
    }


def _call(program: ModelProgram, writer: ModelicaWriter, entry: str) -> str:
    """One call of the simulation's own functions, as a statement."""
    from linid.export.program.build import GOING, MOTION

    before = {name: f"memory_before[{k}]" for k, name in enumerate(GOING, 1)}
    before["followed"], before["halvings"] = f"{before['followed']} > 0.5", f"integer({before['halvings']} + 0.5)"
    before["steps"] = "0"  # counted from sample to sample, so that no Integer ends
    after = {name: f"memory[{k}]" for k, name in enumerate(GOING, 1)}
    known = {"clock_1": "t", "clock_2": "dt", "clock_3": "substeps", "clock_4": "TOLERANCE"}
    known |= {f"start_of_axis_{k}": f"motion[{k}]" for k in (1, 2, 3)} | {"n": "n", "stepping": "stepping"}
    known |= {f"going_motion_{name}" if name in MOTION else f"going_{name}": text for name, text in before.items()}
    results: dict[str, list[str]] = {
        "prepare": [],
        "start": [after[name] for name in MOTION],
        "advance": [name if name in ("followed", "halvings", "steps") else after[name] for name in GOING],
        "outputs": ["position", "speed", "friction_force", "thrust"],
    }
    if entry == "outputs":
        known |= {f"motion_{name}": after[name] for name in MOTION} | {"t": "memory[T]"}
    function = program.entries[entry]
    left = [*writer.changed(function), *results[entry]]
    call = writer.call(function, [known[one.name] for one in function.arguments])
    return f"{left[0] if len(left) == 1 else '(' + ', '.join(left) + ')'} := Core.{call};"


TARGET = Target(
    name="modelica",
    purpose="One Modelica package of the whole model: the axis as a sampled block, and whole recordings.",
    files=_files,
)
