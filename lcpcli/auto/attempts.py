"""The attempts of `auto`: the facts that decide, how each attempt begins, and the table
that says which are made, when, and how far at first.

Attempts are made in the order of the table, in rounds. An attempt with a limit on the
iterates of its first round is suspended at this limit; in each later round it continues
with twice the limit of the round before, after M. Luby, A. Sinclair and D. Zuckerman,
Optimal speedup of Las Vegas algorithms, Information Processing Letters 47 (1993)
173-180: an attempt that would answer at once waits for no attempt that runs long, and
the total is a small multiple of what the best attempt takes. The limits count iterates,
never seconds.

To add an attempt, add a row. `lcpcli.plan` and `lcp inspect` show the rows that apply
to a problem.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli.basis import tableau
from lcpcli.basis.free_variables import Reduction
from lcpcli.clock import imports
from lcpcli.linalg import factors
from lcpcli.linalg.krylov import is_semidefinite
from lcpcli.linalg.matrices import (
    has_no_positive_links,
    is_narrow,
    is_skew,
    is_sparse,
    may_be_eliminated,
    may_be_stiff,
    thinned,
)
from lcpcli.linalg.patterns import affordable, is_forest
from lcpcli.methods import direct, stages
from lcpcli.methods.newton import MAX_LEAST_INDEX_STEPS, SLOW, dense_route, newton
from lcpcli.methods.registry import METHODS
from lcpcli.methods.stages import (
    Finished,
    Iterate,
    Part,
    RecordedStages,
    Stage,
    Stalled,
)
from lcpcli.model.changes import is_far_from_one, shifted
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Mask, Vector
from lcpcli.verify.measure import FEW_UNKNOWNS

if TYPE_CHECKING:
    from lcpcli.methods.bimatrix import Costs
    from lcpcli.methods.lemke import Follow

# Unknowns up to which an LP takes no longer than a few attempts of the interior point
# method.
MAX_EARLY_LINEAR = 1000
# Unknowns up to which an LP takes no more than the iterations of the earlier attempts.
MAX_SURELY_LINEAR = 100
MAX_REFLECTED = METHODS["reflections"].max_unknowns or 0
# Iterations of `reflections` in its first round: half of the solutions that it reaches
# at all are reached by then.
FIRST_REFLECTIONS = 40
# Unknowns of a game up to which Lemke's path takes less time than those of several
# labels.
MAX_PIVOTED_GAME = 60
# Unknowns up to which a suspended attempt may keep its dense matrices, at most 300 MB.
MAX_HELD = 4000
# Rounds of a phase: fewer where milp, which follows, decides more problems.
ROUNDS, ROUNDS_BEFORE_MILP = 6, 5
MAX_FOR_MILP = 100  # unknowns up to which milp does
# Work limits of the simplex method, in the seconds that its iterations usually take: on
# a linear program, before the interior point method, for each entry of M, and for each
# operation of a factorization, of which interior takes some twenty; after the first
# attempts of the interior point method, times n^3; and the smallest limit.
SIMPLEX_EFFORT = 4e-5
SIMPLEX_EFFORT_BY_OPERATIONS = 6e-9
SIMPLEX_EFFORT_BY_ORDER = 1e-9
MIN_SIMPLEX_EFFORT = 0.1
# newton while it converges fast: the largest ratio of the numbers of variables whose
# basis status two successive steps change.
NEWTON_SETTLING_FACTOR = 0.2
SETTLED_CHANGES = 3  # changes of basis status in a step that do not stop it
# Steps of newton with factors of a band: it converges within these, or takes about as
# many as there are unknowns.
MAX_BAND_STEPS = 5
CHANDRASEKARAN = "Chandrasekaran's method"
# Such steps for a small M, or from zeros of q, where the other attempts take longer.
MAX_SMALL_BAND_STEPS = 25
MIN_FRICTIONAL = 35  # unknowns from which interior is run on contact with friction
# Unknowns from which on interior takes less time, if M + M' is semidefinite.
MAX_PIVOTED_BY_NUMPY = 150
# Unknowns up to which Lemke's path is so short that it is followed where no theorem
# says how it terminates.
SHORT = 20
MAX_UNFILLED = 100  # unknowns up to which sparse factors cost no less than dense ones


class Structure:
    """The facts about a problem by which auto chooses an attempt, each computed when it
    is first needed.

    original_problem, problem : the problem as it is, and with dense M if n is small.
    x0 : the start of auto.
    recorded_stages : the stages of first attempts that have run already, to be passed
        on instead of being run again.
    given_problem : the problem from whose formulation another form of it may be made:
        that before its reference point was moved to 0.
    is_linearization : whether the problem is the linearization of a nonlinear one, for
        which a good step is needed, and no proof.
    follow : `tableau.follow` or its compiled form, for Lemke's paths.
    reduced : returns a `Reduction` that is stored for problems with this M; None if
        none is stored.
    """

    def __init__(
        self,
        problem: Problem,
        x0: Vector,
        recorded_stages: RecordedStages | None = None,
        given_problem: Problem | None = None,
    ) -> None:
        self.original_problem = problem
        self.given_problem = given_problem or problem
        self.x0 = x0
        self.recorded_stages = {} if recorded_stages is None else recorded_stages
        self.follow: Follow = tableau.follow
        self.reduced: Callable[[Problem], Reduction] | None = None
        self.is_linearization = False
        self.is_narrow = direct.is_full_band(problem.M)
        self.is_large_and_sparse = self.is_narrow or (
            is_sparse(problem.M) and problem.n > direct.MAX_AS_DENSE
        )
        self.problem = problem if self.is_large_and_sparse else direct.as_dense(problem)

    @cached_property
    def thin(self) -> Problem:
        """Return the problem with sparse M if M has so few entries that sparse factors
        cost less even for small n; else with dense M for small n."""
        max_entries = direct.MAX_FILLED * self.original_problem.n**2
        M = (
            self.original_problem.M
            if self.original_problem.n <= MAX_UNFILLED
            else thinned(self.original_problem.M, max_entries)
        )
        is_thin = (
            is_sparse(M)
            and self.original_problem.n > MAX_UNFILLED
            and M.nnz <= max_entries
        )
        return direct.with_M(self.original_problem, M) if is_thin else self.problem

    @property
    def reduction(self) -> Reduction | None:
        """Return the problem in bounded variables, if it is stored."""
        return None if self.reduced is None else self.reduced(self.problem)

    @cached_property
    def is_stiff(self) -> bool:
        """Return whether M is sparse, of more than MAX_UNFILLED unknowns, has
        affordable factors, and is positive definite, up to rounding of its entries, but
        no M-matrix: it may be ill-conditioned and lacks the properties that other
        methods need."""
        M = self.original_problem.M
        if not (self.original_problem.n > MAX_UNFILLED and may_be_stiff(M)):
            return False
        if not (is_narrow(M) or affordable(M)):
            return False
        with imports:
            from lcpcli.linalg.definite_systems import is_nearly_definite
        return is_nearly_definite(M)

    @cached_property
    def program(self) -> str:
        """Return "linear" or "quadratic" if M is large, sparse and that of a convex
        program; else ""."""
        M = self.problem.M
        # The rows of a program have zeros on the diagonal.
        if not (self.is_large_and_sparse and self.is_no_p_matrix):
            return ""
        if is_skew(M):
            return "linear"
        # The signs of rows with which M is symmetric: a program has both kinds.
        S = self.problem.signs
        return (
            "quadratic"
            if S is not None and (S[0] != S).any() and is_semidefinite(M)
            else ""
        )

    @cached_property
    def is_no_p_matrix(self) -> bool:
        """Return whether M has a zero on the diagonal, as for programs: newton then
        rarely converges, unless it does so fast."""
        return not self.problem.M.diagonal().all()

    @cached_property
    def is_z_matrix(self) -> bool:
        """Return whether no entry of M off the diagonal is positive, and all on it are:
        block pivots then advance from both sides."""
        return self.has_no_positive_links and bool(
            (self.problem.M.diagonal() > 0).all()
        )

    @cached_property
    def has_no_positive_links(self) -> bool:
        """Return whether M is a Z-matrix: whether no entry off the diagonal is
        positive."""
        return has_no_positive_links(self.problem.M)

    @cached_property
    def basic_zeros(self) -> Mask | None:
        """Return `direct.basic_zeros` if M is small, or the graph of its entries is a
        forest, so that its factors cost little; else None."""
        zeros = direct.basic_zeros(self.problem)
        return (
            zeros
            if zeros is not None
            and (not self.is_large_and_sparse or is_forest(self.problem.M))
            else None
        )

    @cached_property
    def is_semidefinite(self) -> bool:
        """Return whether M + M' is positive semidefinite; it is assumed if M is large
        and sparse."""
        return self.is_large_and_sparse or is_semidefinite(self.original_problem.M)

    @cached_property
    def is_unsure(self) -> bool:
        """Return whether an entry on the diagonal of M is negative, for more than a few
        unknowns without bounds: M is then neither copositive nor a P-matrix, nor of
        another class for which Lemke's path leads to a solution."""
        return (
            self.problem.n > SHORT
            and not self.problem.is_mixed
            and bool(self.problem.M.diagonal().min() < 0)
        )

    @cached_property
    def may_gain_by_presolve(self) -> bool:
        """Return whether M is not known to be monotone: it may become so when equations
        change their signs. Convex programs gain nothing: they take as many steps as
        without presolve."""
        if self.program:
            return False
        if self.is_large_and_sparse:
            return self.is_no_p_matrix
        return not self.is_semidefinite

    # Without this test, towers and crushed heaps in 300 unknowns take 30 times as long.
    @cached_property
    def is_frictional(self) -> bool:
        """Return whether M has the blocks of contact with friction, with zeros or small
        numbers on the diagonal, for more than a few unknowns without bounds."""
        M = (
            self.original_problem.M
            if is_sparse(self.original_problem.M)
            else self.thin.M
        )
        if (
            self.problem.is_mixed
            or self.problem.n < MIN_FRICTIONAL
            or M.diagonal().min() < 0
            or self.has_no_positive_links
            or self.program
            or self.game
        ):
            return False
        with imports:
            from lcpcli.linalg.patterns import has_friction
        return has_friction(M)

    @property
    def is_first_interior(self) -> bool:
        """Return whether interior takes less time on contact with friction than any
        other method, some of which take long to fail."""
        return self.problem.n > direct.MAX_PIVOTED and (
            self.is_frictional or self.has_other_form
        )

    @cached_property
    def prefers_lemke(self) -> bool:
        """Return whether Lemke's path is followed before any other method but
        newton."""
        n = self.problem.n
        if n > direct.MAX_PIVOTED or self.is_unsure or is_far_from_one(self.problem):
            return False
        return (
            n <= MAX_PIVOTED_BY_NUMPY
            or self.follow is not tableau.follow
            or not self.is_semidefinite
        )

    @property
    def may_end_on_ray(self) -> bool:
        """Return whether Lemke's path may terminate without a solution, or has done so
        when it was followed first."""
        return self.prefers_lemke or self.is_unsure

    @property
    def has_cheap_path(self) -> bool:
        """Return whether a whole path costs less than other methods do, some of which
        are faster where there are bounds, on games, and if M is monotone."""
        return self.problem.n <= MAX_PIVOTED_BY_NUMPY and not (
            self.problem.is_mixed or self.is_semidefinite or self.game
        )

    @property
    def is_path_sure(self) -> bool:
        """Return whether Lemke's path is sure to lead to a solution if there is one."""
        return self.is_semidefinite or self.is_frictional

    @cached_property
    def game(self) -> Costs | None:
        """Return the costs of the bimatrix game whose equilibria solve the problem;
        None if there is no such game."""
        if self.is_large_and_sparse or self.problem.n < 2 or self.problem.M[0, 0]:
            return None
        with imports:
            from lcpcli.methods.bimatrix import costs
        return costs(self.problem)

    def other_form(self, stage_of: Callable[[Problem], Stage]) -> Any:
        """Return a stage that solves the problem in another form that its formulation
        has, in the variables in which the reference point is 0; None if there is none.
        stage_of : makes the stage for the other form."""
        given = self.given_problem
        stage = given.formulation.in_other_form(given, stage_of)
        return stage and stages.in_new_variables(shifted(given), stage)

    @cached_property
    def has_other_form(self) -> bool:
        """Return whether there is another form: contact with friction in the plane."""
        return self.other_form(lambda _: stages.ended(Stalled())) is not None

    @property
    def suits_interior(self) -> bool:
        """Return whether a theorem or experience says that interior leads to a solution
        if there is one: contact is solved whatever the ratio of the masses is."""
        return self.is_path_sure or self.has_other_form

    @cached_property
    def is_constant_sum(self) -> bool:
        """Return whether the game, of more than a few strategies, is one of constant
        sum."""
        if self.game is None or self.problem.n <= SHORT:
            return False
        with imports:
            from lcpcli.methods.bimatrix import is_constant_sum
        return is_constant_sum(self.game)


Begin: TypeAlias = Callable[[Structure], Stage]


class AttemptRule(NamedTuple):
    """An attempt: when it is made, and how its stage is made.

    method, part : the method that it belongs to, and the variant of the method; "" if
        it is the whole method.
    reason : why the attempt is made, in words.
    applies : whether it is made for a problem.
    begin : returns its stage; None if it takes no part in rounds, but is begun by
        `policy` on the original problem.
    first_round_iterations : the iterates of its first round; infinite if it is never
        suspended.
    first_round : the round in which it begins, from 0.
    """

    method: str
    part: str
    reason: str
    applies: Callable[[Structure], bool]
    begin: Begin | None
    first_round_iterations: Callable[[Structure], float] = lambda _: math.inf
    first_round: int = 0


def is_eliminated(structure: Structure) -> bool:
    """Return whether elimination of a tridiagonal M is attempted, which takes no longer
    than one look at a basis."""
    problem = structure.problem
    return (
        structure.is_narrow and problem.box.is_orthant and may_be_eliminated(problem.M)
    )


def _is_first_basic(structure: Structure) -> bool:
    """Return whether newton from w = 0 comes before Lemke's path."""
    return structure.is_z_matrix and not structure.is_large_and_sparse


def _is_too_large_for_fractions(structure: Structure) -> bool:
    """Return whether M is so large, not only sparse, that exact arithmetic takes far
    longer than other methods."""
    return structure.is_large_and_sparse and structure.problem.n > direct.MAX_AS_DENSE


def _takes_piqp(structure: Structure) -> bool:
    """Return whether PIQP is installed, and takes no longer than a wait for Ctrl-C may
    be."""
    with imports:
        from lcpcli.linalg.programs import has_piqp
        from lcpcli.methods.bimatrix import takes_briefly
    return structure.game is not None and has_piqp() and takes_briefly(structure.game)


def _has_few_nodes(structure: Structure) -> bool:
    """Return whether a few nodes of the tree of milp are examined, which begin with a
    proof of infeasibility."""
    n, is_mixed = structure.problem.n, structure.problem.is_mixed
    return FEW_UNKNOWNS < n <= MAX_FOR_MILP and not (
        is_mixed or structure.is_semidefinite
    )


def stage_factory(
    function_path: str,
    arguments_of: Callable[[Structure], tuple[Any, ...]] = lambda s: (s.problem,),
) -> Begin:
    """Return the function that makes the stage of an attempt: it loads a function of
    `lcpcli.methods`, named as "module.function", and calls it with these arguments."""

    def begin(structure: Structure) -> Stage:
        module, _, function = function_path.partition(".")
        with imports:
            function_of_stage: Callable[..., Stage] = getattr(
                import_module(f"lcpcli.methods.{module}"), function
            )
        return function_of_stage(*arguments_of(structure))

    return begin


def newton_while_fast(structure: Structure) -> Stage:
    """Run newton until a step changes the basis status of more than SETTLED_CHANGES
    variables, and of more than NEWTON_SETTLING_FACTOR times those that the last step
    changed.

    Circuits need three steps, each with one factorization; most programs stop it at the
    first one. Where two steps first return to the same basis, it may be singular, and a
    solution close to its last basic solution is sought.
    """
    problem = structure.problem
    stage, box = usual_newton(structure), problem.box
    before = basis = box.basis_of(np.zeros(problem.n))
    max_changes, has_cycled = math.inf, False
    while isinstance(step := stages.advance(stage), Iterate):
        earlier, before, basis = before, basis, box.basis_of(step.x)
        changes = np.count_nonzero(basis != before)
        yield step
        if changes > max_changes:
            return Stalled(SLOW)
        max_changes = max(NEWTON_SETTLING_FACTOR * changes, SETTLED_CHANGES)
        # The first of the three is that of the start, not of an iterate.
        is_cycle = step.evaluations > 2 and np.array_equal(basis, earlier)
        if is_cycle and not (
            has_cycled or step.signs_final or structure.is_large_and_sparse
        ):
            has_cycled = True
            nearest = _nearest_solution(problem, step, before)
            if nearest is not None:
                yield nearest
                return Finished()
    return step


def _nearest_solution(
    problem: Problem, last: Iterate, basis: BasisStatus
) -> Iterate | None:
    """Return a solution close to the last iterate, which has this basis, for a dense M;
    None if there is none.

    Where M_BB is singular, as for a circuit without a node of given potential, rounding
    decides which of its basic solutions an elimination reaches. Pivots on their
    infeasibilities then return to the same bases, though others are feasible.
    """
    with imports:
        from lcpcli.methods.lemke import solution_of_basis, violations
    box = problem.box
    guess = box.project(box.z_of(last.x))
    z, is_accurate = solution_of_basis(problem, problem.M, guess, basis)
    if not is_accurate and violations(problem, z)[2].any():
        return None
    x = box.x_within(z, problem.w(z), box.basis_at(z))
    return Iterate(x, None, "block", last.evaluations + 1)


def usual_newton(structure: Structure) -> Stage:
    """Run newton, on a dense M with few pivots on single indices or none, as these are
    sure to advance only for P-matrices."""
    problem = structure.problem
    if is_sparse(problem.M):
        return newton(problem, structure.x0, problem.n, growing=structure.is_z_matrix)
    patience = _single_exchanges(structure) if problem.M.diagonal().min() > 0 else 0
    return dense_route(problem, structure.x0, patience, _is_hasty(problem))


def _is_hasty(problem: Problem) -> bool:
    """Return whether newton is stopped as soon as it is hopeless: where Lemke's path
    follows."""
    return problem.n <= direct.MAX_PIVOTED


def _single_exchanges(structure: Structure) -> int:
    """Return how many pivots on single indices of a dense M are made before other
    methods are attempted: few where Lemke's path follows, which advances by one index
    at a time too, for a fraction of the cost, or interior."""
    return (
        direct.FEW_INDEX_STEPS
        if _is_hasty(structure.problem)
        else MAX_LEAST_INDEX_STEPS
    )


def _from_basic_zeros(structure: Structure) -> Stage:
    """Run newton from w = 0 where q <= 0, on a large sparse M for a few steps only:
    where q > 0, each step reaches only the neighbours of the variables of the last
    one."""
    problem, is_large = structure.thin, structure.is_large_and_sparse
    x0 = np.where(problem.q <= 0, 0.5, -0.5)
    stage = newton(
        problem, x0, _single_exchanges(structure), _is_hasty(problem), growing=is_large
    )
    return stages.limited(stage, MAX_SMALL_BAND_STEPS) if is_large else stage


def all_basic(structure: Structure) -> Stage:
    """Solve M z = -q, and pivot on the infeasibilities.

    Pivoting from q < 0 may miss a solution with w = 0 and many z_i at bounds, as the
    basis status of these is not unique, and may take n steps where M is an M-matrix, as
    for options, since each step reaches only the neighbours of the last variables.
    """
    problem = structure.problem
    lower, upper = (
        np.clip(bound, -1.0, 1.0) for bound in problem.box.vectors(problem.n)
    )  # 0 is within the bounds
    patience = problem.n if is_sparse(problem.M) else _single_exchanges(structure)
    return newton(problem, (lower + upper) / 4, patience, _is_hasty(problem))


def lemke(structure: Structure) -> Stage:
    """Follow Lemke's path for up to MAX_PIVOTS n pivots: paths that lead to a solution
    are rarely longer."""
    with imports:
        from lcpcli.methods.lemke import MAX_PIVOTS
    return stages.limited(
        stages.begin("lemke", structure.problem, structure.x0),
        MAX_PIVOTS * structure.problem.n,
    )


BRIEFLY_LINEAR = stage_factory(
    "linear.linear",
    lambda s: (
        s.original_problem,
        max(SIMPLEX_EFFORT_BY_ORDER * s.problem.n**3, MIN_SIMPLEX_EFFORT),
    ),
)


def _simplex_effort(structure: Structure) -> float:
    """Return the limit on the work of the simplex method on a linear program, in
    seconds: about the time of the interior point method, if this is longer."""
    problem = structure.problem
    by_entries = SIMPLEX_EFFORT * float(problem.M.nnz)
    by_operations = SIMPLEX_EFFORT_BY_OPERATIONS * problem.facts.elimination_operations
    return max(by_entries, by_operations, MIN_SIMPLEX_EFFORT)


def _paths_in_other_form(structure: Structure) -> Stage:
    """Follow Lemke's paths in another form of the problem, which leads to a
    solution."""

    def paths(other: Problem) -> Stage:
        if other.n > direct.MAX_AS_DENSE:
            return stages.ended(Stalled("its other form has many unknowns"))
        with imports:
            from lcpcli.methods import lemke
        return lemke.paths(direct.as_dense(other), structure.follow)

    stage: Stage = structure.other_form(paths)
    return stage


def _interior_in_other_form(structure: Structure) -> Stage:
    with imports:
        from lcpcli.methods.interior import first_attempts
    stage: Stage = structure.other_form(first_attempts)
    return stage


INTERIOR_AT_FIRST = stage_factory("interior.first_attempts", lambda s: (s.thin,))
FIRST = (
    # Without it: games of 300 strategies each take 5 times as long, if one is pure.
    AttemptRule(
        "pure",
        "",
        "M is that of a bimatrix game, most of which have an equilibrium in "
        "pure strategies",
        lambda s: s.game is not None,
        stage_factory("bimatrix.pure_equilibrium", lambda s: (s.problem, s.game)),
    ),
    AttemptRule(
        "piqp",
        "",
        "M may be that of a convex program, and the package PIQP is installed",
        lambda s: direct.may_be_program(s.original_problem),
        stage_factory("convex_program.convex_program", lambda s: (s.original_problem,)),
    ),
    # Without it: the linear program forplan takes 2.5 times as long.
    AttemptRule(
        "linear",
        "of half of the variables",
        "M is large, sparse and skew-symmetric, as for a linear program",
        lambda s: s.program == "linear",
        stage_factory(
            "linear.linear", lambda s: (s.original_problem, _simplex_effort(s))
        ),
    ),
    # Without it: stacks of 60 to 100 boxes take 5 to 100 times as long.
    AttemptRule(
        "interior",
        "in another form",
        "there are many contacts, and the method is made for their other form",
        lambda s: s.is_first_interior and s.has_other_form,
        _interior_in_other_form,
    ),
    AttemptRule(
        "interior",
        "two attempts",
        "M has the blocks of contact with friction",
        lambda s: s.is_first_interior,
        INTERIOR_AT_FIRST,
    ),
    # Without it: a journal bearing in 900 unknowns takes 6 times as long.
    AttemptRule(
        "elimination",
        "",
        "M is tridiagonal, and no entry off the diagonal is positive, or few are",
        is_eliminated,
        stage_factory("z_matrix.eliminated"),
    ),
    # Without it: a tridiagonal M in 5000 unknowns, some of them free, takes 3 times
    # as long.
    AttemptRule(
        "newton",
        "while it converges fast",
        "M is a narrow band matrix, so that its factors cost little",
        lambda s: s.is_narrow and not (s.program or s.is_stiff),
        lambda s: stages.limited(newton_while_fast(s), MAX_BAND_STEPS),
    ),
    # Without it: bands of widths 2 to 5 in 300 unknowns take 1.4 to 2.9 times as long.
    AttemptRule(
        "newton",
        "from w = 0",
        "its factors cost little, and no entry off the diagonal is positive",
        lambda s: s.is_narrow and s.problem.n <= direct.MAX_AS_DENSE and s.is_z_matrix,
        lambda s: stages.limited(all_basic(s), MAX_SMALL_BAND_STEPS),
    ),
    # Without it: a chain of 5000 unknowns, most with q = 0, takes 18 times as long.
    AttemptRule(
        "newton",
        "from w = 0 where q <= 0",
        "some of q are 0, and rows with q <= 0 are positive on the diagonal alone",
        lambda s: s.basic_zeros is not None,
        _from_basic_zeros,
    ),
    # Without it: a dominant M in 2000 unknowns takes 370 times as long.
    AttemptRule(
        "sparse",
        "products with M, coarse versions of M, factors",
        "M is large and sparse, of no convex program",
        lambda s: (
            s.is_large_and_sparse
            and not s.program
            and not (s.is_narrow and s.is_stiff)
            and not s.is_first_interior
        ),
        stage_factory(
            "active_set.sparse_route", lambda s: (s.problem, s.x0, lambda: s.is_stiff)
        ),
    ),
    AttemptRule(
        "interior",
        "for definite M",
        "M + M' is positive definite and may be stiff: its positive entries off "
        "the diagonal are not small",
        lambda s: s.is_stiff,
        stage_factory("interior.of_stiff", lambda s: (s.original_problem,)),
    ),
    # Without it: games of constant sum with 20 to 250 strategies take 2 to 20 times as
    # long.
    AttemptRule(
        "piqp",
        "of a game",
        "the game is one of constant sum: a linear program",
        lambda s: s.is_constant_sum and _takes_piqp(s),
        stage_factory("bimatrix.by_piqp", lambda s: (s.problem, s.game)),
    ),
    AttemptRule(
        "linear",
        "of a game",
        "the game is one of constant sum: a linear program",
        lambda s: s.is_constant_sum,
        stage_factory("bimatrix.by_simplex", lambda s: (s.problem, s.game)),
    ),
    # Without it: a delta-sigma modulator takes 6 times as long.
    AttemptRule(
        "newton",
        "while it converges fast",
        "there are bounds, and zeros on the diagonal of M",
        lambda s: s.is_no_p_matrix and s.problem.is_mixed and not s.program,
        newton_while_fast,
    ),
    # Without it: dense LCPs in 300 unknowns take 3.5 times as long.
    AttemptRule(
        "newton",
        "",
        "it takes a few steps where M is a P-matrix, or almost one",
        lambda s: (
            not (
                s.is_no_p_matrix
                or s.is_large_and_sparse
                or s.is_stiff
                or s.is_first_interior
            )
        ),
        usual_newton,
    ),
    # Without it: three sampled problems without monotonicity, in 100 unknowns, are not
    # solved.
    AttemptRule(
        "newton",
        "at w = 0",
        "M is dense, and a solution with w = 0 has no unique basis where z is at "
        "bounds",
        lambda s: (
            not (s.is_large_and_sparse or s.is_z_matrix)
            and (s.is_unsure or not s.is_no_p_matrix)
        ),
        stage_factory("newton.without_w"),
    ),
    AttemptRule(
        "newton",
        "from w = 0",
        "no entry off the diagonal is positive, and all on it are",
        _is_first_basic,
        all_basic,
    ),
    # Without it: dense problems in 400 unknowns without solution take 4 to 30 times as
    # long, and some singular ones in 100 are not decided.
    AttemptRule(
        "newton",
        CHANDRASEKARAN,
        "no entry off the diagonal is positive, and z >= 0 is the only bound",
        lambda s: (
            s.has_no_positive_links
            and not (s.problem.is_mixed or _is_too_large_for_fractions(s))
        ),
        stage_factory("z_matrix.z_matrix"),
    ),
    # Without it: contact with friction in 28 unknowns takes 44 times as long.
    AttemptRule(
        "lemke",
        "",
        "there are few unknowns, with numbers of usual size",
        lambda s: s.prefers_lemke and not (s.game and s.problem.n > MAX_PIVOTED_GAME),
        stage_factory(
            "lemke.lemke_stage",
            lambda s: (s.problem, s.follow, s.reduction, lambda: s.is_path_sure),
        ),
    ),
)
BRIEF = (
    AttemptRule(
        "lemke-howson",
        "from several labels",
        "M is that of a bimatrix game",
        lambda s: s.game is not None,
        stage_factory("bimatrix.lemke_howson", lambda s: (s.problem, s.game)),
    ),
    AttemptRule(
        "linear",
        "few iterations",
        "no known property of M excludes that the problem is infeasible",
        lambda s: (
            s.problem.n <= MAX_EARLY_LINEAR
            and not (s.is_semidefinite or _has_few_nodes(s))
        ),
        BRIEFLY_LINEAR,
    ),
    AttemptRule(
        "milp",
        "a few nodes",
        f"there are at most {MAX_FOR_MILP} unknowns, and perhaps no solution",
        _has_few_nodes,
        stage_factory("milp.few_nodes"),
    ),
)
LATER = (
    # Without it: contacts in 66 unknowns, of bodies with mass ratios of 1e6, take 40
    # times as long.
    AttemptRule(
        "lemke",
        "in another form",
        "the contacts have another form, in which Lemke's path leads to a solution",
        lambda s: s.has_other_form,
        _paths_in_other_form,
        lambda _: 1,
    ),
    AttemptRule(
        "newton",
        "from w = 0 where q <= 0",
        "M is large and sparse, and some of q are 0",
        lambda s: (
            s.is_large_and_sparse
            and s.basic_zeros is None
            and direct.basic_zeros(s.problem) is not None
        ),
        _from_basic_zeros,
    ),
    AttemptRule(
        "newton",
        "from w = 0",
        "no known property of M excludes it",
        lambda s: (
            not s.program
            and not s.is_stiff
            and not s.game
            and not _is_first_basic(s)
            and not (s.is_no_p_matrix and s.is_semidefinite)
            and not s.is_frictional
        ),
        all_basic,
        # The next attempt is newton, whose basis then only grows.
        lambda s: MAX_SMALL_BAND_STEPS if s.is_z_matrix else math.inf,
    ),
    AttemptRule(
        "newton",
        "",
        "M is large and sparse; it takes a few steps where M is a P-matrix",
        lambda s: s.is_large_and_sparse and not (s.is_no_p_matrix or s.is_stiff),
        usual_newton,
    ),
    AttemptRule(
        "interior",
        "two attempts",
        "M + M' is positive semidefinite, or M has the blocks of contact with friction",
        lambda s: s.suits_interior and not s.is_first_interior,
        INTERIOR_AT_FIRST,
    ),
    AttemptRule(
        "newton",
        CHANDRASEKARAN,
        "M is large and sparse, and no entry off the diagonal is positive",
        lambda s: (
            s.has_no_positive_links
            and _is_too_large_for_fractions(s)
            and not s.problem.is_mixed
        ),
        stage_factory("z_matrix.z_matrix"),
    ),
    *BRIEF,
    # Without it: 240 problems of redundant contacts in 21 to 48 unknowns take five
    # times as long.
    AttemptRule(
        "lemke",
        "a short path",
        "pivots cost little, though the path may terminate without a solution",
        lambda s: s.may_end_on_ray and s.has_cheap_path,
        lemke,
        lambda s: 2 * s.problem.n,
    ),
    AttemptRule(
        "linear",
        "few iterations",
        "the problem may be infeasible",
        lambda s: s.is_semidefinite and s.problem.n <= MAX_EARLY_LINEAR,
        BRIEFLY_LINEAR,
    ),
    AttemptRule(
        "interior",
        "further attempts",
        "M + M' is positive semidefinite, or that of contact with friction",
        lambda s: s.suits_interior,
        stage_factory("interior.further_attempts", lambda s: (s.thin,)),
    ),
    AttemptRule(
        "newton",
        "",
        "there are zeros on the diagonal of M",
        lambda s: s.is_no_p_matrix,
        usual_newton,
    ),
    AttemptRule(
        "linear",
        "",
        "the problem may be infeasible",
        lambda s: s.problem.n > MAX_SURELY_LINEAR,
        stage_factory("linear.linear", lambda s: (s.original_problem,)),
        first_round=1,
    ),
    AttemptRule(
        "milp",
        "first nodes",
        f"there are at most {factors.MAX_NUMPY_ROWS} unknowns, and it applies to any M",
        lambda s: s.problem.n <= factors.MAX_NUMPY_ROWS,
        stage_factory("milp.first_nodes"),
        first_round=2,
    ),
    AttemptRule(
        "lemke",
        "",
        "there are many unknowns, or numbers of unusual size",
        lambda s: not (s.prefers_lemke or s.is_unsure),
        lemke,
        lambda s: s.problem.n,
    ),
    AttemptRule(
        "lemke",
        "",
        "its path may be long, or terminate without a solution",
        lambda s: s.may_end_on_ray and not s.has_cheap_path,
        lemke,
        lambda s: s.problem.n,
        first_round=2,
    ),
    AttemptRule(
        "interior",
        "",
        "there are bounds, and M + M' is indefinite, as for programs that "
        "are not convex",
        lambda s: s.problem.is_mixed and not s.is_semidefinite,
        lambda s: stages.begin("interior", s.problem, s.x0),
    ),
    AttemptRule(
        "reflections",
        "",
        f"there are at most {MAX_REFLECTED} unknowns, and it applies to any M",
        lambda s: s.problem.n <= MAX_REFLECTED,
        lambda s: stages.begin("reflections", s.problem, s.x0),
        lambda _: FIRST_REFLECTIONS,
    ),
)
STEP = (
    AttemptRule(
        "lemke",
        "",
        "a nonlinear method needs a step, and no proof",
        lambda _: True,
        stage_factory("lemke.end_of_path", lambda s: (s.problem, s.follow)),
    ),
)
PRESOLVE = AttemptRule(
    "presolve",
    "",
    "M may become monotone as equations change their signs: the reduced problem is "
    "solved first",
    lambda s: s.problem.is_mixed and s.may_gain_by_presolve,
    None,
)
EXACT = AttemptRule(
    "exact",
    "",
    f"there are at most {FEW_UNKNOWNS} unknowns, whose bases can be searched",
    lambda s: s.problem.n <= FEW_UNKNOWNS,
    None,
)
MILP = AttemptRule("milp", "", "it needs no property of M", lambda _: True, None)


def phases(structure: Structure) -> tuple[tuple[AttemptRule, ...], ...]:
    """Return the attempts for a problem in the order of a run: those of a phase
    alternate in rounds, or are begun by `policy`.

    Presolve takes no longer than the first attempts only if M is large and sparse.
    Problems with few unknowns are decided by exact arithmetic before attempts that may
    take long.
    """
    if structure.is_linearization:
        return (STEP,)
    presolve = (PRESOLVE,)
    exact = (EXACT,)
    milp = (MILP,)
    if EXACT.applies(structure):
        return FIRST, BRIEF, exact, presolve, LATER, milp
    if structure.is_large_and_sparse:
        return presolve, FIRST, LATER, milp
    return FIRST, presolve, LATER, milp


def attempts_in_rounds(
    structure: Structure, phase: Sequence[AttemptRule]
) -> Iterator[Part]:
    """Yield the attempts of a phase that apply, round by round; each begins in its
    first round, and continues in later ones until it is over."""
    suspended = dict[int, Part]()
    for number in range(
        ROUNDS_BEFORE_MILP if structure.problem.n <= MAX_FOR_MILP else ROUNDS
    ):
        for i, row in enumerate(phase):
            part = suspended.pop(i, None)
            if row.first_round == number and row.applies(structure):
                assert row.begin is not None
                recorded = structure.recorded_stages.get(row.method)
                part = Part(
                    row.method, recorded.pop(0) if recorded else row.begin(structure)
                )
            if part is None:
                continue
            part.max_iterates = row.first_round_iterations(structure) * 2.0**number
            yield part
            if not part.is_over and structure.problem.n <= MAX_HELD:
                suspended[i] = part
        if not suspended and number >= max(
            (row.first_round for row in phase), default=0
        ):
            return
