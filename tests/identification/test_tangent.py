"""Long residuals and their Jacobian in few rows: lengths and products are kept, whatever the blocks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linid.identification.optimise import tangent as tangents
from linid.identification.optimise.tangent import Block, Tangent, finite


def drawn(generator: np.random.Generator, rows: int, columns: int, width: int, scales: np.ndarray) -> Block:
    """A block with some of the columns; scales: of each one's slopes."""
    chosen = np.sort(generator.permutation(width)[:columns])
    slopes = generator.standard_normal((rows, columns)) * scales[chosen]
    weights = 10.0 ** generator.uniform(-1.0, 1.0, rows)
    return Block(generator.standard_normal(rows), slopes, weights, chosen)


@given(
    st.lists(st.integers(1, 9_000), min_size=1, max_size=4),
    st.integers(1, 20),
    st.integers(0, 2**32 - 1),
    st.booleans(),
)
@settings(max_examples=30, deadline=None)
def test_few_rows_say_what_the_long_ones_do(sizes: list[int], width: int, seed: int, without: bool) -> None:
    """With the same bits in two threads; by numpy's decomposition too."""
    generator = np.random.default_rng(seed)
    scales = 10.0 ** generator.uniform(-3, 6, width)
    blocks = tuple(drawn(generator, n, int(generator.integers(1, width + 1)), width, scales) for n in sizes)
    with pytest.MonkeyPatch.context() as patch:
        if without:
            patch.setattr(tangents, "_decomposition", lambda: None)
        few, turned = Tangent(blocks, width).rotated
        two = Tangent(blocks, width, 2).rotated
    assert np.array_equal(few, two[0]) and np.array_equal(turned, two[1])
    base, slopes = Tangent(blocks, width).dense
    assert base.shape == (sum(sizes),) and slopes.shape == (sum(sizes), width)
    long, short = np.column_stack([base, slopes]), np.column_stack([few, turned])
    lengths = np.maximum(np.linalg.norm(long, axis=0), 1e-300)
    assert np.allclose((short / lengths).T @ (short / lengths), (long / lengths).T @ (long / lengths), atol=1e-12)
    assert abs(abs(few[0]) - np.linalg.norm(base)) < 1e-12 * np.linalg.norm(base) and np.all(few[1:] == 0.0)
    rows = generator.standard_normal(sum(sizes))
    expected = rows @ slopes
    assert np.allclose(Tangent(blocks, width).pulled(rows) / lengths[1:], expected / lengths[1:], atol=1e-12)


def test_blocks_are_rows_of_their_columns_alone() -> None:
    first = Block(np.array([1.0, 2.0]), np.array([[3.0], [4.0]]), np.array([1.0, 10.0]), np.array([1]))
    second = Block(np.array([5.0]), np.array([[6.0, 7.0]]), np.array([0.5]), np.array([0, 2]))
    base, slopes = Tangent((first, second), 3).dense
    assert base.tolist() == [1.0, 2.0, 5.0]
    assert slopes.tolist() == [[0.0, 3.0, 0.0], [0.0, 40.0, 0.0], [3.0, 0.0, 3.5]]


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e200])
def test_slopes_beyond_all_measure_tell_nothing(wrong: float) -> None:
    """And all others what they did."""
    generator = np.random.default_rng(3)
    block = drawn(generator, 500, 4, 4, np.ones(4))
    slopes = block.slopes.copy()
    slopes[17, 2] = wrong
    mended = slopes.copy()
    mended[17, 2] = 0.0
    one = Tangent((Block(block.residuals, slopes, block.weights, block.columns),), 4)
    other = Tangent((Block(block.residuals, mended, block.weights, block.columns),), 4)
    for found, expected in ((one.rotated, other.rotated), (one.dense, other.dense)):
        assert all(np.array_equal(a, b) for a, b in zip(found, expected, strict=True))
    rows = generator.standard_normal(500)
    assert np.array_equal(one.pulled(rows), other.pulled(rows))


def test_a_column_that_tells_next_to_nothing_is_none() -> None:
    block = drawn(np.random.default_rng(4), 300, 3, 3, np.array([1.0, 1e-10, 1.0]))
    one = Tangent((block,), 3)
    assert np.all(one.rotated[1][:, 1] == 0.0) and np.all(one.dense[1][:, 1] == 0.0)
    assert one.pulled(np.ones(300))[1] == 0.0 and np.all(one.rotated[1].any(axis=0) == [True, False, True])


def test_what_a_failed_simulation_leaves_is_large() -> None:
    assert finite(np.array([1.0, np.nan, np.inf, -np.inf])).tolist() == [1.0, 1e3, 1e3, -1e3]
