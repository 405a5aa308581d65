"""An FMU of an exported model: sources, descriptions, and the binary of this platform where there is a C compiler."""

from __future__ import annotations

import hashlib
import io
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from linid.errors import UsageError
from linid.export.program.build import program_of
from linid.export.target import Exported
from linid.export.targets.c.core import c_files, filled
from linid.export.targets.fmu.description import ORDER, build_description, fmi2_description, fmi3_description
from linid.export.targets.fmu.fmi2 import FMI2
from linid.export.targets.fmu.fmi3 import FMI3
from linid.export.targets.fmu.texts import COMMON

_COMPILERS = ("cc", "gcc", "clang")
_DATE = (1980, 1, 1, 0, 0, 0)  # of all files: equal models give equal units
# Folder and ending of binaries by platform, of FMI 2.0 and 3.0.
_PLATFORMS = {
    "linux": ("linux64", "x86_64-linux", ".so"),
    "darwin": ("darwin64", "x86_64-darwin", ".dylib"),
    "win32": ("win64", "x86_64-windows", ".dll"),
}


def compiler() -> str | None:
    """A C compiler's path, None where there is none."""
    return next((found for name in _COMPILERS if (found := shutil.which(name))), None)


def platform_of(version: int) -> tuple[str, str]:
    """Folder and ending of this platform's binaries in units of FMI 2 or 3."""
    import platform

    folder_2, folder_3, ending = _PLATFORMS.get(sys.platform, _PLATFORMS["linux"])
    machine = platform.machine().lower()
    if machine in ("arm64", "aarch64"):
        folder_3 = folder_3.replace("x86_64", "aarch64")
    return (folder_2 if version == 2 else folder_3), ending


def unit(exported: Exported, version: int) -> bytes:
    """The FMU of FMI 2 or 3 as a zip file; raises UsageError where the compiler refuses the sources."""
    program = program_of(exported)
    name = exported.name
    more = {"true_own": str(len(program.own)), "order": repr(float(ORDER))}
    wrapper = f"fmi{version}.c"
    sources = {f"{name}.{end}": c_files(exported)[f"{name}.{end}"] for end in ("c", "h")}
    token = "{" + hashlib.sha256(b"".join(sources.values())).hexdigest()[:32] + "}"
    sources["common.h"] = filled(COMMON, exported, program, more).encode("utf-8")
    sources[wrapper] = filled(FMI2 if version == 2 else FMI3, exported, program, more | {"token": token}).encode(
        "utf-8"
    )
    built = [f"{name}.c", wrapper]
    files = {f"sources/{path}": content for path, content in sources.items()}
    if version == 2:
        files["modelDescription.xml"] = fmi2_description(exported, program, token, built).encode("utf-8")
    else:
        files["modelDescription.xml"] = fmi3_description(exported, program, token).encode("utf-8")
        files["sources/buildDescription.xml"] = build_description(exported, built).encode("utf-8")
    if compiler() is not None:
        folder, ending = platform_of(version)
        files[f"binaries/{folder}/{name}{ending}"] = _binary(sources, built, ending)
    return _zipped(files)


def _binary(sources: dict[str, bytes], built: list[str], ending: str) -> bytes:
    """The shared library of sources."""
    with tempfile.TemporaryDirectory(prefix="linid_fmu_") as folder:
        for path, content in sources.items():
            (Path(folder) / path).write_bytes(content)
        command = [str(compiler()), "-std=c99", "-O2", "-shared", "-fvisibility=hidden"]
        command += [] if ending == ".dll" else ["-fPIC"]
        done = subprocess.run(
            [*command, "-o", f"unit{ending}", *built, "-lm"], cwd=folder, capture_output=True, text=True, check=False
        )
        if done.returncode:
            words = done.stderr.strip().splitlines() or ["without a word"]
            raise UsageError("the C compiler", f"refuses the sources: {words[0]}", "Take --to c, and report it.")
        return (Path(folder) / f"unit{ending}").read_bytes()


def _zipped(files: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(files):
            archive.writestr(zipfile.ZipInfo(path, _DATE), files[path], zipfile.ZIP_DEFLATED)
    return stream.getvalue()
