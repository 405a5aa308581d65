"""What fits minimise: residuals of free runs, of predictions ahead, of accelerations and of winding currents."""
