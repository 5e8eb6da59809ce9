"""Problems near each other, by a Solver of one M, as steps of a sequence, or as columns
of Q for a sparse M: the verdicts of separate runs, from the states and factors of the
last one."""

import pickle

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import csr_array, diags_array

import lcpcli
from lcpcli import Problem, Solver, run, solve_many
from lcpcli.errors import OptionError
from lcpcli.gallery import families
from lcpcli.linalg import factors

FAMILIES = {
    "harker-pang": 30,
    "contact": 48,
    "obstacle": 400,
    "boxes": 40,
    "circuit": 60,
    "american-put": 500,
}
FAMILIES |= {"qp": 50, "spatial-prices": 48, "portfolio": 40}
UNIQUE = ("harker-pang", "obstacle", "american-put")  # whose solutions are unique


def steps(family, changing, number):
    """Yield problems near each other, with the same M or a slightly changed one;
    entries of q that are 0 remain 0."""
    random = default_rng(0)
    like = families.make(family, FAMILIES[family])
    q, size = np.array(like.q), 1.0
    for k in range(number):
        own = {
            "lower": like.lower,
            "upper": like.upper,
            "name": f"step {k}",
            "names": like.names,
        }
        yield Problem(size * like.M, q, **own)
        q = q + 0.02 * abs(like.q) * random.normal(size=q.size)
        size *= 1 + 1e-3 * changing


@pytest.mark.parametrize("family", FAMILIES)
def test_a_sequence_has_the_results_of_separate_runs(family):
    same, changing = list(steps(family, False, 3)), list(steps(family, True, 2))
    solver = Solver(same[0].M, lower=same[0].lower, upper=same[0].upper)
    for problems, results in (
        (same, [solver.solve(problem.q) for problem in same]),
        (same, list(solve_many(same, sequence=True))),
        (changing, list(solve_many(changing, sequence=True))),
    ):
        for problem, result in zip(problems, results, strict=True):
            alone = run(problem)
            assert result.status == alone.status
            assert result.problem.q.tolist() == problem.q.tolist()
            assert (
                not result.solved
                or run(problem, z0=result.z).relative_residual <= 1e-10
            )
            if family in UNIQUE:
                assert np.abs(result.z - alone.z).max() <= 1e-9 * np.abs(alone.z).max()


@pytest.mark.usefixtures("way")
def test_a_step_after_z_0_has_its_own_solution_if_its_q_has_a_negative_entry():
    solver = Solver([[2, 1], [1, 2]])
    assert solver.solve([10, 1]).z.tolist() == [0, 0]
    assert solver.solve([10, -1]).z.tolist() == [0, 0.5]
    assert run(
        Problem([[2, 1], [1, 2]], [10, -1]), basis=["lower", "lower"]
    ).z.tolist() == [0, 0.5]


def test_bounds_and_m_may_change_from_step_to_step():
    solver = Solver([[2, 1], [1, 2]])
    assert solver.solve([-5, -6]).z == pytest.approx([4 / 3, 7 / 3])
    assert solver.solve([-5, -6], upper=2).z == pytest.approx([1.5, 2.0])
    assert solver.solve([-5, -6], lower=[None, 0], upper=[1, 5]).z == pytest.approx(
        [1, 2.5]
    )
    for M in ([[4, 0], [0, 4]], csr_array([[4.0, 0], [0, 4]])):
        solver.update(M)
        assert solver.solve([-5, -6]).z == pytest.approx([1.25, 1.5])
    solver.update([[4]])
    assert solver.solve([-2]).z == pytest.approx([0.5]), (
        "without states of another shape"
    )


def test_bounds_of_one_number_each_stay_for_a_matrix_of_another_shape():
    solver = Solver([[2, 1], [1, 2]], lower=-1, upper=1e20, infinity=1e20)
    assert solver.solve([-5, 6]).z.tolist() == [3, -1]
    assert solver.solve([-5, 6], upper=1e20).problem.upper.tolist() == [np.inf] * 2
    solver.update(np.eye(3))
    assert solver.solve([-5, 6, 0]).z.tolist() == [5, -1, 0]


def test_a_solver_uses_the_kernels_unless_that_is_declined(way):
    if way == "compiled":
        pytest.importorskip("numba")
    M, q = [[2, 1], [1, 2]], [-5, -6]
    for compiled in (None, True, False):
        if compiled and way == "numpy":
            with pytest.raises(OptionError, match="compiled: needs numba"):
                Solver(M, compiled=compiled)
            continue
        result = Solver(M, compiled=compiled).solve(q)
        assert result.z == pytest.approx([4 / 3, 7 / 3])
        uses_them = compiled is not False and way == "compiled"
        assert result.options.get("compiled", False) is uses_them


GOOD = Problem([[2, 1], [1, 2]], [-5, -6])


def test_limits_hold_for_every_step():
    problem, limits = families.make("murty", 12), {"max_iterations": 3}
    (result,) = solve_many([problem], sequence=True, **limits)
    step = Solver(problem.M, **limits).solve(problem.q)
    assert result.status is step.status is run(problem, **limits).status


def test_solve_many_takes_q_from_a_generator_that_needs_the_last_z():
    M, last = np.array([[3.0, -1.0], [-1.0, 3.0]]), [np.zeros(2)]
    for result in solve_many(M, (np.array([-1.0, -2.0]) - last[-1] for _ in range(5))):
        assert result.solved
        last.append(result.z)
    assert M @ last[-1] - last[-1] == pytest.approx([1, 2], rel=0.2)


def tridiagonal(below, diagonal, above, n):
    return diags_array(
        [below, diagonal, above], offsets=[-1, 0, 1], shape=(n, n)
    ).tocsr()


@pytest.mark.parametrize(
    "turn", [1, -1], ids=["basic variables last", "basic variables first"]
)
def test_tridiagonal_m_matrices_are_eliminated_from_the_end_that_is_basic(turn):
    n = 400
    M, q = tridiagonal(-1.2, 2.5, -1, n), np.linspace(1, -2, n)[::turn]
    if turn < 0:
        M = M.T.tocsr()
    eliminated, alone = Solver(M).solve(q), run(Problem(M, q))
    assert eliminated.solved
    assert eliminated.route == ("elimination",)
    assert eliminated.z == pytest.approx(alone.z, rel=1e-12)
    assert eliminated.basis == alone.basis
    # Basic variables at neither end; then matrices that are no M-matrices.
    scattered = np.cos(np.linspace(0, 20, n))
    for below, above in ((-1, -1), (1, 1), (-1, 1), (1, -1)):
        other = Solver(tridiagonal(below, 2.1, above, n)).solve(scattered)
        assert other.solved
        assert (other.route == ("elimination",)) == (below < 0 > above)


def test_steps_begin_with_the_states_of_the_last_one():
    routes = [
        result.route for result in solve_many(steps("obstacle", True, 6), sequence=True)
    ]
    assert routes == [("gradient", "newton"), *[("newton",)] * 5]


def test_steps_without_solution_or_unknowns_leave_the_others_as_they_are():
    good, none, empty = GOOD, Problem([[0, -1], [1, 0]], [-1, -1]), Problem([], [])
    program = families.make("portfolio", 30)
    first, second = solve_many([program, program], sequence=True)
    assert second.answer.x == pytest.approx(first.answer.x, abs=1e-9)
    words = [
        result.word
        for result in solve_many([good, none, empty, good, none, good], sequence=True)
    ]
    assert words == ["solved", "infeasible", "solved", "solved", "infeasible", "solved"]


def test_factors_are_shared_by_columns_with_the_same_active_set(monkeypatch):
    problem = families.make("obstacle", 2500, 0)
    made = []
    usual = factors.PrincipalSolver.factorized
    monkeypatch.setattr(
        factors.PrincipalSolver,
        "factorized",
        lambda *given, **how: made.append(1) or usual(*given, **how),
    )
    results = lcpcli.solve_many(
        problem.M, problem.q[:, np.newaxis] * np.linspace(1, 2, 20)
    )
    next(results)
    made.clear()
    assert all(result.solved for result in results)
    assert len(made) == 1


def test_a_column_without_a_solution_between_others_is_proved_to_have_none():
    M = csr_array(np.kron(np.eye(150), np.array([[0.0, -1.0], [1.0, 1.0]])))
    Q = np.ones((300, 4))
    Q[10, 2] = -0.5
    words = [result.word for result in lcpcli.solve_many(M, Q)]
    assert words == ["solved", "solved", "infeasible", "solved"]


def test_columns_with_a_singular_set_or_large_numbers_end_as_alone():
    M, Q = csr_array(np.eye(300, k=1)), np.ones((300, 4))
    Q[-1, 1::2] = -1e-3
    together = [result.status for result in lcpcli.solve_many(M, Q)]
    assert together == [lcpcli.solve(M, q).status for q in Q.T]
    M, Q = csr_array(1e200 * np.eye(300)), -1e200 * np.ones((300, 3))
    assert all(result.solved for result in lcpcli.solve_many(M, Q)), "without a warning"


def test_bounds_of_other_kinds_start_from_no_states_of_the_last_problem():
    for seed in range(3):
        random = default_rng(seed)
        A, B = random.normal(size=(2, 8, 8))
        q = 3 * random.normal(size=8)
        solver = Solver(
            A @ A.T + B - B.T + np.eye(8),
            lower=[0] * 4 + [-1] * 4,
            upper=[np.inf] * 4 + [2] * 4,
        )
        solver.solve(q)
        bounds = (
            np.where(random.random(8) < 0.5, -np.inf, 0.0),
            np.where(random.random(8) < 0.5, 1.0, np.inf),
        )
        after, cold = (
            solver.solve(q, lower=bounds[0], upper=bounds[1], warm=warm)
            for warm in (True, False)
        )
        assert after.iterations == cold.iterations
        assert after.z.tolist() == cold.z.tolist()


def test_after_an_update_the_path_is_that_of_the_new_matrix(monkeypatch):
    """Otherwise its end is no solution, and a whole run begins from nothing."""
    monkeypatch.setattr("lcpcli.solving.solver.run", None)
    lower = [0.0] * 7 + [-np.inf] * 3
    for seed in range(2):
        random = default_rng(seed)
        solver = Solver(np.eye(10), lower=lower)
        solver.compiled = False
        for _ in range(3):
            A, G = random.normal(size=(7, 7)), random.normal(size=(3, 7))
            solver.update(np.block([[A @ A.T, -G.T], [G, np.zeros((3, 3))]]))
            q = np.r_[10 * random.normal(size=7), -G @ random.random(7)]
            assert solver.solve(q, warm=False).solved


A = np.array([[2.0, 1, 0], [1, 3, 1], [0, 1, 2]])
ROW, RHS = np.ones((1, 3)), [2.0]
FORMULATIONS = {
    "program": lambda form: lcpcli.from_qp(form(A), [-1.0, -2, -3], form(ROW), RHS),
    "linear program": lambda form: lcpcli.from_qp(
        form(0 * A), [1.0, 2, 3], form(ROW), RHS
    ),
    "game": lambda form: lcpcli.from_game(form(A), form(A.T[::-1])),
    "contact": lambda form: lcpcli.from_contact(
        form(np.kron(np.eye(2), A)), [-1, 0.5, 0.2, -1, 0.1, 0.2], 0.3, dimension=3
    ),
    "fit": lambda form: lcpcli.from_lsq(form(A), [-1.0, 0.5, 1], 0, 1),
    "inequality": lambda form: lcpcli.from_avi(
        form(A + np.triu(A)), [-1.0, -0.5, 1], form(ROW), RHS
    ),
    "players": lambda form: lcpcli.from_players([1, 2], form(A), [-1.0, -0.5, 1]),
}


@pytest.mark.parametrize("form", [np.asarray, csr_array], ids=["dense", "sparse"])
@pytest.mark.parametrize("name", FORMULATIONS)
def test_a_solver_answers_for_the_formulation_of_its_problem(name, form):
    problem = FORMULATIONS[name](form)
    solver = Solver(problem, compiled=False)
    alone = run(problem).answer
    assert alone is not None
    for result in (solver.solve(), solver.solve(problem.q)):
        assert result.answer.statement == alone.statement
        assert list(result.names) == list(problem.names)


def test_names_stay_with_another_matrix():
    solver = Solver(Problem([[2, 1], [1, 2]], [-5, -6], names=["left", "right"]))
    solver.update([[3, 1], [1, 3]])
    assert list(solver.solve([-5, -6]).names) == ["left", "right"]


def test_copies_of_a_problem_in_a_sequence_are_without_the_matrix_before():
    """Whose scaling bounds that of the next one."""
    random = default_rng(0)
    M, q = np.diag(random.uniform(1, 2, 30)) + np.eye(30, k=1), random.normal(size=30)
    solver = Solver(M)
    facts = solver.solve(q).problem.facts
    assert facts.units.parts
    sizes = []
    for factor in (1.001, 1.002):
        solver.update(factor * M)
        problem = solver.solve(q).problem
        assert problem.facts.near_units is not None
        sizes.append(len(pickle.dumps(problem)))
        assert pickle.loads(pickle.dumps(problem)).facts.near_units is not None
    assert max(sizes) < 1.5 * len(pickle.dumps(Problem(M, q)))
