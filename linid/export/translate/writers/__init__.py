"""Writers of the small tree: one language, one file."""
