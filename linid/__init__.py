"""Identification and diagnosis of linear-motor axes from the servo drive's scope recordings."""

import os

if "LINID_CACHE_DIR" in os.environ:  # numba reads this when it is first imported
    os.environ.setdefault("NUMBA_CACHE_DIR", os.path.join(os.environ["LINID_CACHE_DIR"], "numba"))
