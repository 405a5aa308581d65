"""Ratios and products that are known better than their parameters."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from linid.diagnosis.combinations import effect_combinations


@pytest.mark.parametrize("order", [("end_loss_low", "end_loss_high"), ("end_loss_high", "end_loss_low")])
def test_a_ratio_is_told_once_and_in_the_order_of_the_parameters(order: tuple[str, str]) -> None:
    """Each of two losses is known to half of it, their ratio to 2 %: not told the other way round as well."""
    values = {"end_loss_low": 0.6, "end_loss_high": 0.3, "mass": 2.0}
    result = SimpleNamespace(
        estimates=[SimpleNamespace(name=name, value=x, std=0.5 * x) for name, x in values.items()],
        fitted=(*order, "mass"),
        correlation=np.array([[1.0, 0.9992, 0.0], [0.9992, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    )
    (line,) = effect_combinations(result, "end_effect")
    ratio = values[order[0]] / values[order[1]]
    half = 1.96 * ratio * 0.5 * np.sqrt(2.0 * (1.0 - 0.9992))
    first, second = (name.replace("_", " ") for name in order)
    assert line.startswith(f"{first} / {second} = {ratio:.4g} [{ratio - half:.4g}, {ratio + half:.4g}]")
