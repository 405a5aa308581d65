"""Identification and diagnosis of linear-motor axes from the servo drive's scope recordings."""

import os

if _cache := os.environ.get("LINID_CACHE_DIR"):  # numba reads this when it is first imported
    os.environ.setdefault("NUMBA_CACHE_DIR", os.path.join(_cache, "numba"))
