"""What auto does: its attempts take turns in rounds, search where M has no property
that helps, and a tree whose proofs are exact. What comes before a search: a few nodes
of the tree, the trivial solution, and exchanges from w = 0.
"""

import math
from itertools import count, groupby

import numpy as np
import pytest
from numpy.random import default_rng
from scipy import sparse
from scipy.sparse import block_array, block_diag, csr_array, identity

from lcpcli import Problem, Status, Trace, plan, run, solve
from lcpcli.auto import attempts as auto_table
from lcpcli.auto.attempts import (
    MAX_PIVOTED_BY_NUMPY,
    ROUNDS,
    AttemptRule,
    Structure,
    attempts_in_rounds,
)
from lcpcli.auto.policy import auto
from lcpcli.gallery import families
from lcpcli.linalg.patterns import has_friction
from lcpcli.methods import lemke
from lcpcli.methods.direct import MAX_PIVOTED
from lcpcli.methods.stages import (
    Finished,
    Iterate,
    MethodSequence,
    NoSolution,
)
from lcpcli.options import Limits
from lcpcli.solving import driver
from lcpcli.verify.certificate import Proof

from .planted import planted, solvable
from .stages import through

PROBLEM = families.make("harker-pang", 150)
STRUCTURE = Structure(PROBLEM, np.zeros(PROBLEM.n))


def counting(_):
    """Yield iterates for ever; their evaluations are 2, 4, 6, ..."""
    k = 0
    while True:
        k += 1
        yield Iterate(np.zeros(PROBLEM.n), None, "", 2 * k)


def row(name, begin, share=3, first_round=0):
    return AttemptRule(
        name, "", "", lambda _: True, begin, lambda _: share, first_round
    )


def turns_of(*rows):
    """Return the names of the turns with their numbers of iterates, and the turns."""
    taken, turns = [], MethodSequence(np.zeros(PROBLEM.n))
    for part in attempts_in_rounds(STRUCTURE, rows):
        taken.append((part.method, len(through(turns.run_part(part))[0])))
    return taken, turns


def test_attempts_go_on_in_rounds_with_doubled_shares():
    taken, turns = turns_of(row("a", counting), row("b", counting, 1))
    assert taken == [
        (name, share * 2**k)
        for k in range(ROUNDS)
        for name, share in (("a", 3), ("b", 1))
    ]
    assert turns.last.evaluations == 2 * sum(iterates for _, iterates in taken)


@pytest.mark.parametrize(
    "name",
    ["harker-pang", "bimatrix", "lp", "contact", "planted", "obstacle", "circuit"],
)
@pytest.mark.parametrize("n", [18, 500])
def test_the_route_of_a_run_is_a_part_of_its_plan(name, n):
    problem = families.make(name, min(n, {"bimatrix": 200, "planted": 60}.get(name, n)))
    planned = {attempt.method for attempt in plan(problem)} | {"auto"}
    inside = (
        {"krylov", "multilevel", "gradient"}
        if planned & {"sparse", "newton"}
        else set()
    )
    assert set(run(problem, trace=True).route) <= planned | inside


@pytest.mark.slow("takes 1500 iterations of all methods")
def test_iterations_of_all_rounds_count_and_a_method_stands_in_the_route_once():
    result = run(families.make("gaussian", 310), max_iterations=1500, trace=True)
    assert result.status.word == "iteration_limit"
    assert result.iterations == len(result.trace.rows) - 1 == 1500
    assert len(set(result.route)) == len(result.route)
    turns = [name for name, _ in groupby(row.method for row in result.trace.rows[1:])]
    assert turns.count("reflections") > 1


def gaussian(n, seed):
    random = default_rng(seed)
    return Problem(random.normal(size=(n, n)), random.normal(size=n))


@pytest.mark.parametrize("family", ["contact", "lp", "qp", "transport"])
def test_zeros_on_the_diagonal_call_for_lemke_or_where_costly_for_interior(family):
    small, large = (
        run(families.make(family, n), trace=True)
        for n in (MAX_PIVOTED_BY_NUMPY // 2, MAX_PIVOTED + 50)
    )
    assert small.solved
    assert small.route in [("lemke",), ("piqp",)]
    assert large.solved
    assert {"interior", "piqp"} & {*large.route} != set()
    assert "lemke" not in large.route


@pytest.mark.parametrize(
    ("shift", "form"), [(0.0, csr_array.toarray), (1e-6, csr_array)]
)
def test_contact_with_friction_goes_to_interior_in_any_order_and_regularized(
    shift, form
):
    contact = families.make("rigid-boxes", MAX_PIVOTED + 100)
    order = default_rng(0).permutation(contact.n)
    M = csr_array(contact.M) + shift * identity(contact.n)
    M, q = csr_array(M)[order][:, order], contact.q[order]
    result = run(Problem(form(M), q))
    assert result.solved
    assert result.route == ("interior",)


def test_the_blocks_of_friction_are_not_seen_where_they_are_not():
    contact = csr_array(families.make("rigid-boxes", 100).M)
    assert has_friction(contact)
    assert has_friction(contact.toarray())
    friction = contact.shape[0] - 1  # the row of the last cone
    own = contact.indices[contact.indptr[friction] : contact.indptr[friction + 1]]
    for change in (
        [(int(own[-1]), friction, 2.0)],  # not what the row has
        [(0, 1, 0.5)],  # A is not symmetric
        [(friction, friction - 1, 0.5)],  # two cones in one row
    ):
        M = contact.toarray()
        for i, j, value in change:
            M[i, j] += value
        assert not has_friction(M)
        assert not has_friction(csr_array(M))
    for family in ("lp", "qp", "circuit", "obstacle", "bimatrix", "harker-pang"):
        assert not has_friction(families.make(family, 60).M)


def test_attempts_that_the_direct_run_has_made_are_not_made_again(monkeypatch):
    made, lemke_stage = [], lemke.lemke_stage
    monkeypatch.setattr(
        lemke, "lemke_stage", lambda *given: made.append(given) or lemke_stage(*given)
    )
    result = run(families.make("ray", 21), trace=True)
    assert result.solved
    assert result.route[-1] == "milp"
    assert len(made) == 1


def test_pivots_that_return_to_a_singular_basis_end_at_a_solution_close_by(monkeypatch):
    """z_1 - z_2 = 1 with free z_1 and z_2, as of a circuit without a ground, and z_3 >=
    0 complementary to z_1 + z_3 - 2: rounding decides which z_1 an elimination returns
    with or without a basic z_3, here one that is infeasible by 1e-7 in both."""
    M = [[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 0.0, 1.0]]
    no_bound = [-np.inf, -np.inf, 0.0]
    problem = Problem(M, [-1.0, 1.0, -2.0], lower=no_bound)
    error = 1e-7
    below = np.array([2.0 - error, 1.0 - error, 0.0]), np.array([0.0, 0.0, -error])
    above = np.array([2.0 + error, 1.0 + error, -error]), np.zeros(3)

    def returning(_):
        for k in range(1, 20):
            z, w = (above, below)[k % 2]
            yield Iterate((z - w) / 2, None, "block", k, signs_final=False)
        return Finished()

    monkeypatch.setattr(auto_table, "usual_newton", returning)
    structure = Structure(problem, np.zeros(3))
    iterates, ending = through(auto_table.newton_while_fast(structure))
    assert isinstance(ending, Finished)
    assert len(iterates) == 4
    z = problem.box.z_of(iterates[-1].x)
    assert np.abs(problem.box.gaps(z, problem.w(z))).max() < 1e-14


def test_no_solution_is_sought_close_to_one_at_a_bound(monkeypatch):
    """z = (1, 0) with w = 0, whose basis is that of the iterate before the last one."""
    problem = Problem([[0.0, 1.0], [-1.0, 1.0]], [0.0, 1.0], upper=[2.0, 2.0])
    solution = np.array([1.0, 0.0])
    others = np.array([1.0, -1.0]), np.array([1.0, 1.0])

    def ending_at_solution(_):
        for k, z in enumerate((*others, solution), 1):
            yield Iterate(z / 2, None, "block", k, signs_final=z is solution)
        return Finished()

    monkeypatch.setattr(auto_table, "usual_newton", ending_at_solution)
    structure = Structure(problem, np.zeros(2))
    iterates, _ = through(auto_table.newton_while_fast(structure))
    assert len(iterates) == 3


def test_planted_solutions_are_found():
    result = run(Problem(*planted(80, 0)))
    assert result.solved
    assert result.route[-1] == "reflections"
    assert run(solvable("any", 48, default_rng(2))).solved


@pytest.mark.parametrize("seed", [100, 101, 103])
def test_random_problems_are_decided_and_infeasible_ones_without_a_search(seed):
    result = run(gaussian(20 + seed % 2 * 10, seed), time_limit=60)
    assert result.solved or result.status.has_no_solution
    assert result.status is not Status.INFEASIBLE or "reflections" not in result.route


def test_a_solution_that_rounding_hides_from_a_linear_program_is_found():
    """x_1 = 2^25, where the terms of a row are 3e7 times their sum: the LP finds a
    proof up to rounding first."""
    eps, small, k = 2.0**-52, 2.0**-27, 150
    A = block_diag([[[1 + eps, -1], [-1, 1]], identity(k)])
    b, c = np.ones(k + 2), np.ones(k + 2)
    b[1], c[:2] = small - 1, 0
    result = run(
        Problem(csr_array(block_array([[None, -A.T], [A, None]])), np.append(c, -b))
    )
    assert result.solved


def test_a_few_nodes_prove_that_there_is_no_solution_before_a_search():
    """Also where the problem is feasible, but each complementary set is excluded."""
    results = [run(families.make("gaussian", 40, seed)) for seed in (0, 3)]
    assert [result.status for result in results] == 2 * [Status.UNSOLVABLE]
    assert all(
        result.route[-1] == "milp" and "reflections" not in result.route
        for result in results
    )
    plans = [
        plan(families.make(name, 40)) for name in ("gaussian", "harker-pang", "boxes")
    ]
    has_few = ["a few nodes" in [attempt.part for attempt in each] for each in plans]
    assert has_few == [True, False, False]


def test_the_trivial_solution_is_seen_at_once_unless_the_run_has_a_start():
    problem = families.make("ben-gharbia-gilbert", 51)
    assert problem.x0 is not None
    result = run(problem)
    assert result.solved
    assert result.evaluations == 0
    assert np.count_nonzero(result.z) == 0
    assert run(problem, x0=np.ones(problem.n)).evaluations > 0


@pytest.mark.parametrize(("n", "form"), [(400, np.asarray), (800, csr_array)])
def test_chains_and_trees_of_zeros_take_one_system(n, form):
    """Each q_i but those of a few roots is 0: from q < 0, each step finds the children
    of the last variables."""
    random = default_rng(n)
    for parents in (
        np.arange(n) - 1,
        np.array([int(random.integers(0, max(i, 1))) for i in range(n)]),
    ):
        M = np.eye(n)
        q = np.zeros(n)
        roots = [0, *random.integers(1, n, size=3).tolist()]
        M[np.arange(1, n), parents[1:]] = -(10.0 ** random.uniform(-3, 3, size=n - 1))
        M[roots] = np.eye(n)[roots]
        q[roots] = -(10.0 ** random.uniform(-3, 3, size=len(roots)))
        result = run(Problem(form(M), q))
        assert result.solved
        assert result.iterations == 1


def test_sparse_infeasible_problems_are_proved_so():
    """Without entries, with a row of zeros, and the Laplacian of a line, whose columns
    sum to zero, with a load that has nowhere to go."""
    n = 130
    differences = sparse.csr_array(np.eye(n - 1, n, k=1) - np.eye(n - 1, n))
    neumann = differences.T @ differences
    for M in (
        sparse.csr_array((n, n)),
        sparse.diags_array(np.minimum(np.arange(n), 1.0)).tocsr(),
        neumann,
    ):
        assert run(Problem(M, -np.ones(n))).status is Status.INFEASIBLE


# In the lines that its version 1.16 prints once in a process.
OF_HIGHS = ("HiGHS", "THIRD_PARTY_NOTICES")


def test_structurally_singular_blocks_print_nothing(capfd):
    generator = default_rng(3)
    M = sparse.csr_array(sparse.random_array((300, 300), density=0.01, rng=generator))
    run(Problem(M, generator.standard_normal(300)), time_limit=1.0)
    printed = capfd.readouterr().out.splitlines()
    assert not [line for line in printed if not any(word in line for word in OF_HIGHS)]


def test_units_near_the_ends_of_double_range_do_not_look_like_divergence():
    M = [[0, 0, -2e41], [2e-111, -1e-111, -1e-111], [2e113, 1e113, 0]]
    assert run(Problem(M, [8e41, 4e-111, -2e113])).solved


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
def test_scale_and_finish_are_added_to_the_literal_methods_in_the_open(method):
    generator = default_rng(5)
    factor = generator.standard_normal((20, 20))
    M, q = factor @ factor.T + 20 * np.eye(20), generator.standard_normal(20)
    plain, scaled = (
        solve(M, q, method, scale=scale, max_iterations=20000)
        for scale in (False, True)
    )
    ticks, trace = count(), Trace()
    # So that the time for tries is the same every time.
    limits, clock = Limits(tol=1e-13), lambda: float(next(ticks))
    added = {"scale": True, "finish": True}
    finished = driver.run(
        Problem(M, q), method, **added, limits=limits, trace=trace, clock=clock
    )
    assert scaled.solved
    assert scaled.iterations < plain.iterations
    assert finished.solved
    assert trace.rows[-1].step == "finish"
    assert (finished.options["scale"], finished.options["finish"]) == (True, True)


@pytest.mark.parametrize(
    "claim",
    [Finished(), NoSolution(Proof("farkas", np.ones(PROBLEM.n), is_rounded=True))],
    ids=["of a solution", "of a proof up to rounding"],
)
def test_a_row_that_is_added_is_tried_and_shown_and_its_claim_is_not_believed(
    claim, monkeypatch
):
    """The first two rows of all end at a point that is no solution, and at one that is
    known beforehand."""
    problem = families.make("planted", 150)
    z = problem.box.project(np.asarray(problem.solutions[0]))

    def ending_at(z):
        yield Iterate(problem.box.x_of(z, problem.w(z)), None, "", 1)
        return Finished() if z.any() else claim

    liar, known = (
        row(*each, math.inf)
        for each in (
            ("liar", lambda _: ending_at(0 * z)),
            ("known", lambda _: ending_at(z)),
        )
    )
    new = (liar, known._replace(reason="it is known"))
    monkeypatch.setattr(auto_table, "FIRST", (*new, *auto_table.FIRST))
    result = run(problem)
    assert result.solved
    assert result.route[-1] == "known"
    assert plan(problem)[1] == ("known", "", None, "it is known")
    iterates, ending = through(auto(problem, np.zeros(problem.n)))
    assert isinstance(ending, Finished)
    assert iterates[-1].method == "known"
