"""A model as a program: its memory, what is called from outside, and the simulation's functions made for it alone."""
