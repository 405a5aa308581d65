"""Where simulation and machine differ, which effect explains it, and how far that goes."""
