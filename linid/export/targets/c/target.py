"""The target `c`: the model as C99 for controllers and simulators, without allocation."""

from __future__ import annotations

from linid.export.target import Exported, Target


def _files(exported: Exported) -> dict[str, bytes]:
    from linid.export.targets.c.core import c_files

    return c_files(exported)


TARGET = Target(
    name="c", purpose="C99 without allocation: header, source and test program of the whole model.", files=_files
)
