"""What own terms remember of a motion: distance and time since the last reversal, the last rest and the path since.

The axis turns where it has gone farthest before it moves back by more than PLAY: what the noise of a reading does is no
reversal. It rests while it stays within PLAY of one place, for LEAST_REST at least.
"""

from __future__ import annotations

import numpy as np

from linid.arrays import Array
from linid.physics.own_terms.layout import LEAST_REST, PLAY


def memory_along(t: Array, y: Array) -> dict[str, Array]:
    """`travel` and `slid` in m, `since_reversal` and `rest` in s along a motion, (n,) each by name, as simulations do.

    t: (n,) s; y: (n,) m. Source: linid's own form.
    """
    out = {name: np.zeros(t.size) for name in ("travel", "since_reversal", "rest", "slid")}
    times, places = t.tolist(), y.tolist()
    direction, turn, far, anchor, rest, slid = 0.0, places[0], places[0], places[0], 0.0, 0.0
    turned = far_at = anchored = times[0]
    for k in range(1, t.size):
        now, here = times[k], places[k]
        moved = here - far
        if direction == 0.0 and abs(moved) > PLAY:
            direction = 1.0 if moved > 0.0 else -1.0
        if direction * moved > 0.0:
            far, far_at = here, now
        elif direction * moved < -PLAY:
            direction, turn, turned = -direction, far, far_at
            far, far_at = here, now
        if abs(here - anchor) > PLAY:
            slid += abs(here - anchor)
            anchor, anchored = here, now
        elif now - anchored >= LEAST_REST:
            rest, slid = now - anchored, 0.0
        out["travel"][k], out["since_reversal"][k] = abs(here - turn), now - turned
        out["rest"][k], out["slid"][k] = rest, slid
    return out
