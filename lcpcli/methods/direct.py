"""Block pivoting on a dense LCP with few unknowns, whose answer is tested at once.

For few unknowns a step of `newton` takes less time than what a run does around it. So
`auto` first makes the same steps in as few operations as possible, and continues only
where these do not lead to a solution that is certain. The pivots are those of `newton`,
and the test is the first bound of `Measure.surely_solves`.

The safeguard is single pivots on the least index, once block pivots do not advance: J.
J. Júdice and F. M. Pires, A block principal pivoting algorithm for large-scale strictly
monotone linear complementarity problems, Computers & Operations Research 21 (1994)
587-596, after K. G. Murty, Opsearch 11 (1974) 123-130.

`direct_many` does the same for many dense problems, each with its M, all at once.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import fields
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import ROUNDED_ZERO, ROW_ROUNDING, number_of, row_sizes
from lcpcli.linalg.factors import each_product, principal_inverses
from lcpcli.linalg.matrices import (
    TINY_TERMS,
    is_narrow,
    is_sparse,
    may_be_stiff,
    row_errors,
)
from lcpcli.model.box import BASIC, Box
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Indices, Mask, Matrix, Vector
from lcpcli.verify.final_states import (
    HIDDEN_TERM,
    LONG_NUMBER,
    are_signs_clear,
    hides_term_of_row,
    may_hide_term,
    verified_or_exact,
    without_rounding,
)
from lcpcli.verify.measure import FEW_UNKNOWNS, FINEST, Measure, least_cap, least_caps
from lcpcli.verify.point import Point

MAX_UNKNOWNS = 100
# Unknowns up to which Lemke's path is followed before any method but newton is run.
MAX_PIVOTED = 300
# Unknowns up to which a narrow band is stored as a dense matrix; its sparse factors
# cost little.
MAX_NARROW_AS_DENSE = 150
# A band is full if its size is at most this multiple of the entries of M, as for
# problems in one dimension.
MAX_OF_BAND = 1.5
# Unknowns up to which all methods but interior use a dense M, in whatever form M is
# stored.
MAX_AS_DENSE = 400
# Fraction of nonzero entries of a dense M up to which sparse factors may cost less, for
# moderate and for large n.
MAX_FILLED, MAX_FILLED_LARGE = 0.1, 0.01
# A full band with so few entries has none beyond an eighth of the unknowns from the
# diagonal.
FAR_FROM_DIAGONAL = 8
# Unknowns of a program from which on PIQP takes less time than pivoting.
MIN_FOR_PIQP = 50
# Unknowns of a mixed problem up to which Lemke's path is followed first if compiled.
MAX_COMPILED = 400
# Answers of kernels: none, one to be tested, a solution up to a proved rounding bound,
# or one with a row in which rounding may hide a term.
NOTHING = 0
CANDIDATE = 1
CERTAIN = 2
DOUBTFUL = 3
# The infeasible fraction at a start: above it, the basis is not close to that of a
# solution.
MAX_WRONG = 0.25
# Steps on many problems at once, before the remaining ones are solved one by one.
MAX_STEPS = 12
# Block pivots without a new minimum of infeasibilities, before single pivots.
BLOCK_PATIENCE = 10
# The infeasible fraction, and block pivots without a new minimum: above that fraction,
# as at random bases, more than a few pivots do not lead to a solution.
MANY_WRONG, HASTY_PATIENCE = 0.25, 3
# Single pivots where Lemke's path or interior follows: they may take 2^n.
FEW_INDEX_STEPS = 5

Made: TypeAlias = tuple[Vector, Vector, bool]
"""The z and w of a basic solution, each of shape (n,), and whether a single pivot led
to it."""


class DirectAnswer(NamedTuple):
    """A basic solution without infeasibilities, which may solve the problem.

    z : shape (n,). is_certain : whether z solves the problem, whatever the rounding
    errors in w are; if not, it has to be tested. steps : how many basic solutions were
    computed. method : the method that did. evaluations : as this method counts them.
    end : the basis, if z does not show it. point : z with its measures, if they are
    known.
    is_single : whether a single pivot led to it. is_clear : whether rounding is known
    to hide no term of a row that matters.
    """

    z: Vector
    is_certain: bool
    steps: int
    method: str = "newton"
    evaluations: int | None = None
    end: BasisStatus | None = None
    point: Point | None = None
    is_single: bool = False
    is_clear: bool = False


def safeguarded(
    min_count: Any, steps_left: Any, single_pivots_left: Any, single: Any, count: Any
) -> tuple[Any, Any, Any, Any]:
    """Return the safeguard after a step with `count` infeasibilities: their minimum so
    far, the remaining steps without a new minimum before a single pivot, and the fields
    of `Safeguard`. For one problem or, in arrays, for m; it is compiled as well."""
    fewer = count < min_count
    others = fewer ^ True
    steps_left = fewer * BLOCK_PATIENCE + others * (steps_left - 1)
    spent = steps_left < 1
    return (
        fewer * count + others * min_count,
        steps_left + spent,
        single_pivots_left - spent,
        (single | spent) & others,
    )


def is_hopeless(min_count: int, steps_left: int, n: int) -> bool:
    """Return whether one problem with n unknowns has had so many infeasibilities in all
    steps that pivots rarely lead to a solution."""
    return bool(
        min_count > MANY_WRONG * n and steps_left <= BLOCK_PATIENCE - HASTY_PATIENCE
    )


class Safeguard:
    """The choice of the next pivot: on all infeasibilities while their number reaches
    new minima, and only on the first one after BLOCK_PATIENCE steps without a new
    minimum.

    left : how many more single pivots may be made; negative once there were too many.
    single : whether the next pivot is a single one. For m problems both are of shape
    (m,) after the first step.
    """

    def __init__(self, n: int, patience: float) -> None:
        self._min_count: Any = n + 1
        self._steps_left: Any = BLOCK_PATIENCE
        self.left: Any = patience
        self.single: Any = False

    def choose(self, wrong: Mask, count: Any) -> bool:
        """Leave only the indices of the next pivot in `wrong`; `count` is the number of
        relevant infeasibilities, shape (m,) for m problems. Return whether it is a new
        minimum of one problem."""
        # As `safeguarded` does, in a tenth of the time.
        if wrong.ndim == 1 and count < self._min_count:
            self._min_count = count
            self._steps_left = BLOCK_PATIENCE
            self.single = False
            return True
        state = self._min_count, self._steps_left, self.left, self.single
        self._min_count, self._steps_left, self.left, self.single = safeguarded(
            *state, count
        )
        if wrong.ndim == 2:
            rows = self.single.nonzero()[0]
            first = wrong[rows].argmax(axis=1)
            wrong[rows] = False
            wrong[rows, first] = True
            return False
        if self.single:
            wrong[wrong.nonzero()[0][1:]] = False
        return False

    def is_hopeless(self, n: int) -> bool:
        """Return whether further pivots rarely lead to a solution of one problem with n
        unknowns."""
        return is_hopeless(self._min_count, self._steps_left, n)

    def keep(self, rows: Indices) -> None:
        """Continue with only these of the m problems."""
        self._min_count = self._min_count[rows]
        self._steps_left = self._steps_left[rows]
        self.left, self.single = self.left[rows], self.single[rows]


FIELDS = {field.name for field in fields(Problem)}


def as_dense(problem: Problem) -> Problem:
    """Return the problem with M dense, without its origin if M was not."""
    if not is_sparse(problem.M):
        return problem
    dense = with_M(problem, matrices.dense(problem.M))
    return dense if problem.origin is None else dense.having(origin=None)


def with_M(problem: Problem, M: Matrix) -> Problem:
    """Return the problem with its M in another form, and what has been computed of M in
    either one."""
    if M is problem.M:
        return problem
    return Problem.of_fields(
        {name: value for name, value in vars(problem).items() if name in FIELDS},
        M=M,
        facts=problem.facts.in_other_form(M),
        reference_z=problem.reference_z,
        q_ref=problem.q_ref,
        q_error=problem.q_error,
    )


def may_be_program(problem: Problem) -> bool:
    """Return whether PIQP is installed and comes before other methods, for so many
    unknowns that it takes less time than pivoting: for a sparse M, or that of a
    program, with zeros on the diagonal, as constraints have them, or for a band that
    may be stiff."""
    M = problem.M
    if problem.n < MIN_FOR_PIQP:
        return False
    block_form = problem.block_form
    is_bounded_only = block_form is not None and problem.n == block_form.variables
    if not is_sparse(M) and (is_bounded_only or block_form is None):
        return False
    with imports:
        from lcpcli.linalg.programs import has_piqp
    if not has_piqp():
        return False
    if not M.diagonal().all():
        return not is_bounded_only
    return is_sparse(M) and is_narrow(M) and may_be_stiff(M)


def stored(M: Matrix) -> Matrix:
    """Return M in the form whose route takes less time: in compressed rows if it has
    few entries, and is large or a band."""
    n, far = M.shape[0], M.shape[0] // FAR_FROM_DIAGONAL
    if is_sparse(M) or n <= MAX_NARROW_AS_DENSE:
        return M
    if n > MAX_AS_DENSE:
        return matrices.thinned(M, MAX_FILLED_LARGE * n**2)
    if (
        M[0, far:].any()
        or M[-1, :-far].any()
        or M[n // 2, : n // 2 - far].any()
        or M[n // 2, n // 2 + far :].any()
    ):
        return M  # a few rows show that M is no band, in microseconds
    thin = matrices.thinned(M, MAX_FILLED * n**2)
    return thin if is_full_band(thin) else M


def is_full_band(M: Matrix) -> bool:
    """Return whether M is a full band, sparse and narrow, of so many unknowns that its
    sparse factors are used."""
    return (
        is_sparse(M) and M.shape[0] > MAX_NARROW_AS_DENSE and is_narrow(M, MAX_OF_BAND)
    )


def applies(problem: Problem) -> bool:
    """Return whether a problem is an LCP with few unknowns and moderate numbers."""
    is_moderate = problem.n <= MAX_UNKNOWNS and problem.is_moderate
    return is_moderate and problem.box.is_orthant


def basic_zeros(problem: Problem) -> Mask | None:
    """Return q <= 0 as the first basic variables if some q_i are 0, and their rows of M
    have no positive entry but on the diagonal: then w_i <= q_i for z_i = 0, and from q
    < 0 pivots reach one unknown after another along chains and trees of zeros. Else
    None."""
    M, q = problem.M, problem.q
    if not number_of(q == 0.0) or not number_of(q < 0.0):
        return None
    basic = q <= 0.0
    # The first such row excludes almost all other problems, before rows are copied.
    if not is_sparse(M) and number_of(M[basic.argmax()] > 0.0) > 1:
        return None
    if not problem.box.is_orthant or not M.diagonal().min(initial=1.0) > 0:
        return None
    rows = M if basic.all() else M[basic]
    entries = rows.data if is_sparse(rows) else rows
    has_others = np.count_nonzero(entries > 0) > np.count_nonzero(basic)
    return None if has_others else basic


def without_doubtful_terms(
    problem: Problem, answer: DirectAnswer
) -> DirectAnswer | None:
    """Return an answer of block pivoting whose rows may hide a term if it is a solution
    in spite of rounding; else the solution with its basis that is verified, or None if
    it may have to be replaced by an exact one, as `small` does for few unknowns."""
    verified_point = verified_or_exact(problem, answer.z)
    if verified_point is None or verified_point.z is answer.z:
        return None if verified_point is None else answer
    return answer._replace(
        z=verified_point.z, is_certain=False, end=verified_point.basis
    )


def exchanges(
    problem: Problem, tol: float, basic: Mask | None = None
) -> Generator[Made, None, DirectAnswer | None]:
    """Yield the basic solutions of block principal pivoting, but for the last one, if
    it is returned as an answer; return None if pivoting meets a singular M_PP or takes
    too many steps. It starts from `basic` or, if that is None or not close to the basis
    of a solution, from q < 0, as `newton` does in `auto`. Infinite numbers may occur:
    the caller ignores numpy's errors."""
    M = problem.M
    q = problem.q
    n = problem.n
    minus_q = -problem.q
    is_start, basic = basic is not None, q < 0.0 if basic is None else basic.copy()
    guard, last = Safeguard(n, FEW_INDEX_STEPS), None
    steps, is_single = 0, False
    while True:
        P = basic.nonzero()[0]
        z = np.zeros(n)
        if not P.size:
            wrong = q < 0.0
            if not number_of(wrong):
                return DirectAnswer(z, True, steps, is_clear=True)
            w, is_start = q, False
        else:
            # These functions take a fraction of the time of operators.
            block = M.take(P, 0).take(P, 1)
            try:
                z[P] = np.linalg.solve(block, minus_q[P])
            except np.linalg.LinAlgError:
                if not is_start:
                    return None
                is_start, basic = False, q < 0.0
                continue
            w = M.dot(z)
            w += q
            residual = w[P]
            w[P] = 0.0
            wrong = np.minimum(z, w) < 0.0
        steps += 1
        solution = z, w, is_single
        count = number_of(wrong)
        if is_start and count > MAX_WRONG * n:
            yield solution
            is_start, basic = False, q < 0.0
            continue
        is_start = False
        if not count:
            system = P, block, residual
            return _refined_and_tested(problem, solution, system, steps, tol)
        if not guard.choose(wrong, count):
            is_same = last is not None and np.array_equal(wrong, last)
            if is_same and is_rounding(problem, z, w):
                answer = DirectAnswer(np.maximum(z, 0.0), False, steps)
                return answer._replace(is_single=is_single)
            if _gives_up(guard, problem):
                yield solution
                return None
        yield solution
        is_single, last = guard.single, wrong
        basic ^= wrong


def exchanges_within_bounds(
    problem: Problem, tol: float
) -> Generator[Made, None, DirectAnswer | None]:
    """Yield the basic solutions of block principal pivoting on a mixed problem, from
    the basis of the reference point, as on an LCP. Its answer may have to be tested;
    where violations may be rounding, it returns None, so that `newton` decides."""
    M = problem.M
    q = problem.q
    box = problem.box
    reference = 0.0 if problem.reference_z is None else problem.reference_z
    lower, upper = box.lower, box.upper
    t = reference - problem.q_ref
    is_upper = t >= upper
    basic = (t > lower) > is_upper
    has_fixed = number_of(box.fixed) > 0
    if has_fixed:
        is_upper[box.fixed] = False
    n_upper = number_of(is_upper)
    guard, steps = Safeguard(q.size, FEW_INDEX_STEPS), 0
    is_single = False
    while True:
        P, z = basic.nonzero()[0], np.zeros(q.size)
        block, start = M.take(P, 0).take(P, 1), q[P]
        if n_upper or not box.has_zero_lower:
            z = np.where(basic, z, np.where(is_upper, upper, lower))
            if n_upper or number_of(z != 0.0):
                start = start + M.dot(z)[P]
        try:
            z[P] = np.linalg.solve(block, -start)
        except np.linalg.LinAlgError:
            return None
        w = M.dot(z)
        w += q
        residual = w[P]
        w[P] = 0.0
        # Basic variables violate bounds; the others violate the sign condition on w.
        signed = np.where(is_upper, w, -w) if n_upper else -w
        if has_fixed:  # whose w may have any sign
            signed[box.fixed] = 0.0
        violations = np.maximum(np.maximum(lower - z, z - upper), signed)
        wrong = violations > 0.0
        steps, count = steps + 1, number_of(wrong)
        if not count:
            is_sure = _refine_within_bounds(problem, z, P, block, residual, tol)
            nearest = z if is_sure else box.project(z)
            return DirectAnswer(nearest, is_sure, steps, is_single=is_single)
        yield z, w, is_single
        if not guard.choose(wrong, count) and _gives_up(guard, problem):
            return None
        if _may_be_rounding(problem, z, violations):
            return None
        basic ^= wrong
        above = z > upper
        if n_upper or number_of(above):
            is_upper = np.where(wrong, above, is_upper)
            n_upper = number_of(is_upper)
        is_single = guard.single


def _may_be_rounding(problem: Problem, z: Vector, violations: Vector) -> bool:
    """Return whether violations are within a bound on the rounding errors of all rows,
    without reading M."""
    max_magnitude = problem.largest * sum(map(abs, z.tolist()))
    max_magnitude += problem.sizes_of_q[1]
    return bool(max(violations.tolist()) <= ROW_ROUNDING * max_magnitude)


def _refine_within_bounds(
    problem: Problem, z: Vector, P: Indices, block: Vector, residual: Vector, tol: float
) -> bool:
    """Overwrite z by a refined one if its residual w_P is more than rounding; else
    return whether z is proved to solve the problem."""
    size = np.abs(problem.q)
    row_magnitudes = np.abs(problem.M).dot(np.abs(z))
    row_magnitudes += size
    errors = ROW_ROUNDING * row_magnitudes
    residual_sizes = np.abs(residual)
    if number_of(residual_sizes > errors[P]):
        z[P] -= np.linalg.solve(block, residual)
        return False
    if problem.reference_z is not None:
        size = np.minimum(np.abs(problem.q_ref), FINEST * row_magnitudes)
    return _is_sure(min(size.tolist()), errors, residual_sizes, tol)


def _gives_up(guard: Safeguard, problem: Problem) -> bool:
    """Return whether Lemke's path or interior is to follow."""
    if guard.left < 0 or guard.is_hopeless(problem.n):
        return True
    return guard.single and bool(problem.M.diagonal().min() <= 0.0)


def _refined_and_tested(
    problem: Problem,
    solution: Made,
    system: tuple[Indices, Vector, Vector],
    steps: int,
    tol: float,
) -> DirectAnswer:
    """Return the answer of block pivoting for a basic solution, whose z is refined
    once, and overwritten, if its residual w_P is more than rounding, w being 0 there.

    system : the indices P, M_PP and the residual."""
    z, w, is_single = solution
    P, block, residual = system
    M, q = problem.M, problem.q
    size, absolute = np.abs(q), np.abs(M)
    row_magnitudes = absolute.dot(z)
    row_magnitudes += size
    errors, violations = ROW_ROUNDING * row_magnitudes, np.abs(residual)
    if number_of(violations > errors[P]):
        z[P] -= np.linalg.solve(block, residual)
        np.maximum(z, 0.0, out=z)
        w = M.dot(z)
        w += q
        residual = w[P]
        row_magnitudes = absolute.dot(z)
        row_magnitudes += size
    elif _is_sure(min(size.tolist()), errors, violations, tol) or (
        # The violations and errors of each row are then at most tol times its terms.
        tol >= 2 * ROW_ROUNDING
        and _is_sure(least_cap(problem, absolute), errors, violations, tol)
    ):
        is_clear = not may_hide_term(problem, z)
        if not is_clear:
            w[P] = np.inf
            violations += errors[P]
            scaled = block * z[P]
            is_clear = are_signs_clear(problem, scaled, violations, w, row_magnitudes)
        return DirectAnswer(z, True, steps, is_single=is_single, is_clear=is_clear)
    np.negative(w, out=w)
    w[P] = np.abs(residual)
    w += row_errors(M, z, row_magnitudes)
    undecided_rows = np.logical_not(w <= tol * size).nonzero()[0]
    is_small = _are_small(problem, z, w, row_magnitudes, undecided_rows, tol)
    return DirectAnswer(z, is_small, steps, is_single=is_single)


def _is_sure(min_size: float, errors: Vector, violations: Vector, tol: float) -> bool:
    """Return whether violations, of basic rows, and rounding errors in w are together
    at most tol times a size that the caps of all rows reach.

    errors : ROW_ROUNDING times the magnitudes of the rows."""
    row_errors = errors.tolist()
    max_error = max(row_errors) + max(violations.tolist(), default=0.0)
    return bool(
        min(row_errors) > ROW_ROUNDING * TINY_TERMS and max_error <= tol * min_size
    )


def _are_small(
    problem: Problem,
    z: Vector,
    worst: Vector,
    row_magnitudes: Vector,
    rows: Indices,
    tol: float,
) -> bool:
    """Return whether the violations of some rows are proved to be at most tol times the
    magnitudes of the rows and times their caps. The caps are bounded without the
    scaling of M, or read from it if it has been computed; otherwise return False.

    worst : upper bounds on the violations of all rows. rows : those in which `worst`
        is not at most tol |q_i|, as where q_i is 0."""
    if not rows.size:
        return True
    worst, row_magnitudes = worst[rows], row_magnitudes[rows]
    if number_of(worst <= tol * row_magnitudes) < rows.size:
        return False
    caps = least_caps(problem, -problem.q, rows)
    if caps is None and "units" in vars(problem.facts):
        caps = Measure(problem).caps(z)[rows]
    return caps is not None and number_of(worst <= tol * caps) == rows.size


def is_rounding(problem: Problem, z: Vector, w: Vector) -> bool:
    """Return whether the negative entries of z and w may be rounding of 0, and no row
    of few unknowns hides a term."""
    row_magnitudes = np.abs(problem.M) @ np.abs(z) + np.abs(problem.q)
    if (
        np.maximum(-w, 0.0) > ROW_ROUNDING * row_magnitudes
    ).any() or -z.min() > ROUNDED_ZERO * z.max():
        return False
    return problem.n > FEW_UNKNOWNS or not hides_term_of_row(
        problem, without_rounding(z)
    )


@np.errstate(all="ignore")
def direct_many(
    M: Vector, q: Vector, largest: Vector, tol: float, box: Box
) -> tuple[Vector, Indices]:
    """Solve m problems at once by block pivoting. Return z for each, shape (m, n), and
    what it is, NOTHING, CANDIDATE or CERTAIN, with the number of steps, shape (m, 2).

    M, q, largest : shapes (m, n, n), (m, n) and (m,): the matrices, and their largest
        |M_ij|.
    box : the bounds, of shape (m, n) unless they are z >= 0.
    """
    Z, answers = np.zeros(q.shape), np.zeros((len(q), 2), dtype=np.intp)
    rows, start = np.arange(len(q)), np.broadcast_to(box.corner, q.shape)
    basis = box.basis_of((start - q - each_product(M, start)) / 2)
    for steps in range(1, MAX_STEPS + 1):
        basic, z = basis == BASIC, box.nonbasic(basis)
        inverse = principal_inverses(M, basic)
        z = z - each_product(inverse, each_product(M, z) + q)
        w = np.where(basic, 0.0, each_product(M, z) + q)
        wrong = box.wrong(z, w, basis)
        regular = np.isfinite(z.sum(axis=1) + w.sum(axis=1))
        done = regular & ~wrong.any(axis=1)
        if done.any():
            finished_problems = M[done], q[done], box.part(done)
            refined_z = z[done] - each_product(
                inverse[done],
                each_product(finished_problems[0], z[done]) + finished_problems[1],
            )
            answers[rows[done], 0], Z[rows[done]] = _test_rows(
                *finished_problems, refined_z, largest[rows[done]], tol
            )
            answers[rows[done], 1] = steps - ~basic[done].any(axis=1)
        going = (regular & ~done).nonzero()[0]
        if not going.size:
            break
        basis = box.exchanged(basis, wrong, z)[going]
        rows = rows[going]
        M = M[going]
        q = q[going]
        box = box.part(going)
    return Z, answers


def _test_rows(
    M: Vector, q: Vector, box: Box, z: Vector, largest: Vector, tol: float
) -> tuple[Indices, Vector]:
    """Project each z, a basic solution, on its bounds; return whether it is NOTHING, a
    CANDIDATE or CERTAIN, shape (m,), and this z."""
    z = box.project(z)
    absolute = np.abs(M)
    sizes = np.abs(q)
    w = each_product(M, z) + q
    row_magnitudes = each_product(absolute, np.abs(z)) + sizes
    min_magnitudes = row_magnitudes
    for reference in (
        (0.0,) if box.is_orthant else (box.project(np.zeros(q.shape)), box.corner)
    ):  # the reference point is one of these
        at = np.broadcast_to(reference, q.shape)
        rounding = ROW_ROUNDING * (each_product(absolute, np.abs(at)) + sizes)
        min_magnitudes = np.minimum(
            min_magnitudes, np.abs(each_product(M, at) + q) - rounding
        )
    surely = box.excess(z, w) + ROW_ROUNDING * row_magnitudes <= tol * min_magnitudes
    is_zero = ~z.any(axis=1) & box.is_orthant
    kinds = np.where(
        is_zero | (surely & (row_magnitudes > TINY_TERMS)).all(axis=1),
        CERTAIN,
        CANDIDATE,
    )
    if q.shape[1] <= FEW_UNKNOWNS:  # as in `final_states.is_doubtful`
        (smallest_z, largest_z), (smallest_q, largest_q) = row_sizes(z), row_sizes(q)
        largest_term = np.maximum(largest * largest_z, largest_q)
        hidden = (
            np.minimum(largest * smallest_z, smallest_q) < HIDDEN_TERM * largest_term
        )
        kinds[hidden | (np.maximum(largest, largest_q) > LONG_NUMBER)] = NOTHING
    return kinds, z
