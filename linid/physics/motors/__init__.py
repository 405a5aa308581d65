"""Motors: what drives the axis, each in one file."""
