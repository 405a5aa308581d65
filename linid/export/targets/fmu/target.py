"""The target `fmu`: the whole model for co-simulation, of FMI 2.0 and of FMI 3.0."""

from __future__ import annotations

from linid.export.target import Exported, Target


def _files(exported: Exported) -> dict[str, bytes]:
    from linid.export.targets.fmu.unit import unit

    return {f"{exported.name}_fmi{version}.fmu": unit(exported, version) for version in (2, 3)}


TARGET = Target(
    name="fmu",
    purpose="FMI 2.0 and 3.0 for co-simulation: C sources, and this platform's binary where there is a compiler.",
    files=_files,
)
