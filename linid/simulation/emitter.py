"""Writes the compiled kernel's source from the template, the motors and the effects, and loads it.

One guarded kernel serves every set of effects (`if on & bit`), a bare one all motors without effects, which compiles in
half the time; a specialised one holds only what is active.
The file's name carries a hash of all sources, because numba's cache does not see edits in called functions.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import os
import re
import sys
import tempfile
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numba

from linid.physics import electrical, friction, motors, theta
from linid.physics.effects.effect import TERM_ARGUMENTS, Effect
from linid.physics.effects.registry import EFFECTS
from linid.physics.kernel_cache import cache_folder, lock_compilation
from linid.physics.model import EFFECT_SLOTS, ELAPSED, RECORD, STATE_SIZE, STATE_START, STATEFUL, WINDING_START, Model

_WRITTEN = 1_000_000_000  # s since 1970, the time that an emitted source bears
_PARTS = ("terms", "kernel", "along")
_BARE = Model("friction")
_MOTOR_TEXT = {
    motors.FORCE: "force = p[8] * i_1",
    motors.SINE: "force = phase_force(y, i_1, i_2, i_3, wavenumber, phase, table, harmonics)",
    motors.THETA: (
        "force = phase_force(y, i_1, i_2, i_3, wavenumber, phase, table, harmonics) if harmonics > 0 "
        "else gaussian_force(y, i_1, i_2, i_3, p[8:14])"
    ),
}


def _call(index: int, effect: Effect, name: str) -> str:
    """The call of one term with its parameters and hidden states taken from `p`."""
    first = ", ".join(argument for argument in TERM_ARGUMENTS[name] if argument not in ("s_1", "s_2"))
    pieces = [first] if first else []
    if "s_1" in TERM_ARGUMENTS[name]:
        place = "STATE_START" + (" + STATE_SIZE" if name == "advance" else "")
        at = 2 * STATEFUL.index(effect) if effect in STATEFUL else -1
        pieces += [f"p[{place} + {at + k}]" if at >= 0 else "0.0" for k in (0, 1)]
    pieces += [f"p[{EFFECT_SLOTS[parameter.name]}]" for parameter in effect.parameters]
    return f"effect_{index}_{name}({', '.join(pieces)})"


def _statement(effect: Effect, name: str, call: str) -> str:
    """What the kernel does with the value of a term."""
    if name in ("initial", "advance"):
        at = 2 * STATEFUL.index(effect)
        return f"p[STATE_START + {at}], p[STATE_START + {at + 1}] = {call}"
    template = {
        "delay": "delay += {}",
        "drive": "i_1, i_2, i_3 = {}",
        "field": "field = {}",
        "thrust": "factor *= {}",
        "force": "force += {}",
        "friction": "factor *= {}",
        "level": "factor *= {}",
        "load": "load += {}",
        "mass": "mass += {}",
        "sensor": "error += {}",
    }[name]
    return template.format(call)


def _lines(name: str, model: Model | None) -> list[str]:
    """The lines of one term: all effects behind guards, or only those of `model`."""
    lines: list[str] = []
    for index, effect in enumerate(EFFECTS):
        if name not in effect.terms:
            continue
        call = _call(index, effect, name)
        if name == "field":
            call = call.replace("(t, y,", "(t, field,", 1)
        statement = _statement(effect, name, call)
        if model is None:
            lines += [f"if on & {1 << index}:", f"    {statement}"]
        elif effect.name in model.effects:
            lines.append(statement)
    return lines


def _motors(model: Model | None) -> list[str]:
    """The lines of the motor's force: all motors behind guards, or that of `model`."""
    if model is not None:
        return [_MOTOR_TEXT[model.motor]] if model.motor in _MOTOR_TEXT else []
    lines: list[str] = []
    for code, text in _MOTOR_TEXT.items():
        lines += [f"if motor == {code}:", f"    {text}"]
    return lines


def _constants(model: Model | None) -> list[str]:
    """Layout of the work vector, and the bits of all effects that have a term."""
    bits = {
        name: sum(
            1 << index
            for index, effect in enumerate(EFFECTS)
            if name in effect.terms and (model is None or effect.name in model.effects)
        )
        for name in TERM_ARGUMENTS
    }
    values = {
        f"{name.upper()}S": bits[name] for name in ("delay", "drive", "field", "thrust", "friction", "level", "load")
    }
    values |= {"MASSES": bits["mass"], "SENSORS": bits["sensor"], "STATES": bits["advance"]}
    values["PUSHES"] = bits["drive"] | bits["field"] | bits["thrust"] | bits["force"]
    values["MOVING"] = bits["level"] | bits["load"] | bits["advance"]
    values |= {"WINDING": WINDING_START}
    values |= {"RECORD": RECORD, "ELAPSED": ELAPSED, "STATE_START": STATE_START, "STATE_SIZE": STATE_SIZE}
    values["WORK_SIZE"] = STATE_START + 2 * STATE_SIZE
    return [f"{name} = {value}" for name, value in values.items()]


def emit(model: Model | None = None, by_voltage: bool = False, bare: bool = False) -> str:
    """The kernel's source text: guarded for all effects (None) or specialised for one model.

    by_voltage: the inputs are phase voltages and the currents are states; bare: all motors, but no effects.
    """
    motor_lines = _motors(model)
    if bare:
        model = _BARE
    folder = Path(__file__).parent
    text, *others = ((folder / f"{part}_template.py").read_text(encoding="utf-8") for part in _PARTS)
    text += "".join("\n\n" + other.split("# <body>\n", 1)[1].strip() + "\n" for other in others)
    text = re.sub(r" *# <only by current>\n(.*?) *# <end by current>\n", "" if by_voltage else r"\1", text, flags=re.S)
    imports = [
        f"effect_{index}_{name} = EFFECTS[{index}].{name}"
        for index, effect in enumerate(EFFECTS)
        if model is None or effect.name in model.effects
        for name in effect.terms
    ]
    blocks = {
        "imports": ["from linid.physics.effects.registry import EFFECTS", "", *imports],
        "constants": _constants(model),
        "motors": motor_lines,
        # Without effects every guard falls away.
        "on": ["on = 0"] if model is not None and not model.effects else [],
        **{name: _lines(name, model) for name in TERM_ARGUMENTS},
        **_voltage_sections(folder, by_voltage),
    }
    for mark, lines in blocks.items():
        text = _filled(text, mark, lines)
    return text


def _voltage_sections(folder: Path, wanted: bool) -> dict[str, list[str]]:
    """Lines by mark of what a motor driven by voltages does besides; nothing for one driven by currents."""
    text = (folder / "voltage_sections.txt").read_text(encoding="utf-8")
    sections = {}
    for section in text.split("# <section ")[1:]:
        name, body = section.split(">\n", 1)
        sections[name] = body.rstrip("\n").split("\n") if wanted else []
    return sections


def _filled(text: str, mark: str, lines: list[str]) -> str:
    """The text with its mark `# <mark>` replaced by lines of the same indentation."""
    while f"# <{mark}>" in text:
        before, after = text.split(f"# <{mark}>", 1)
        indent = before[before.rindex("\n") + 1 :]
        text = before + f"\n{indent}".join(lines) + after
    return text


def _source_hash(text: str) -> str:
    """Hash of the kernel's text and of every source that is compiled into it."""
    digest = hashlib.sha256(text.encode())
    modules: dict[str, str] = {}
    constants: dict[str, str] = {}
    for module in (friction, theta, motors, electrical):
        modules[module.__name__] = inspect.getsource(module)
    for effect in EFFECTS:
        for function in effect.terms.values():
            _collect_sources(function, modules, constants)
    for name, content in sorted((modules | constants).items()):
        digest.update(f"{name} {content}".encode())
    digest.update(f"{numba.__version__} {sys.version_info[:2]}".encode())
    return digest.hexdigest()[:16]


def _collect_sources(function: Any, modules: dict[str, str], constants: dict[str, str]) -> None:
    """Sources of a compiled function's module and of all it calls, and the constants that they take from elsewhere."""
    python = function.py_func
    module = inspect.getmodule(python)
    place = f"{python.__module__}.{python.__qualname__}"
    if place in constants:
        return
    constants[place] = ""
    if module is not None and module.__name__ not in modules:
        modules[module.__name__] = inspect.getsource(module)
    for name in python.__code__.co_names:
        value = python.__globals__.get(name)
        if hasattr(value, "py_func"):
            _collect_sources(value, modules, constants)
        elif isinstance(value, int | float | tuple):
            constants[f"{place}.{name}"] = repr(value)


@cache
def load_kernel(model: Model | None = None, by_voltage: bool = False, bare: bool = False) -> ModuleType:
    """The compiled kernel module, as in `emit`, from the disk cache where it is there already."""
    text = emit(model, by_voltage, bare)
    name = f"kernel_{_source_hash(text)}"
    folder = cache_folder()
    lock_compilation()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = tempfile.NamedTemporaryFile(dir=folder, delete=True)  # noqa: SIM115 - closed on the next line
        probe.close()
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix="linid-kernel-"))
    path = folder / f"{name}.py"
    if not path.exists():
        handle, temporary = tempfile.mkstemp(dir=folder, suffix=".tmp")
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        # numba's cache goes by the source's time: whichever of several processes writes it last, it is the same file.
        os.utime(temporary, (_WRITTEN, _WRITTEN))
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    specification = importlib.util.spec_from_file_location(name, path)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module
