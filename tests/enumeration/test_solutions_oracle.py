"""All solutions of random small problems, many of them with whole faces of solutions, against an exact oracle.

LCP_ORACLE=3000 in the environment sets the number of problems with up to 5 unknowns; here it is fewer, with up to 4.
"""

from __future__ import annotations

import os

import numpy as np

import lcpcli

from . import solution_sets as oracle

COUNT = int(os.environ.get("LCP_ORACLE", "250"))
SIX = COUNT // 25  # problems with 6 unknowns
MOST = 5 if "LCP_ORACLE" in os.environ else 4


def agrees(M: np.ndarray, q: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> list[oracle.Hull]:
    """The pieces of a problem, each once, which are those of the oracle."""
    found = lcpcli.solutions(lcpcli.Problem(M, q, lower=lower, upper=upper))
    pieces = [oracle.canonical(piece.vertices, piece.rays, piece.lines) for piece in found]
    assert found.complete
    assert len(set(pieces)) == len(pieces)
    assert set(pieces) == oracle.maximal(oracle.in_fractions(M, q, lower, upper)), (M, q, lower, upper)
    return pieces


def test_the_pieces_are_the_maximal_polyhedra_of_all_choices_of_states() -> None:
    generator = np.random.default_rng(17)
    sets = [agrees(*oracle.random_problem(generator, MOST)) for _ in range(COUNT)]
    assert sum(not pieces for pieces in sets) > 0.05 * COUNT
    assert sum(len(pieces) > 1 for pieces in sets) > 0.1 * COUNT
    assert sum(any(len(hull.vertices) > 1 for hull in pieces) for pieces in sets) > 0.05 * COUNT
    assert sum(any(hull.rays for hull in pieces) for pieces in sets) > 0.2 * COUNT
    assert sum(any(hull.lines for hull in pieces) for pieces in sets) > 0.02 * COUNT


def test_six_unknowns() -> None:
    generator = np.random.default_rng(23)
    sets = [agrees(*oracle.random_problem(generator, 6, 6)) for _ in range(SIX)]
    assert sum(len(pieces) > 1 for pieces in sets) > 0.1 * SIX


def test_unknowns_between_two_bounds() -> None:
    """Of each w_i one sign is asked for at one bound and the other one at the other: nothing that is chosen for one
    branch of the tree holds in another one."""
    generator, count = np.random.default_rng(5), COUNT // 5
    sets = []
    for _ in range(count):
        n = int(generator.integers(2, 5))
        M, q = generator.integers(-2, 3, (n, n)).astype(float), generator.integers(-2, 3, n).astype(float)
        lower = generator.integers(-1, 1, n).astype(float)
        sets.append(agrees(M, q, lower, lower + generator.integers(1, 3, n)))
    assert min(map(len, sets)) > 0
    assert sum(len(pieces) > 1 for pieces in sets) > 0.2 * count
