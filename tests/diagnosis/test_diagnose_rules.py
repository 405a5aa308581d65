"""Rules of the diagnosis that no single stage knows."""

from __future__ import annotations

import math

from linid.diagnosis.diagnose import worse_throughout
from linid.diagnosis.report_data import Change


def test_effects_with_which_every_measure_rises_are_none() -> None:
    """One that falls, or is not known of either model, lets them stand."""
    worse, better = Change(1.0, 1.2, 0.1), Change(1.0, 0.7, 0.1)
    assert worse_throughout({"free_run": worse, "ahead": worse, "force": worse})
    assert not worse_throughout({"free_run": worse, "ahead": better, "force": worse})
    assert not worse_throughout({"free_run": Change(math.nan, math.nan, 0.1), "ahead": worse, "force": worse})
    assert not worse_throughout({name: Change(1.0, 1.0, 0.1) for name in ("free_run", "ahead", "force")})
