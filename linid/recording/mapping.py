"""ChannelMapping: which column is which channel, in which unit (the `channels:` section of a campaign)."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat

from linid.errors import ConfigError
from linid.recording.recording import BetweenSamples
from linid.recording.units import find_unit

Role = Literal[
    "time",
    "position",
    "velocity",
    "reference",
    "simulated",
    "current_u",
    "current_v",
    "current_w",
    "voltage_u",
    "voltage_v",
    "voltage_w",
    "current_q",
    "command",
]
ROLES: tuple[Role, ...] = get_args(Role)
PHASES: tuple[Role, ...] = ("current_u", "current_v", "current_w")
VOLTAGES: tuple[Role, ...] = ("voltage_u", "voltage_v", "voltage_w")
INPUTS: tuple[Role, ...] = (*PHASES, *VOLTAGES, "current_q", "command")


class ChannelSpec(BaseModel):
    """One channel: value = (raw * scale + offset) in `unit`; with unit `counts`, scale is SI units per count.

    column: the header's name (with or without its unit), `#3` for the third column, or a variable of a file that holds
    arrays (of a matrix, cell array or struct: `data[2]`, `data.position`).
    scale, offset: numbers; for .mat files also the name of a scalar variable.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, coerce_numbers_to_str=True)

    column: str = Field(min_length=1)
    unit: str | None = None
    scale: FiniteFloat | str = 1.0
    offset: FiniteFloat | str = 0.0


class Quantity(BaseModel):
    """A number with its unit, such as `{value: 1, unit: ms}`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    value: float = Field(gt=0, allow_inf_nan=False)
    unit: str = "s"


def _spec(value: Any) -> Any:
    return {"column": value} if isinstance(value, str | int) and not isinstance(value, bool) else value


def _quantity(value: Any) -> Any:
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([^\s\d]+)?\s*", value)
        return {"value": match[1], "unit": match[2] or "s"} if match else value
    return {"value": value} if isinstance(value, int | float) and not isinstance(value, bool) else value


def _separator(value: Any) -> Any:
    names = {"tab": "\t", "\\t": "\t", "space": " ", "comma": ",", "semicolon": ";", "colon": ":", "bar": "|"}
    return names.get(value, value) if isinstance(value, str) else value


Spec = Annotated[ChannelSpec | None, BeforeValidator(_spec)]


class ChannelMapping(BaseModel):
    """Columns, units and dialect of a scope export; whatever is left out is found by name and by sniffing.

    period: sampling period where no time column exists (number in s, `1 ms`, or {value, unit}).
    time_group: number (from 1) of the time-column group that holds the position.
    reference: the commanded position, and simulated: that of a simulation by the same inputs; both are read only where
    the mapping names them.
    unmeasured: whether a file of phase voltages may lack the position, which then is nan, for simulations alone.
    between_samples: whether the inputs run smoothly between the samples (`spline`), straight (`linear`) or are held
    (`hold`); detected, they run smoothly but for jumps. jump_at: the share of a sampling interval, 0 to 1, at which an
    input jumps; the motion tells it otherwise, and a held one jumps at 1, with the next sample.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    time: Spec = None
    position: Spec = None
    velocity: Spec = None
    reference: Spec = None
    simulated: Spec = None
    current_u: Spec = None
    current_v: Spec = None
    current_w: Spec = None
    voltage_u: Spec = None
    voltage_v: Spec = None
    voltage_w: Spec = None
    current_q: Spec = None
    command: Spec = None
    period: Annotated[Quantity | None, BeforeValidator(_quantity)] = None
    layout: str | None = None  # the name of a reader
    decimal: Literal[".", ","] | None = None
    separator: Annotated[Literal[";", "\t", ",", " ", ":", "|"] | None, BeforeValidator(_separator)] = None
    encoding: str | None = None
    time_group: int | None = Field(default=None, ge=1)
    unmeasured: bool = False
    between_samples: BetweenSamples = "detected"
    jump_at: float | None = Field(default=None, ge=0, le=1)

    def spec(self, role: Role) -> ChannelSpec | None:
        """The mapping of one channel, or None."""
        found: ChannelSpec | None = getattr(self, role)
        return found

    @property
    def period_s(self) -> float | None:
        """The given sampling period in s, or None; raises ConfigError when its unit is not a time."""
        if self.period is None:
            return None
        unit = find_unit(self.period.unit)
        if unit is None or unit.dimension != "time":
            raise ConfigError(
                "channels.period", f"unit '{self.period.unit}' is not a time", "Use s, ms or us, such as '1 ms'."
            )
        return self.period.value * unit.factor

    def over(self, base: ChannelMapping | None) -> ChannelMapping:
        """This mapping with everything it leaves out taken from `base`."""
        if base is None:
            return self
        return base.model_copy(update={name: getattr(self, name) for name in self.model_fields_set})
