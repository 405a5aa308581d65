"""Writes the compiled kernel's source from the template, the motors and the effects, and loads it.

One guarded kernel serves every set of effects (`if on & bit`); a specialised one holds only what is active.
The file's name carries a hash of all sources, because numba's cache does not see edits in called functions.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import os
import sys
import tempfile
from functools import cache
from pathlib import Path
from types import ModuleType

import numba

from linid.physics import friction, motors, theta
from linid.physics.effects.registry import EFFECTS
from linid.physics.model import EFFECT_SLOTS, Model

_MOTOR_TEXT = {
    motors.FORCE: "force = p[8] * i_1",
    motors.SINE: "force = phase_force(y, i_1, i_2, i_3, wavenumber, phase, table, harmonics)",
    motors.THETA: (
        "force = phase_force(y, i_1, i_2, i_3, wavenumber, phase, table, harmonics) if harmonics > 0 "
        "else gaussian_force(y, i_1, i_2, i_3, p[8:14])"
    ),
}


def cache_folder() -> Path:
    """Where emitted kernels and their machine code are kept (LINID_CACHE_DIR, else the user's cache)."""
    chosen = os.environ.get("LINID_CACHE_DIR")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "linid"


def _forces(model: Model | None) -> list[str]:
    """The lines of `external_force`: all motors and effects behind guards, or only those of `model`."""
    lines: list[str] = []
    if model is None:
        for code, text in _MOTOR_TEXT.items():
            lines += [f"if powered and motor == {code}:", f"    {text}"]
    elif model.motor in _MOTOR_TEXT:
        lines += ["if powered:", f"    {_MOTOR_TEXT[model.motor]}"]
    for index, effect in enumerate(EFFECTS):
        arguments = ", ".join(f"p[{EFFECT_SLOTS[parameter.name]}]" for parameter in effect.parameters)
        call = f"force += effect_{index}(t, y, v, {arguments})"
        if model is None:
            lines += [f"if on & {1 << index}:", f"    {call}"]
        elif effect.name in model.effects:
            lines.append(call)
    return lines


def emit(model: Model | None = None) -> str:
    """The kernel's source text: guarded for all effects (None) or specialised for one model."""
    template = (Path(__file__).parent / "kernel_template.py").read_text(encoding="utf-8")
    imports = [
        f"from {inspect.getmodule(effect.force.py_func).__name__} import force as effect_{index}"  # type: ignore
        for index, effect in enumerate(EFFECTS)
    ]
    text = template.replace("# <imports>", "\n".join(imports))
    return text.replace("    # <forces>", "\n".join("    " + line for line in _forces(model)))


def _source_hash(text: str) -> str:
    digest = hashlib.sha256(text.encode())
    modules = [friction, theta, motors, *(inspect.getmodule(effect.force.py_func) for effect in EFFECTS)]  # type: ignore
    for module in modules:
        digest.update(inspect.getsource(module).encode())  # type: ignore
    digest.update(f"{numba.__version__} {sys.version_info[:2]}".encode())
    return digest.hexdigest()[:16]


@cache
def load_kernel(model: Model | None = None) -> ModuleType:
    """The compiled kernel module, from the disk cache where it is there already."""
    text = emit(model)
    name = f"kernel_{_source_hash(text)}"
    folder = cache_folder()
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
        os.replace(temporary, path)
    specification = importlib.util.spec_from_file_location(name, path)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module
