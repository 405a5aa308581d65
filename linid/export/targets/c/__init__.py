"""The target `c`, and the core of the FMU."""
