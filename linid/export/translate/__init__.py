"""From the simulation's own functions to other languages: what is known of a model is worked out, the rest is written.

`specialise.py` runs a function on what is known (which motor, effects and law, what they are called) and keeps as a
small tree (`tree.py`) what hangs on numbers that are known only at run time; `writers/` put such trees into words.
"""
