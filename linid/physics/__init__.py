"""Friction, motors, windings, magnets and effects: the equations of motion, part by part, compiled."""
