"""The factorization that every step of `interior` repeats: its fill and its time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lcpcli import clock
from lcpcli.diagnosis.matrix import nonzeros
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.patterns import affordable, fill
from lcpcli.linalg.shifted_systems import DECIDED, sparse_systems
from lcpcli.methods.interior_scaling import Scaled, scaled
from lcpcli.methods.interior_steps import Regularization
from lcpcli.model.problem import Problem

MOST = 5_000_000  # entries of L that are affordable where a band is not


@dataclass(frozen=True)
class Factorization:
    """That of M + D for a positive diagonal D and sparse M, without rows and columns of fixed variables.

    nonzeros : of M. factor_nonzeros : of L and D, or of L and U; a unit diagonal does not count.
    library : the faster one, SuperLU or QDLDL.
    first, repeated : seconds with and without the search for an order of the pivots.
    note : what kept it from being complete; "" if nothing did.
    """

    nonzeros: int
    library: str | None = None
    factor_nonzeros: int | None = None
    first: float | None = None
    repeated: float | None = None
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """The nonzeros of the factors relative to those of M."""
        return self.factor_nonzeros / self.nonzeros if self.factor_nonzeros and self.nonzeros else None


def factorization(problem: Problem, seconds: float) -> Factorization | None:
    """What is known of it after so many seconds; None for dense M, whose factors are no larger."""
    if not is_sparse(problem.M):
        return None
    if not np.less(problem.lower, problem.upper).any():
        return Factorization(0, note="not needed: all variables are fixed")
    own = scaled(problem)
    found = [Factorization(nonzeros(own.M))]
    try:
        with within(seconds):
            note = _measure(own, found)
    except TimeIsUp:
        note = f"stopped after {seconds:g} s"
    except SingularMatrix:
        note = "failed: there are no factors with pivots on the diagonal"
    except MemoryError:
        note = "failed: not enough memory"
    return replace(found[-1], note=note)


def _measure(own: Scaled, found: list[Factorization]) -> str:
    """Append what is known after each factorization until it is decided which library is faster; the note, if any."""
    if not affordable(own.M) and fill(own.M, MOST) > MOST:
        return f"not tried: its factors may have more than {MOST:.0e} entries"
    D = np.zeros(own.kept.size)
    D[own.low] = D[own.high] = 1.0  # as in the first step
    systems = sparse_systems(own.M, own.S)
    first = least = np.inf
    for k in range(2 if own.S is None else DECIDED):
        began = clock.seconds()
        systems.factorize(D + Regularization.rho)
        seconds = clock.seconds() - began
        if k == 0:
            first = seconds
        elif seconds < least:
            least = seconds
        else:
            continue
        known = replace(found[0], library=systems.library, factor_nonzeros=systems.nonzeros, first=first)
        found.append(replace(known, repeated=least if k else None))
    return ""
