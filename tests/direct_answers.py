"""Answers of block pivoting in numpy, without the run around it."""

from __future__ import annotations

import numpy as np

from lcpcli import Problem
from lcpcli.methods.direct import DirectAnswer, beyond_doubt, exchanges


@np.errstate(all="ignore")
def direct(problem: Problem, tol: float) -> DirectAnswer | None:
    steps = exchanges(problem, tol)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return None if end.value is None else beyond_doubt(problem, end.value)
