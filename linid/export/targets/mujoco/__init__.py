"""MuJoCo: the axis as MJCF with `dcmotor` actuators, and a script that runs it."""

from linid.export.targets.mujoco.target import TARGET as TARGET
