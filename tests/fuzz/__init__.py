"""A standing fuzz over readers, YAML, models and search states: `python -m tests.fuzz --minutes 10`."""
