"""Friction laws: one law, one file, and the explicit list of all in `registry.py`."""
