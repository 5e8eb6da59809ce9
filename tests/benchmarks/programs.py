"""Convex programs from arrays in memory to the verified answer, beside PIQP for
quadratic and HiGHS for linear ones: programs.py FOLDER ...

Every program of the MPS files in the folders is passed as scipy's sparse matrices and
vectors, to `from_qp` and `run` with the extra `programs`, and to the set-up and the
solution by the other solver, to 1e-9. Prints the least of repeated wall times, in
turns, in milliseconds, their ratio, the unknowns, the route, and whether each claims a
solution; then the geometric means of the ratios. Rows are split into PIQP's equations
and inequalities within its time, as `from_qp` makes its conditions within ours.
"""

import sys
from pathlib import Path

import highspy
import numpy as np
import piqp
from measuring import in_turns, show
from scipy.sparse import csc_array, csr_array

import lcpcli
from lcpcli.model.problem import conditions_of

EPS = 1e-9
BUDGET, LEAST, MOST = 2.0, 3, 50  # seconds and repetitions of a program
WIDTHS = (12, 6, 9, 9, 7, 24, 8, 8)
HEADER = ("program", "n", "lcp ms", "peer ms", "ratio", "route", "solved", "peer")


class Piqp:
    """PIQP with a program."""

    def __init__(self, data):
        self._data = data

    def solve(self):
        data, solver = self._data, piqp.SparseSolver()
        equal, A = data.row_lower == data.row_upper, csr_array(data.A)
        rows = (
            {"A": csc_array(A[equal]), "b": data.row_lower[equal]}
            if equal.any()
            else {}
        )
        if not equal.all():
            rows |= {
                "G": csc_array(A[~equal]),
                "h_l": data.row_lower[~equal],
                "h_u": data.row_upper[~equal],
            }
        solver.settings.eps_abs = solver.settings.eps_rel = EPS
        solver.setup(
            P=csc_array(data.Q), c=data.c, **rows, x_l=data.lower, x_u=data.upper
        )
        return solver.solve() == piqp.PIQP_SOLVED


class Highs:
    """HiGHS with a linear program."""

    def __init__(self, data):
        self._data, self._columns = data, csc_array(data.A)

    def solve(self):
        solver = highspy.Highs()
        program = highspy.HighsLp()
        data = self._data
        A = self._columns
        for option, value in (
            ("output_flag", False),
            ("threads", 1),
            ("primal_feasibility_tolerance", EPS),
            ("dual_feasibility_tolerance", EPS),
        ):
            solver.setOptionValue(option, value)
        program.num_row_, program.num_col_ = A.shape
        program.col_cost_, program.col_lower_, program.col_upper_ = (
            data.c,
            data.lower,
            data.upper,
        )
        program.row_lower_, program.row_upper_ = data.row_lower, data.row_upper
        program.a_matrix_.format_ = highspy.MatrixFormat.kColwise
        program.a_matrix_.start_, program.a_matrix_.index_, program.a_matrix_.value_ = (
            A.indptr,
            A.indices,
            A.data,
        )
        solver.passModel(program)
        solver.run()
        return solver.getModelStatus() == highspy.HighsModelStatus.kOptimal


def row(path):
    """Print the row of a program; return the ratio of the times, and whether the
    program is linear."""
    problem = lcpcli.read(path)
    data = problem.origin.blocks(conditions_of(problem))
    Q, A = csc_array(data.Q), csc_array(data.A)
    is_linear = not Q.nnz
    peer = Highs(data) if is_linear else Piqp(data)
    ends = {
        "row_lower": data.row_lower,
        "row_upper": data.row_upper,
        "lower": data.lower,
        "upper": data.upper,
    }
    results = []
    solved = []

    def ours():
        made = lcpcli.from_qp(None if is_linear else Q, data.c, A, **ends)
        results.append(lcpcli.run(made))

    times = in_turns(
        ours, lambda: solved.append(peer.solve()), most=MOST, least=LEAST, budget=BUDGET
    )
    own, other = (1e3 * min(seconds) for seconds in times)
    route = ", ".join(results[-1].route)[:24]
    claims = ([each.solved for each in results], solved)
    numbers = (path.stem[:12], problem.n, own, other, own / other, route)
    show((*numbers, *("yes" if all(each) else "no" for each in claims)), WIDTHS)
    return own / other, is_linear


if __name__ == "__main__":
    show(HEADER, WIDTHS)
    paths = [
        path for folder in sys.argv[1:] for path in sorted(Path(folder).glob("*.mps"))
    ]
    ratios = [row(path) for path in paths]
    for name, linear in (
        ("quadratic programs beside PIQP", False),
        ("linear programs beside HiGHS", True),
    ):
        own = [ratio for ratio, is_linear in ratios if is_linear == linear]
        if own:
            print(
                f"{len(own)} {name}: geometric mean of the ratios "
                f"{np.exp(np.mean(np.log(own))):.2f}"
            )
