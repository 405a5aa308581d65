"""What a fit does not know: covariances, intervals, profiles, and what the data cannot tell apart."""
