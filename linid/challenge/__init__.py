"""Proving the diagnosis: campaigns of a hidden plant with withheld effects, sealed keys, and scoring."""
