"""Answers of block pivoting in numpy, without the run around it."""

import numpy as np

from lcpcli.methods.direct import exchanges, without_doubtful_terms
from lcpcli.solving.direct_run import exhausted
from lcpcli.verify.final_states import may_hide_term


@np.errstate(all="ignore")
def direct(problem, tol):
    answer = exhausted(exchanges(problem, tol))
    if answer is None or not may_hide_term(problem, answer.z):
        return answer
    return without_doubtful_terms(problem, answer)
