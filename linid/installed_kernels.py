"""Kernels that were compiled when linid was installed, for the processor that it was installed on.

With kernels of other formulas, or on another processor, everything is compiled as if there were none.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

SWITCH = "LINID_INSTALLED_KERNELS"  # "0": neither made nor used
_FOLDER = Path(__file__).with_name("kernels")
PROCESSOR_FILE = "processor.txt"


def installed_folder(codegen: Any) -> Path | None:
    """Where the kernels of the installation are; None where there are none that this processor runs.

    codegen: numba's, which knows the processor. LINID_INSTALLED_KERNELS=0 leaves them aside.
    """
    try:
        made_for = (_FOLDER / PROCESSOR_FILE).read_text(encoding="utf-8")
    except OSError:
        return None
    return _FOLDER if made_for == processor_of(codegen) and os.environ.get(SWITCH) != "0" else None


def processor_of(codegen: Any) -> str:
    """The processor that numba compiles for, in words that are the same where its machine code runs."""
    return repr(codegen.magic_tuple())
