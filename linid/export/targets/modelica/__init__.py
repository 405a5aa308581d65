"""The target `modelica`."""
