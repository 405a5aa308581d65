"""The cascade of a servo drive as people describe it: position P, velocity PI, current limit."""

from __future__ import annotations

from pathlib import Path

from linid.physics.described import Description, NotNegative, Positive


class Controller(Description):
    """A drive's loops as TwinCAT and its like have them; all in SI, currents as the amplitude of a phase (q-current).

    position_gain_per_s: Kv; velocity_gain_a_s_per_m: Kp; velocity_integral_time_s: Tn (None: no integral part);
    velocity_feedforward: share of the reference's speed that is added; current_limit_a: of the command;
    current_time_constant_s: of the closed current loop (0: it follows at once); cycle_time_s: of all loops.
    On rotary axes m stands for rad.
    """

    position_gain_per_s: NotNegative = 60.0
    velocity_gain_a_s_per_m: NotNegative = 5.0
    velocity_integral_time_s: Positive | None = 0.0133
    velocity_feedforward: NotNegative = 1.0
    current_limit_a: Positive = 4.0
    current_time_constant_s: NotNegative = 3.0e-4
    cycle_time_s: Positive = 1.25e-4

    @property
    def integral_gain(self) -> float:
        """Gain of the velocity loop's integral, in A/m."""
        time = self.velocity_integral_time_s
        return 0.0 if time is None else self.velocity_gain_a_s_per_m / time


def load_controller(path: str | Path) -> Controller:
    """Read a controller from a YAML file.

    path: file like configs/controller.yaml. Raises ConfigError, with the line, when it is unreadable or not valid.
    """
    from linid.config import load_yaml_model

    return load_yaml_model(path, Controller)
