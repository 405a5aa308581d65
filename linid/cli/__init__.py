"""The command line: options in, outcomes and exit codes out."""
