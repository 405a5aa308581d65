"""What base and columns leave is what least squares with the base's prior leaves."""

from __future__ import annotations

import numpy as np
import pytest

from linid.diagnosis.proposed.leftover import Leftover
from tests.diagnosis.proposed.axis import axis


def test_what_is_left_is_that_of_least_squares() -> None:
    problem = axis(lambda p: np.sin(12.0 * p.rows.y))
    columns = np.stack([np.cos(9.0 * problem.rows.y), problem.rows.v**3], axis=1)
    mine = ~problem.held
    prior = np.hstack([np.diag(problem.ridge), np.zeros((problem.ridge.size, 2))])
    matrix = np.vstack([np.hstack([problem.base, columns * problem.weights[:, None]])[mine], prior])
    rest = np.concatenate([problem.rest[mine], np.zeros(problem.ridge.size)])
    wanted = rest - matrix @ np.linalg.lstsq(matrix, rest, rcond=None)[0]
    leftover = Leftover(problem)
    assert leftover.beside(columns) == pytest.approx(wanted, abs=1e-6 * float(np.abs(wanted).max()))
    assert leftover.of_rows(columns)[mine] == pytest.approx(wanted[: int(mine.sum())], abs=1e-5)
    assert np.all(leftover.of_rows(columns)[~mine] == 0.0)


def test_columns_alike_leave_what_one_of_them_leaves() -> None:
    problem = axis(lambda p: np.sin(12.0 * p.rows.y))
    one = np.cos(9.0 * problem.rows.y)[:, None]
    leftover = Leftover(problem)
    assert leftover.beside(np.hstack([one, one])) == pytest.approx(leftover.beside(one), abs=1e-6)
