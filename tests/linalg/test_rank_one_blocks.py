"""Blocks of rank one: what is left, U and D make the matrix, and systems with them have
the solutions of the matrix."""

from importlib.util import find_spec

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import block_array, csr_array, diags_array

from lcpcli.linalg.rank_one_blocks import rank_one_blocks
from lcpcli.linalg.shifted_systems import LDL

SIZES = 3, 1, 20, 30, 40
ROWS = 10


def with_blocks(seed, others=0, changes=None):
    """A matrix of a program with blocks of rank one of several sizes, permuted, and so
    many other entries; and its signs. changes : of entries, by their places."""
    random = default_rng(seed)
    n = sum(SIZES)
    Q = np.zeros((n, n))
    end = 0
    for size in SIZES:
        start, end = end, end + size
        u = random.uniform(0.5, 2.0, size)
        Q[start:end, start:end] = random.uniform(0.5, 2.0) * np.outer(u, u)
    for i, j in random.integers(n, size=(others, 2)):
        Q[i, j] = Q[j, i] = random.normal()
    for (i, j), change in (changes or {}).items():
        Q[i, j] += change
        Q[j, i] += change
    A = csr_array(random.normal(size=(ROWS, n)) * (random.random((ROWS, n)) < 0.1))
    M = block_array([[csr_array(Q), -A.T], [A, None]], format="csr")
    order = random.permutation(n + ROWS)
    signs = np.repeat([1.0, -1.0], [n, ROWS])[order]
    permuted = csr_array(M[order][:, order])
    permuted.sort_indices()
    return permuted, signs


@pytest.mark.parametrize("seed", range(3))
# Within the block of 20, or beside it.
@pytest.mark.parametrize("changes", [{}, {(4, 5): 1e-12}, {(4, 0): 1.0}])
def test_rest_and_blocks_make_the_matrix_with_far_fewer_entries(seed, changes):
    """Also where an entry makes a block none."""
    M, signs = with_blocks(seed, changes=changes)
    blocks = rank_one_blocks(M, signs)
    made = blocks.rest + blocks.U @ diags_array(blocks.D) @ blocks.U.T
    assert abs(made - M).max() <= 1e-14 * abs(M).max()
    assert blocks.rest.nnz + 2 * blocks.U.nnz + blocks.D.size < M.nnz / 2
    assert (blocks.D > 0).all()
    assert np.diff(blocks.U.indptr).max() == 1


@pytest.mark.parametrize("others", [200, 800])
def test_no_blocks_are_returned_where_little_is_saved(others):
    assert rank_one_blocks(*with_blocks(1, others)) is None


@pytest.mark.skipif(find_spec("qdldl") is None, reason="qdldl is not installed")
@pytest.mark.parametrize("seed", range(3))
def test_systems_with_blocks_have_the_solutions_of_the_matrix(seed):
    M, signs = with_blocks(seed)
    random = default_rng(seed)
    shifted, systems = M.toarray(), LDL(M, signs)
    for _ in range(3):  # the pattern is analysed at the first one
        d, b = random.uniform(0.1, 1.0, signs.size), random.normal(size=signs.size)
        systems.factorize(d)
        expected = np.linalg.solve(shifted + np.diag(d), b)
        assert np.abs(systems.solve(b) - expected).max() <= 1e-9
