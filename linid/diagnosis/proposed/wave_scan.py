"""What waves of wavenumbers side by side would take of what is left, compiled."""

from __future__ import annotations

import math

import numpy as np

from linid.arrays import Array, Integers
from linid.kernel_cache import kept as kept_on_disk


@kept_on_disk(error_model="numpy", nogil=True)
def waves_beside(x: Array, spread: Array, factor: Array, middle: float, step: float, many: int) -> Array:
    """Cosine and sine times a factor, (2 many + 1, n, 2), of wavenumbers in equal steps about a middle one, rad per
    unit of x (n,), as rows see them that are means of what passes.

    spread: (n,) in the same unit, deviation of what a row is the mean of; factor: (n,).
    """
    out = np.empty((2 * many + 1, x.size, 2))
    for n in range(x.size):
        turn_cos, turn_sin = math.cos(step * x[n]), math.sin(step * x[n])
        first_cos, first_sin = math.cos(middle * x[n]), math.sin(middle * x[n])
        for way in (-1, 1):
            c, s = first_cos, first_sin
            for m in range(many + 1):
                seen = factor[n]
                if spread[n] != 0.0:
                    seen *= math.exp(-0.5 * (spread[n] * (middle + way * m * step)) ** 2)
                out[many + way * m, n, 0], out[many + way * m, n, 1] = seen * c, seen * s
                c, s = c * turn_cos - way * s * turn_sin, s * turn_cos + way * c * turn_sin
    return out


@kept_on_disk(error_model="numpy", nogil=True)
def normal_equations(
    pair: Array, owner: Integers, count: int, place: Integers, kept: Array, scale: Array, rest: Array
) -> tuple[Array, Array]:
    """Normal equations (K, K) and moments (K,) of two columns, apart in each of `count` classes: K = 2 count.

    pair: (n, 2) forces in N, or what they give the rows; owner: (n,) class of each row, 0 ... count - 1; place, kept:
    (n,) as in `pushed_rows`; scale: (n,) of a row, 0 where it does not count; rest: (n,) of what is left, scaled.
    """
    normal, moment = np.zeros((2 * count, 2 * count)), np.zeros(2 * count)
    for n in range(scale.size):
        if scale[n] == 0.0:
            continue
        here, there = 2 * owner[n], 2 * owner[place[n]]
        cos, sin = scale[n] * pair[n, 0], scale[n] * pair[n, 1]
        held = scale[n] * kept[n]
        cos_held, sin_held = -held * pair[place[n], 0], -held * pair[place[n], 1]
        if here == there:
            cos, sin, cos_held, sin_held = cos + cos_held, sin + sin_held, 0.0, 0.0
        normal[here, here] += cos * cos
        normal[here, here + 1] += cos * sin
        normal[here + 1, here + 1] += sin * sin
        moment[here] += cos * rest[n]
        moment[here + 1] += sin * rest[n]
        if cos_held != 0.0 or sin_held != 0.0:
            normal[there, there] += cos_held * cos_held
            normal[there, there + 1] += cos_held * sin_held
            normal[there + 1, there + 1] += sin_held * sin_held
            moment[there] += cos_held * rest[n]
            moment[there + 1] += sin_held * rest[n]
            for a, mine in ((0, cos), (1, sin)):
                for b, other in ((0, cos_held), (1, sin_held)):
                    # The upper triangle alone is told.
                    normal[min(here + a, there + b), max(here + a, there + b)] += mine * other
    for a in range(2 * count):
        for b in range(a):
            normal[a, b] = normal[b, a]
    return normal, moment
