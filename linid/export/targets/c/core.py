"""An exported model as one C99 source with its header: whole recordings by their splines, and step by step."""

from __future__ import annotations

from collections.abc import Mapping

from linid.export.program.build import GOING, HISTORY, MOTION, ModelProgram, program_of
from linid.export.program.words import inputs_in_words, title_of, units_of
from linid.export.target import Exported
from linid.export.targets.c.texts import HEADER, SOURCE, TEST
from linid.export.translate.tree import Function
from linid.export.translate.writers.c import CWriter

_TYPES = {"followed": "int", "halvings": "long", "steps": "long"}


def type_of(field: str) -> str:
    """The C type of a field of a simulation's state."""
    return _TYPES.get(field, "double")


def c_files(exported: Exported) -> dict[str, bytes]:
    """Header, source and test program by file name."""
    program = program_of(exported)
    texts = {
        f"{exported.name}.h": filled(HEADER, exported, program),
        f"{exported.name}.c": filled(SOURCE, exported, program),
        f"{exported.name}_test.c": filled(TEST, exported, program),
    }
    return {name: text.encode("utf-8") for name, text in texts.items()}


def filled(text: str, exported: Exported, program: ModelProgram, more: Mapping[str, str] | None = None) -> str:
    """A text with what the model is, and with what else is given, in place of words between two @."""
    name = exported.name
    for mark, value in (_marks(exported, program) | dict(more or {})).items():
        text = text.replace(f"@{mark}@", value)
    return text.replace("@name@", name).replace("@NAME@", name.upper())


def _marks(exported: Exported, program: ModelProgram) -> dict[str, str]:
    writer = CWriter(f"{exported.name}_model")
    functions = writer.program(list(program.functions)).strip("\n")
    rows = (*(("p", slot) for slot in program.parameters), *(("own", slot) for slot in program.own))
    defaults = [f"    m->{a}[{a.upper()}_{slot.name}] = {slot.value!r}; /* {slot.unit} */" for a, slot in rows]
    going = {f"going_motion_{name}" if name in MOTION else f"going_{name}": f"m->{name}" for name in GOING}
    motion = {f"motion_{name}": f"m->{name}" for name in MOTION}
    clock = {"clock_1": "t", "clock_2": "dt", "clock_3": "substeps", "clock_4": f"{exported.name.upper()}_TOLERANCE"}
    begin = {"start_of_axis_1": "y", "start_of_axis_2": "v", "start_of_axis_3": "w"}

    def call(entry: str, known: dict[str, str], results: list[str]) -> str:
        function: Function = program.entries[entry]
        given = ["m", *(known[one.name] for one in function.arguments)]
        return f"{writer.function_name(function)}({', '.join([*given, *(f'&{one}' for one in results)])});"

    return {
        "title": title_of(exported),
        "what": inputs_in_words(exported),
        "units": units_of(exported),
        "tolerance": repr(program.tolerance),
        "step": repr(exported.step),
        "substeps": str(program.substeps),
        "history": str(HISTORY if program.delayed else 1),
        "count_inputs": str(len(program.inputs)),
        "count_p": str(len(program.parameters)),
        "count_own": str(max(len(program.own), 1)),
        "count_s": str(len(program.state)),
        "table": str(program.table),
        "enum_p": _enum("P", [slot.name for slot in program.parameters]),
        "enum_own": _enum("OWN", [slot.name for slot in program.own]),
        "enum_s": _enum("S", list(program.state)),
        "fields": "\n".join(f"    {type_of(field)} {field};" for field in GOING),
        "functions": functions,
        "defaults": "\n".join(defaults),
        "call_prepare": call("prepare", {}, []),
        "call_start": call("start", clock | begin, [f"m->{name}" for name in MOTION]),
        "call_advance": call(
            "advance", clock | going | {"n": "n", "stepping": "stepping"}, [f"next.{name}" for name in GOING]
        ),
        "call_outputs": call("outputs", motion | {"t": "t"}, [f"out[{k}]" for k in range(4)]),
        "copy_next": "\n".join(f"    m->{field} = next.{field};" for field in GOING),
    }


def _enum(prefix: str, names: list[str]) -> str:
    if not names:
        return ""
    return f"enum {{ {', '.join(f'{prefix}_{name}' for name in names)} }};"
