"""Figures: one function each returns a matplotlib Figure that belongs to the caller; nothing touches pyplot."""
