"""What pyproject.toml cannot say: an installation compiles the kernels, so that no command waits for the compiler.

LINID_INSTALLED_KERNELS=0 leaves that to the first commands, and makes a wheel for any machine.
"""

import os
import subprocess
import sys
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py

SWITCH = "LINID_INSTALLED_KERNELS"
COMPILES = os.environ.get(SWITCH) != "0"


class BuildWithKernels(build_py):
    """Python files, and beside them the kernels as machine code."""

    def run(self) -> None:
        super().run()
        if COMPILES:
            root = Path.cwd() if self.editable_mode else Path(self.build_lib).resolve()
            self.compile_kernels(root, root / "linid" / "kernels")

    def compile_kernels(self, root: Path, folder: Path) -> None:
        """Compile the package in `root`; where that fails, an installation without kernels is complete, too."""
        self.announce(f"compiling the simulation for this processor into {folder}", level=2)
        environment = {**os.environ, "LINID_CACHE_DIR": str(folder), SWITCH: "0", "PYTHONDONTWRITEBYTECODE": "1"}
        code = "from linid.simulation.compile_ahead import install; install()"
        path = f"import sys; sys.path[:] = {[str(root), *sys.path]!r}"
        if subprocess.run([sys.executable, "-P", "-c", f"{path}; {code}"], env=environment, check=False).returncode:
            self.warn("the simulation could not be compiled; the commands that need it will")


class PlatformDistribution(Distribution):
    """Machine code is for one kind of machine; so is the wheel, then."""

    def has_ext_modules(self) -> bool:
        return COMPILES or super().has_ext_modules()


setup(cmdclass={"build_py": BuildWithKernels}, distclass=PlatformDistribution)
