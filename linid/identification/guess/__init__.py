"""First values of all parameters, by regressions along the measured motion."""
