"""Linear complementarity problems: find z >= 0 with w = M z + q >= 0 and z'w = 0; and
mixed ones, with other bounds.

M is a real matrix of shape (n, n), dense or sparse, and q is a vector of n numbers.

    solve        solves the problem with M and q, and returns a Result
    Problem      M and q, with a name, a starting point and known solutions
    read, write  read a problem from files, or write it to files
    run          solves a Problem, with the options of solve, and returns a Result
    Result       the outcome: its Status, z, w, the residual, on request a Trace of the
                 iterates (TraceRows), and more
    Interrupted  what Ctrl-C raises: a KeyboardInterrupt with the Result so far
    solve_many   the results of many problems, or of one M with many q, one after
                 another; a Batch if each q has an M
    Batch        the results of many problems of one size, with arrays of all solutions,
                 and their derivatives
    Solver       prepares one M for a sequence of problems, each solved starting from
                 the basis of the previous one
    use_kernels  makes all later calls use the compiled kernels of the extra `fast`
    exact        the solution of a Problem in fractions, or a proof that there is none
    solutions    all solutions of a Problem, in fractions: isolated ones and faces; for
                 a game all equilibria
    optimum      the best of all solutions of a Problem by a linear objective, in
                 fractions, with a proof
    why          what conflicts in a Problem without a solution and the least change
                 that helps, or how far each number of a solved one may move
    check        verifies a z for a Problem, whatever its source
    path         the Path of solutions from one Problem to another with the same M,
                 piece by piece
    inspect      the classes of M, its scaling, and the methods that are guaranteed to
                 solve a Problem
    plan         the attempts of auto on a Problem, in order, with reasons
    plot         results as a figure of error against time and iteration
    error_bound  a proved bound on the distance of a z from the solution
    solve_mcp    solves a nonlinear complementarity problem with functions F and J, and
                 returns a Result
    solve_qp     the minimizer of a convex quadratic or linear program, called as in
                 qpsolvers
    from_qp      the Problem of a linear or quadratic program; Result.answer has its
                 minimizer and multipliers
    from_qpsolvers, from_osqp  the same, from the arguments of qpsolvers or OSQP
    add_to_qpsolvers  makes qpsolvers.solve_qp(..., solver="lcp") possible
    from_avi     the Problem of an affine variational inequality on a polyhedron, with H
                 not symmetric
    from_players  the same for the equilibria of players with convex quadratic costs,
                 shared or individual constraints, and bounds
    from_polymatrix  the same for a game whose payoffs are sums over pairs of players
    from_game    the Problem of a two-player game; Result.answer has its equilibrium
    from_efg     the same for a game tree, from the text of one of Gambit's .efg files
    nnls, lsq    the fit that minimizes |Ax - b|, with x >= 0, or with bounds and
                 equations; its coefficients are in Result.answer
    from_lsq     the Problem of such a fit
    from_findex, from_contact  the Problem of contact with friction, from bounds and
                 friction indices or from a Delassus matrix; Result.answer has impulses,
                 velocities, and what each contact does

>>> import lcpcli
>>> result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
>>> result.solved, result.z.round(6).tolist(), result.w.round(6).tolist()
(True, [1.333333, 2.333333], [0.0, 0.0])

Invalid problems and options raise an `lcpcli.errors.LCPError`, which says where the
error is, what is wrong, and how to fix it. Public names are loaded on first use, so
importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from lcpcli.version import VERSION

if TYPE_CHECKING:
    from lcpcli.enumeration.optimum import optimum as optimum
    from lcpcli.enumeration.search import solutions as solutions
    from lcpcli.explanation.explanation import why as why
    from lcpcli.files.reading import read as read
    from lcpcli.files.writing import write as write
    from lcpcli.formulations.bimatrix_game.game import from_game as from_game
    from lcpcli.formulations.contact.friction import from_contact as from_contact
    from lcpcli.formulations.contact.friction import from_findex as from_findex
    from lcpcli.formulations.game_tree.game import from_efg as from_efg
    from lcpcli.formulations.least_squares.fit import from_lsq as from_lsq
    from lcpcli.formulations.least_squares.fitting import lsq as lsq
    from lcpcli.formulations.least_squares.fitting import nnls as nnls
    from lcpcli.formulations.nonlinear_model.nl_format import read_nl as read_nl
    from lcpcli.formulations.players.polymatrix import (
        from_polymatrix as from_polymatrix,
    )
    from lcpcli.formulations.players.quadratic import from_players as from_players
    from lcpcli.formulations.quadratic_program.reductions import from_osqp as from_osqp
    from lcpcli.formulations.quadratic_program.reductions import from_qp as from_qp
    from lcpcli.formulations.quadratic_program.reductions import (
        from_qpsolvers as from_qpsolvers,
    )
    from lcpcli.formulations.quadratic_program.solve_qp import (
        add_to_qpsolvers as add_to_qpsolvers,
    )
    from lcpcli.formulations.quadratic_program.solve_qp import solve_qp as solve_qp
    from lcpcli.formulations.variational_inequality.inequality import (
        from_avi as from_avi,
    )
    from lcpcli.inspection.inspection import inspect as inspect
    from lcpcli.inspection.inspection import plan as plan
    from lcpcli.model.problem import Problem as Problem
    from lcpcli.parametric.following import path as path
    from lcpcli.parametric.path import Path as Path
    from lcpcli.report.plotting import plot as plot
    from lcpcli.solving.call import Interrupted as Interrupted
    from lcpcli.solving.call import run as run
    from lcpcli.solving.call import solve as solve
    from lcpcli.solving.checking import check as check
    from lcpcli.solving.direct_run import use_kernels as use_kernels
    from lcpcli.solving.many import Batch as Batch
    from lcpcli.solving.many import solve_many as solve_many
    from lcpcli.solving.proof import exact as exact
    from lcpcli.solving.result import Result as Result
    from lcpcli.solving.result import Status as Status
    from lcpcli.solving.solve_mcp import solve_mcp as solve_mcp
    from lcpcli.solving.solver import Solver as Solver
    from lcpcli.solving.trace import Trace as Trace
    from lcpcli.solving.trace import TraceRow as TraceRow
    from lcpcli.verify.error_theorems import error_bound as error_bound

__version__ = VERSION

_PUBLIC = {  # the public names of each module, loaded on first use
    "enumeration.optimum": "optimum",
    "enumeration.search": "solutions",
    "explanation.explanation": "why",
    "files.reading": "read",
    "files.writing": "write",
    "formulations.bimatrix_game.game": "from_game",
    "formulations.contact.friction": "from_contact from_findex",
    "formulations.game_tree.game": "from_efg",
    "formulations.players.polymatrix": "from_polymatrix",
    "formulations.players.quadratic": "from_players",
    "formulations.nonlinear_model.nl_format": "read_nl",
    "formulations.quadratic_program.reductions": "from_osqp from_qp from_qpsolvers",
    "formulations.quadratic_program.solve_qp": "add_to_qpsolvers solve_qp",
    "formulations.variational_inequality.inequality": "from_avi",
    "formulations.least_squares.fit": "from_lsq",
    "formulations.least_squares.fitting": "lsq nnls",
    "inspection.inspection": "inspect plan",
    "model.problem": "Problem",
    "parametric.following": "path",
    "parametric.path": "Path",
    "report.plotting": "plot",
    "solving.call": "Interrupted run solve",
    "solving.checking": "check",
    "solving.direct_run": "use_kernels",
    "solving.many": "Batch solve_many",
    "solving.proof": "exact",
    "solving.result": "Result Status",
    "solving.solve_mcp": "solve_mcp",
    "solving.solver": "Solver",
    "solving.trace": "Trace TraceRow",
    "verify.error_theorems": "error_bound",
}
_HOMES = {name: module for module, names in _PUBLIC.items() for name in names.split()}
__all__ = sorted(_HOMES)


if not TYPE_CHECKING:  # otherwise type checkers would not find misspelt names

    def __getattr__(name: str) -> Any:
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        home = f"lcpcli.{_HOMES[name]}"
        if home.startswith("lcpcli.formulations."):  # whose folder may be missing
            from lcpcli.model.formulations import module_at

            module = module_at(home, f"lcpcli.{name}")
        else:
            module = import_module(home)
        value = globals()[name] = getattr(module, name)
        return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
