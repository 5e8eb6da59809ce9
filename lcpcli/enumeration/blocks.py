"""Blocks of a problem that do not depend on each other: its solutions are all combinations of theirs."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from lcpcli.model.problem import Problem
from lcpcli.rational.graphs import connected
from lcpcli.rational.problem import ExactProblem


def blocks(data: ExactProblem) -> list[list[int]]:
    """The unknowns of each block, for M block diagonal after a permutation: connected components of its pattern."""
    return connected(data.n, ((i, j) for i, row in enumerate(data.rows) for j in row))


def restricted(data: ExactProblem, indices: Sequence[int]) -> ExactProblem:
    """The problem of one block."""
    place = {i: k for k, i in enumerate(indices)}
    rows = [{place[j]: Fraction(a, data.scales[i]) for j, a in data.rows[i].items()} for i in indices]
    q = [Fraction(data.constants[i], data.scales[i]) for i in indices]
    whole = data.problem
    lower, upper = (np.broadcast_to(bound, whole.n)[indices] for bound in (whole.lower, whole.upper))
    part = Problem(whole.M[indices][:, indices], whole.q[indices], lower=lower, upper=upper)
    return ExactProblem(part, rows, q, [data.lower[i] for i in indices], [data.upper[i] for i in indices])
