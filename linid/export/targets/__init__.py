"""The targets of `linid export`, one file or folder each."""
