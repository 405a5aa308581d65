"""Unmodelled effects that can be switched on: one file each, listed in `registry`."""
