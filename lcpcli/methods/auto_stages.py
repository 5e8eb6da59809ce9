"""The stages of auto before milp: which method is tried when, as a table, and the facts on which that depends.

Sparse M: `sparse_route` needs only products with M if these suffice; then newton, then interior, or first interior
where the band of M is narrow. Programs: newton, while it is fast, and interior, after `linear` if M is skew. Dense M:
newton solves almost every problem with a P-matrix in a handful of factorizations; then interior, if M + M' is positive
semidefinite, and `linear`, which proves most infeasible problems infeasible. Lemke solves problems with copositive-plus
or otherwise well-behaved M, and its restarts solve games. Reflections find solutions for any M; the first nodes of the
tree of milp prove for few unknowns that there is none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from lcpcli.linalg import factors
from lcpcli.linalg.matrices import is_sparse
from lcpcli.methods import stages
from lcpcli.methods.direct import MOST_PIVOTED
from lcpcli.methods.newton import LEAST_INDEX_STEPS, dense_route, newton
from lcpcli.methods.registry import METHODS
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled, in_given_variables
from lcpcli.methods.structure import Structure
from lcpcli.model.changes import is_far_from_one, scale
from lcpcli.verify.basic_solution import BasicSolutions

# Iterations of the simplex method, by the seconds that so many usually take: for each entry of M, for a linear program
# before the interior point method has its turn; after first attempts of that, by the order of M; and at least.
SIMPLEX_EFFORT, SIMPLEX_EFFORT_BY_ORDER, LEAST_SIMPLEX_EFFORT = 4e-5, 1e-9, 0.1
NEWTON_SETTLING_FACTOR = 0.2  # most changes of state in a step of newton, relative to the last step, if it is to go on
MOST_EARLY_LINEAR = 1000  # unknowns up to which an LP takes no longer than a few attempts of the interior point method
SETTLED_CHANGES = 3  # of state in a step of newton: so few do not end it
SMALL_PIVOTS, LEMKE_PIVOTS = 3, 20  # of lemke, per unknown: enough for most problems that it solves, and later
FEWEST_FRICTIONAL = 35  # unknowns from which this holds for M with some zeros on the diagonal, as of contact, too
FIRST_LOOKS, FIRST_LOOKS_PER_UNKNOWN = 40, 0.5  # at the reflections: by then most are found that are found
MOST_FOR_MILP = 100  # unknowns up to which milp decides some dense problems in minutes
MOST_REFLECTED = METHODS["reflections"].max_unknowns or 0
FEW_LOOKS, MANY_LOOKS = 1000, 2500  # at the reflections before milp: a second or ten


def _newton_while_fast(structure: Structure) -> Stage:
    """Run newton until a step changes more than NEWTON_SETTLING_FACTOR of the states that the last step changed.

    Circuits need three steps, each with one factorization; most programs end it at the first one.
    """
    box, stage = structure.problem.box, _newton(structure)
    basis, most = box.basis_of(np.zeros(structure.problem.n)), math.inf
    while isinstance(step := stages.advance(stage), Iterate):
        before, basis = basis, box.basis_of(step.x)
        changes = basis.changes(before)
        yield step
        if changes > most:
            return Stalled("the active set settles too slowly")
        most = max(NEWTON_SETTLING_FACTOR * changes, SETTLED_CHANGES)
    return step


def _simplex(structure: Structure) -> Stage:
    """Give linear a share by the entries of M."""
    return _linear(structure, SIMPLEX_EFFORT * structure.problem.M.nnz)


def _linear(structure: Structure, effort: float = math.inf) -> Stage:
    from lcpcli.methods.linear import linear

    return linear(structure.given, max(effort, LEAST_SIMPLEX_EFFORT))


def _sparse(structure: Structure) -> Stage:
    from lcpcli.methods.sparse_route import sparse_route

    problem = structure.problem
    return sparse_route(problem, structure.x0, krylov_only=not problem.M.diagonal().all())


def _newton(structure: Structure) -> Stage:
    """Run newton; on dense M its exchanges of single indices, which advance only for P-matrices, are few or none."""
    problem = structure.problem
    if is_sparse(problem.M):
        return newton(problem, structure.x0, problem.n)
    return dense_route(problem, structure.x0, LEAST_INDEX_STEPS if problem.M.diagonal().min() > 0 else 0)


def _all_basic(structure: Structure) -> Stage:
    """Solve M z = -q: pivoting may miss a solution with w = 0 and many z_i at bounds, as it has no definite states."""
    problem = structure.problem
    lower, upper = (np.clip(bound, -1.0, 1.0) for bound in problem.box.vectors(problem.n))  # 0 is within the bounds
    basis = problem.box.basis_of((lower + upper) / 4)
    try:
        found = BasicSolutions(problem).at(basis)
    except factors.SingularMatrix as error:
        return Breakdown(str(error))
    yield Iterate(problem.box.x_within(found.z, found.w, basis), None, "w = 0", 1)
    return Finished()


def _restarts(structure: Structure) -> Stage:
    from lcpcli.methods.lemke import restarts

    return stages.as_lcp(restarts, structure.problem, structure.x0)


def _lemke(structure: Structure, pivots: int) -> Stage:
    return stages.limited(structure.begin("lemke"), pivots * structure.problem.n)


def _pivoted(structure: Structure) -> Stage:
    from lcpcli.methods.lemke import pivoted

    return pivoted(structure.problem, structure.follow)


def _newton_in_scaled_units(structure: Structure) -> Stage:
    """Run newton in units in which products of a few numbers neither over- nor underflow."""
    units = scale(structure.problem)
    return in_given_variables(units, newton(units.problem, units.start(structure.x0), LEAST_INDEX_STEPS))


def _lemke_in_scaled_units(structure: Structure) -> Stage:
    units = scale(structure.problem)
    lemke = stages.begin("lemke", units.problem, units.start(structure.x0))
    return in_given_variables(units, stages.limited(lemke, LEMKE_PIVOTS * structure.problem.n))


def _first_attempts(structure: Structure) -> Stage:
    from lcpcli.methods.interior import FIRST_ATTEMPTS, attempts

    return attempts(structure.thin, FIRST_ATTEMPTS)


def _briefly_linear(structure: Structure) -> Stage:
    """Where the first attempts of interior stall, there is often no solution, which an LP shows sooner than others."""
    return _linear(structure, SIMPLEX_EFFORT_BY_ORDER * structure.problem.n**3)


def _further_attempts(structure: Structure) -> Stage:
    from lcpcli.methods.interior import FURTHER_ATTEMPTS, attempts

    return attempts(structure.thin, FURTHER_ATTEMPTS)


def _first_reflections(structure: Structure) -> Stage:
    looks = FIRST_LOOKS + FIRST_LOOKS_PER_UNKNOWN * structure.problem.n
    ending = yield from stages.limited(structure.reflections, looks)
    structure.reflections_go_on = isinstance(ending, Stalled)
    return ending


def _first_nodes(structure: Structure) -> Stage:
    from lcpcli.methods.milp import first_nodes

    return stages.as_lcp(first_nodes, structure.problem, structure.x0)


def _last_reflections(structure: Structure) -> Stage:
    """Go on with the reflections, for fewer looks where milp can do more."""
    return stages.limited(structure.reflections, FEW_LOOKS if structure.problem.n <= MOST_FOR_MILP else MANY_LOOKS)


class Row(NamedTuple):
    """A row of the table of stages: the method that it belongs to, when it is tried, and how it begins."""

    method: str
    applies: Callable[[Structure], bool]
    begin: Callable[[Structure], Stage]


def _begun_interior(structure: Structure) -> Stage:
    return structure.begin("interior")


def _is_pivoted(structure: Structure) -> bool:
    return structure.problem.n <= MOST_PIVOTED and not is_far_from_one(structure.problem)


def _is_frictional(structure: Structure) -> bool:
    """Return whether M is dense, not monotone, and has some zeros on the diagonal but not only zeros, as games have."""
    if structure.is_large_and_sparse or structure.problem.is_mixed or structure.problem.n < FEWEST_FRICTIONAL:
        return False
    return structure.is_no_p_matrix and not structure.has_zero_diagonal and not structure.is_monotone


def _is_program(structure: Structure) -> bool:
    return bool(structure.program)


def _interior(applies: Callable[[Structure], bool]) -> Iterator[Row]:
    """Return the rows for the interior point method, with an LP in between."""
    yield Row("interior", applies, _first_attempts)
    yield Row("linear", lambda s: s.problem.n <= MOST_EARLY_LINEAR and applies(s), _briefly_linear)
    yield Row("interior", applies, _further_attempts)


def _longer_paths(applies: Callable[[Structure], bool]) -> Iterator[Row]:
    """Return the rows for more pivots of lemke, and for other starts of it unless they have been tried."""
    yield Row("lemke", lambda s: applies(s) and not _is_pivoted(s), partial(_lemke, pivots=LEMKE_PIVOTS))
    yield Row("lemke", lambda s: applies(s) and not s.has_zero_diagonal, _restarts)


LARGE = (
    # of a convex program, with sparse M
    Row("linear", lambda s: s.program == "linear", _simplex),
    Row("newton", lambda s: bool(s.program) and s.is_half_free, _newton_while_fast),
    *_interior(_is_program),
    # other large and sparse M
    Row("sparse", lambda s: s.is_large_and_sparse and not s.program, _sparse),
    Row("interior", lambda s: s.is_narrow, _begun_interior),
)
FIRST = (  # of any other M
    Row("newton", lambda s: s.is_no_p_matrix and s.problem.is_mixed, _newton_while_fast),
    Row("newton", lambda s: not s.is_no_p_matrix, _newton),
    Row("lemke", _is_pivoted, _pivoted),
)
OTHERS = (
    Row("newton", lambda s: not (s.program or (s.is_no_p_matrix and s.is_monotone)), _all_basic),
    Row("newton", lambda s: is_far_from_one(s.problem), _newton_in_scaled_units),
    Row("lemke", lambda s: is_far_from_one(s.problem), _lemke_in_scaled_units),
    Row("interior", _is_frictional, _first_attempts),
    *_interior(lambda s: s.is_monotone),
    Row("linear", lambda s: s.is_large_and_sparse or s.problem.is_mixed or s.is_monotone, _linear),
    Row("newton", lambda s: s.is_no_p_matrix, _newton),
    Row("lemke", lambda s: not _is_pivoted(s), partial(_lemke, pivots=SMALL_PIVOTS)),
    # M without a property that helps: interior solves most first-order conditions of programs that are not convex
    Row("interior", lambda s: s.problem.is_mixed and not s.is_semidefinite, _begun_interior),
    Row("lemke", lambda s: s.has_zero_diagonal, _restarts),
    Row("reflections", lambda s: s.problem.n <= MOST_REFLECTED, _first_reflections),
    Row("linear", lambda s: not (s.is_large_and_sparse or s.problem.is_mixed or s.is_monotone), _linear),
    *_longer_paths(lambda s: not s.is_large_and_dense),
    Row("milp", lambda s: s.problem.n <= factors.MOST_NUMPY_ROWS, _first_nodes),
    Row("reflections", lambda s: s.reflections_go_on, _last_reflections),
    *_longer_paths(lambda s: s.is_large_and_dense),
)
TABLE = (*LARGE, *FIRST, *OTHERS)


def before_milp(structure: Structure, table: Sequence[Row] = TABLE) -> Iterator[tuple[str, Stage]]:
    """Yield the stages of a table, by the names of their methods, each created when its turn comes."""
    for row in table:
        if row.applies(structure):
            yield row.method, row.begin(structure)
