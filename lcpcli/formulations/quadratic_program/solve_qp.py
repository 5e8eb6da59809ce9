"""Programs solved in one call with the arguments of qpsolvers (S. Caron et al.,
qpsolvers: quadratic programming solvers in Python,
https://github.com/qpsolvers/qpsolvers), and lcp as a solver that qpsolvers can call.
"""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any

from lcpcli.clock import imports
from lcpcli.errors import EmptyIntervalError, OptionError, missing
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.formulations.quadratic_program.reductions import from_qpsolvers
from lcpcli.linalg.krylov import is_semidefinite
from lcpcli.solving.call import RunOptions, run
from lcpcli.solving.result import Result
from lcpcli.typing import BoundLike, Vector, VectorLike

if TYPE_CHECKING:
    from typing_extensions import Unpack


# Up to here, rational arithmetic decides whether Q is semidefinite in about the time of
# a solution, if floating-point numbers do not.
FEW_VARIABLES = 20


def solve_qp(
    P: Any,
    q: VectorLike,
    G: Any = None,
    h: VectorLike | None = None,
    A: Any = None,
    b: VectorLike | None = None,
    lb: BoundLike = None,
    ub: BoundLike = None,
    method: str = "auto",
    *,
    infinity: float = math.inf,
    **options: Unpack[RunOptions],
) -> Vector | None:
    """Return the x of shape (k,) that minimizes x'Px / 2 + q'x subject to Gx <= h, Ax =
    b and lb <= x <= ub; None if the run yields none, with a warning if it yields only a
    stationary point, because P is not positive semidefinite.

    The program and infinity are as in `from_qpsolvers`, the method and its options as
    in `run`. `run(from_qpsolvers(...)).answer` has the multipliers, the objective, the
    stationary point, or why there is no x. Raises LCPError, which names the argument at
    fault.

    >>> import lcpcli
    >>> P, q, G, h = [[2, 0], [0, 2]], [-3, 1], [[-1, -1]], [-1]
    >>> lcpcli.solve_qp(P, q, G, h, lb=[0, 0]).tolist()
    [1.5, 0.0]
    """
    problem = from_qpsolvers(P, q, G, h, A, b, lb, ub, infinity=infinity)
    return _minimizer(run(problem, method, **options))


def _minimizer(result: Result) -> Vector | None:
    """Return x if it is a minimizer; None if the result is not solved, or, with a
    warning for the caller of `solve_qp`, if x is only a stationary point.
    """
    if not result.solved:
        return None
    program = result.problem.origin
    assert isinstance(program, Program)
    k = program.variables
    Q = result.problem.M[:k, :k]
    is_minimizer = is_semidefinite(Q)
    if is_minimizer and k <= FEW_VARIABLES:
        with imports:
            from lcpcli.formulations.quadratic_program.conclusions import (
                data_of,
                kind_of_solutions,
            )
            from lcpcli.formulations.quadratic_program.no_minimum import STATIONARY
        data = data_of(result.problem, program)
        kind = kind_of_solutions(result.problem, program, data)
        is_minimizer = kind.proved != STATIONARY
    if is_minimizer:
        return result.z[:k]
    warnings.warn(
        "P is not positive semidefinite, and x is only a stationary point",
        stacklevel=3,
    )
    return None


def add_to_qpsolvers() -> None:
    """Make `qpsolvers.solve_qp(..., solver="lcp")` and `qpsolvers.solve_problem` call
    this package.

    Keyword arguments are infinity and those of `run`. verbose has no effect; neither
    has initvals, which causes a warning. Raises OptionError if qpsolvers is not
    installed.

    >>> import lcpcli
    >>> lcpcli.add_to_qpsolvers()  # doctest: +SKIP
    """
    try:
        from qpsolvers import solvers
    except ModuleNotFoundError:
        raise OptionError("add_to_qpsolvers", *missing("qpsolvers")) from None
    solvers.solve_function["lcp"] = _solve_problem
    for names in (
        solvers.available_solvers,
        solvers.dense_solvers,
        solvers.sparse_solvers,
    ):
        if "lcp" not in names:
            names.append("lcp")


def _solve_problem(
    problem: Any,
    initvals: Any = None,
    verbose: bool = False,  # noqa: ARG001
    infinity: float = math.inf,
    **options: Any,
) -> Any:
    """Solve a problem for qpsolvers. Multipliers have the signs that satisfy Px + q +
    G'z + A'y + z_box = 0. Bounds that no number satisfies are no error there: the
    problem has no solution.
    """
    from qpsolvers import Solution

    if initvals is not None:
        warnings.warn("lcp does not use initvals", stacklevel=3)
    names = ("P", "q", "G", "h", "A", "b", "lb", "ub")
    arguments = {name: getattr(problem, name) for name in names}
    solution = Solution(problem)
    try:
        program = from_qpsolvers(**arguments, infinity=infinity)
    except EmptyIntervalError as error:
        solution.found = False
        statement = f"the program is infeasible: {error.where} {error.fault}"
        solution.extras = {"message": statement, "statement": statement}
        return solution
    result = run(program, **options)
    answer = result.answer
    solution.found = _minimizer(result) is not None
    solution.extras = {"message": result.message, "answer": answer}
    if not solution.found:
        solution.extras["statement"] = answer.statement
    if result.solved:
        below = 0 if problem.h is None else problem.h.size
        solution.x, solution.obj = answer.x, answer.objective
        solution.z = -answer.y[:below]
        solution.y = -answer.y[below:]
        solution.z_box = -answer.bound_multipliers
    return solution
