"""What the MPS format cannot say, or says twice, is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from lcpcli import from_qp, read, write
from lcpcli.errors import ProblemError

TWICE = "ROWS\n N obj\nCOLUMNS\n x obj 1\n y obj 1\nQUADOBJ\n x x 2\n x y 1\n y x 5\n y y 2\nENDATA\n"


def test_an_entry_of_a_symmetric_Q_that_is_given_on_both_sides_is_refused(tmp_path: Path) -> None:
    (tmp_path / "p.mps").write_text(TWICE)
    with pytest.raises(ProblemError, match="line 9: gives 'y' a second entry in 'x'; keep one"):
        read(tmp_path / "p.mps")


def test_a_bound_that_means_none_in_MPS_is_not_written(tmp_path: Path) -> None:
    problem = from_qp(None, [1.0], lower=[0.0], upper=[1e20])
    with pytest.raises(ProblemError, match=r"has a bound of 1e\+20 or more"):
        write(problem, tmp_path / "p.mps")
