"""Compiled core of the hidden plant: fine-step Runge-Kutta integration of the axis, its drive and its hidden effects.

Written apart from `linid.simulation` and from the effect library: the functional forms differ on purpose, so that
naming an effect needs its physics and not its formula. Only how functions are compiled and kept is shared.
"""
