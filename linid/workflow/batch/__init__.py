"""Many jobs of one file: in processes here, or on a cluster."""
