"""The page of a run: one HTML file with its plots inside."""
