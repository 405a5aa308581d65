"""Fits: what recordings show, first values, search spaces, objectives, search and least squares, intervals."""
