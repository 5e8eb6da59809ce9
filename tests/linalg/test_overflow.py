"""Numbers that overflow reach none of LAPACK's singular values, on which these might never end."""

from __future__ import annotations

import numpy as np
import pytest

from lcpcli import Problem, Status, run
from lcpcli.basis.bounded_form import combinations
from lcpcli.basis.tableau import begin, tableau_of
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.units import PseudoInverse


@np.errstate(all="ignore")
def test_a_matrix_whose_numbers_overflow_has_no_generalized_inverse() -> None:
    with pytest.raises(SingularMatrix):
        PseudoInverse(np.array([[-1e308, 5e-324], [1.0, 1.0]]))


@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_equations_that_overflow_are_not_combined(value: float) -> None:
    G = np.diag([1.0, value, 1.0])
    with pytest.raises(SingularMatrix):
        combinations(G, G)


def test_lemke_reports_free_variables_whose_elimination_overflows() -> None:
    result = run(Problem([[-1.0, 0.0], [5e-324, 1e200]], [-1.0, 5e-324], lower=-np.inf), "lemke")
    assert isinstance(result.status, Status)


@np.errstate(all="ignore")
@pytest.mark.parametrize("lexicographic", [False, True])
@pytest.mark.parametrize("k", [[-1.7e308, -1.0], [np.nan, -1.0]])
def test_lemke_has_a_first_pivot_where_ratios_overflow(k: list[float], lexicographic: bool) -> None:
    cover, d = np.array([0.5, 1.0]), np.full(2, np.inf)
    row, entering, _ = begin(tableau_of(np.eye(2), np.array(k), cover), d, cover, lexicographic)
    assert row in (0, 1)
    assert entering in (0, 1)
