"""The unknown as a term: on what a missing force depends, and its curve."""
