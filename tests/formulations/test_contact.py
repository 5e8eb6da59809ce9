"""Contact with friction from bounds and friction indices, and from Delassus matrices:
the laws of contact hold for the answers, in the order of the caller."""

from dataclasses import replace
from fractions import Fraction
from math import inf
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, Solver, from_contact, from_findex, run
from lcpcli.basis.tableau import follow
from lcpcli.formulations.contact import cones
from lcpcli.formulations.contact.cones import Friction
from lcpcli.gallery.rigid_bodies import contact_in_time
from lcpcli.methods.lemke import paths
from lcpcli.verify.point import Criterion, Point

from ..refusals import calls, contents, raised
from ..seeds import few_of

A, B = [[1, 0.2], [0.2, 2]], [-1, -3]
LOWER, UPPER, FINDEX = [0, -0.5], [inf, 0.5], [-1, 0]
TOL = 1e-10


@pytest.fixture(params=[False, True])
def compiled(request):
    if request.param:
        pytest.importorskip("numba")
    return request.param


def generated(seed):
    """A, b, bounds and findex of bodies with mass ratios up to 1e6, of which some
    contacts are redundant, with limits and motors beside the contacts, in any order."""
    random = default_rng(seed)
    n = int(random.integers(3, 30))
    J = random.normal(size=(n, n + 3))
    if seed % 2:
        J[-(n // 3) :] = J[: n // 3]
    J /= 10 ** random.uniform(0, 3, size=n + 3)
    matrix = J @ J.T + (seed % 3 == 0) * 1e-6 * np.eye(n)
    b = J @ random.normal(size=n + 3)
    lower, upper, findex = np.zeros(n), np.full(n, inf), np.full(n, -1)
    for i in range(0, n - 2, 3):
        upper[i] = random.choice([inf, 0.3])
        upper[i + 1] = random.choice([0.0, 0.3, 1.2])
        lower[i + 1], findex[i + 1] = -upper[i + 1], i
        lower[i + 2], upper[i + 2] = random.choice([-inf, -0.1]), 0.1
    order = random.permutation(n)
    moved = np.where(findex < 0, -1, np.argsort(order)[findex])[order]
    return matrix[order][:, order], b[order], lower[order], upper[order], moved


def violation(answer, given):
    """By how much x violates the laws, relative to the terms of the rows."""
    matrix, b, lower, upper, findex = given
    x, is_tangential = answer.x, findex >= 0
    lower, upper = lower.copy(), upper.copy()
    upper[is_tangential] *= x[findex[is_tangential]]
    lower[is_tangential] = -upper[is_tangential]
    off = abs(x - np.clip(x - (matrix @ x + b), lower, upper))
    terms = abs(matrix) @ abs(x) + abs(b)
    return float((off / np.maximum(terms, abs(x).max() or 1.0)).max())


@pytest.mark.parametrize("seed", range(4))
def test_the_form_of_stewart_and_trinkle_has_the_solution(seed):
    problem = from_findex(*generated(seed))
    iterate = next(
        problem.formulation.in_other_form(problem, lambda other: paths(other, follow))
    )
    z = problem.box.z_of(iterate.x)
    assert Point(Criterion(problem), z).solves()


def stack_of_boxes(masses, corners):
    """W and q of boxes of width and height 1 on each other, under gravity for a
    millisecond, with this many contacts between two of them, and the sums of the normal
    impulses of these: the weight above them times the step."""
    step, n = 9.81e-3, 3 * len(masses)
    inverses = np.outer(1 / np.array(masses), [1.0, 1.0, 6.0]).ravel()
    rows, at = [], np.linspace(-0.5, 0.5, corners)
    for i in range(len(masses)):
        for x in at:
            normal, tangential = np.zeros((2, n + 3))
            normal[3 * i : 3 * i + 6] = 0, -1, -x, 0, 1, x
            tangential[3 * i : 3 * i + 6] = -1, 0, 0.5, 1, 0, 0.5
            rows += [normal[3:], tangential[3:]]
    J = np.array(rows)
    falling = np.zeros(n)
    falling[1::3] = -step
    above = np.cumsum(np.array(masses)[::-1])[::-1] * step
    return (J * inverses) @ J.T, J @ falling, above


@pytest.mark.parametrize("corners", [2, 3])
@pytest.mark.parametrize(
    "masses",
    [
        [1.0] * 4 + [1e8],
        [1.0] * 19 + [1e8],
        [1.0] * 59 + [1e4],
        [1.0, 1e2] * 30,
        [1e4, 1.0] * 30,
    ],
    ids=["5, 1e8", "20, 1e8", "60, 1e4", "alternating 1e2", "alternating 1e4"],
)
def test_boxes_stick_on_each_other_whatever_the_ratio_of_their_masses(masses, corners):
    W, q, above = stack_of_boxes(masses, corners)
    result = run(lcpcli.from_contact(W, q, 0.5), time_limit=30)
    assert result.solved
    assert not {"reflections", "milp"} & set(result.route)
    sums = result.answer.x[::2].reshape(-1, corners).sum(axis=1)
    np.testing.assert_allclose(sums, above, rtol=1e-6)


def test_the_other_form_is_tried_before_methods_that_take_many_iterations():
    problem = from_findex(*generated(1245))
    assert run(problem, max_iterations=60).solved
    parts = [attempt.part for attempt in lcpcli.plan(problem)]
    assert "in another form" in parts


@pytest.mark.parametrize("seed", few_of(range(12), 6))
def test_generated_contacts_satisfy_the_laws_in_the_order_of_the_caller(seed):
    given = generated(seed)
    result = run(from_findex(*given))
    assert result.solved
    assert violation(result.answer, given) < TOL
    w = given[0] @ result.answer.x + given[1]
    assert np.allclose(result.answer.w, w, atol=1e-12 * abs(w).max())


@pytest.mark.parametrize(
    ("q", "state"),
    [
        ([1.0, -3.0], "separated"),
        ([-1.0, -0.3], "sticking"),
        ([-1.0, -3.0], "sliding"),
        ([-1.0, 3.0], "sliding"),
        ([-1.0, -0.7], "sticking"),  # at the end of the cone, without a velocity
    ],
)
def test_contacts_separate_stick_and_slide(q, state):
    W = [[1, 0], [0, 1]]
    answer = run(from_contact(W, q, 0.7)).answer
    assert [each.state for each in answer.contacts] == [state]
    assert answer.statement == f"1 contact: 1 {state}"
    spatial = from_contact(np.eye(3), [*q, 0.0], 0.7, dimension=3)
    assert [each.state for each in run(spatial).answer.contacts] == [state]


def test_by_restitution_contacts_bounce_with_a_share_of_their_speed(tmp_path):
    """By Newton's law: at least -e times the normal velocity before; also where files
    keep it, in fractions, and in the next step."""
    W, before = np.eye(4) + 0.25, [-2.0, 0, -1, 0]
    problem = from_contact(W, before, 0.5, restitution=[0.5, 0], before=before)
    result = lcpcli.exact(problem)
    answer = result.answer
    assert answer.w[[0, 2]].tolist() == pytest.approx([1, 0])
    assert answer.exact["w"][::2] == [1, 0]
    assert np.allclose(W @ answer.x + before, answer.w)
    lcpcli.write(problem, tmp_path / "bounce.json")
    again = lcpcli.read(tmp_path / "bounce.json")
    assert np.array_equal(again.q, problem.q)
    assert np.allclose(run(again).answer.w, answer.w)
    solver = Solver(problem)
    after = answer.w - [3, 0, 0, 0]
    solver.update(q=after, before=after)
    w = solver.solve().answer.w
    assert w[0] == pytest.approx(1)
    assert w[2] >= -1e-15
    solver.update(before=before)  # and q as it was
    again = from_contact(W, after, 0.5, restitution=[0.5, 0], before=before)
    assert np.array_equal(solver.solve().problem.q, again.q)


def test_none_leaves_the_coefficients_of_friction_as_they_are():
    """A body that 1.0 pushes and friction of .3 holds."""
    solver = Solver(from_contact(np.eye(2), [-5.0, 1.0], 0.3))
    solver.update(q=[-5.0, 1.2], mu=None)
    assert [each.state for each in solver.solve().answer.contacts] == ["sticking"]


@pytest.mark.parametrize("facets", [4, 8, 16])
def test_friction_of_a_polygon_is_too_small_by_at_most_its_share(facets):
    mu = 0.5
    for angle in np.linspace(0, np.pi / 2, 5):
        q = [-1.0, -3 * np.cos(angle), -3 * np.sin(angle)]
        problem = from_contact(np.eye(3), q, mu, dimension=3, facets=facets)
        x = run(problem).answer.x
        size = np.hypot(x[1], x[2])
        assert mu * np.cos(np.pi / facets) - 1e-9 <= size <= mu + 1e-9
        assert x[1] * q[1] + x[2] * q[2] < 0
    assert np.array_equal(
        cones.polygon(facets)[: facets // 2], -cones.polygon(facets)[facets // 2 :]
    )


def test_a_mass_between_two_walls_is_jammed():
    """Both normal rows are opposite, and both walls approach."""
    W = np.array([[1.0, 0, -1, 0], [0, 1, 0, 1], [-1, 0, 1, 0], [0, 1, 0, 1]])
    result = run(from_contact(W, [-1, 0, -1, 0], 0.5))
    assert result.status.has_no_solution
    assert result.answer.statement.startswith("jammed")
    assert result.answer.x is None


def test_jammed_is_said_only_where_no_impulses_are_allowed():
    """x = (1/5, 2/5) is within the cone of mu = 2, and its w_n = 0 is allowed, so that
    the law of Coulomb alone has no solution."""
    result = run(from_contact([[1, 2], [2, 4]], [-1, 1], 2))
    assert result.status.word == "unsolvable"
    assert result.answer.statement.startswith("no impulses satisfy the laws")


@pytest.mark.parametrize("method", ["auto", "lemke", "milp"])
@pytest.mark.parametrize("seed", few_of(range(40), 2))
def test_bodies_at_rest_without_a_tangential_load_stick(method, seed):
    """x_t = beta - mu x_n is 0 up to the rounding of both."""
    random = default_rng(seed)
    k = int(random.integers(1, 4))
    q = np.zeros(2 * k)
    q[::2] = -random.uniform(0.1, 10, k)
    problem = from_contact(np.diag(random.uniform(0.1, 10, 2 * k)), q, 0.7)
    result = run(problem, method)
    assert result.solved
    assert [each.state for each in result.answer.contacts] == ["sticking"] * k


def test_a_contact_is_judged_apart_from_one_with_a_far_larger_impulse():
    W = np.diag([1e-4, 1e-4, 1e6, 1e6])
    result = run(from_contact(W, [-10, 0, -1, -0.8], 0.5))
    states = [each.state for each in result.answer.contacts]
    assert states == ["sticking", "sliding"]


def test_without_contacts_there_is_an_answer():
    result = run(from_contact(np.zeros((0, 0)), [], 0.5))
    assert result.solved
    assert result.answer.x.size == 0
    assert result.answer.contacts == []


@pytest.mark.parametrize("dimension", [2, 3])
def test_sparse_matrices_have_the_same_problem(dimension):
    W, q = np.eye(6) + 0.1, -np.ones(6)
    dense, sparse = (
        from_contact(each, q, [0.5] * (6 // dimension), dimension=dimension)
        for each in (W, csr_array(W))
    )
    assert np.allclose(dense.M, sparse.M.toarray())
    assert np.allclose(run(dense).answer.x, run(sparse).answer.x)


def by_contacts(scene):
    """W and q of a step, the normal and the tangential unknown of each contact in
    turn."""
    step, k = scene.problem(), len(scene.contacts)
    order = np.arange(2 * k).reshape(2, k).T.ravel()
    return step.M[order][:, order], step.q[order]


def impulses(x):
    """What moves a scene on: normal impulses, then tangential ones."""
    return np.concatenate((x[::2], x[1::2], np.zeros(x.size)))


def falling(steps, compiled):
    """A heap of boxes: the results of each step by W and by friction indices, with the
    data, and the number of contacts."""
    scene = contact_in_time("heap", 3, 1)
    by_W = by_findex = None
    for _ in range(steps):
        k = len(scene.contacts)
        if not k:
            scene.advance()
            continue
        W, q = by_contacts(scene)
        pairs = [(each.first, each.second) for each in scene.contacts]
        ids = [(*pair, pairs[:i].count(pair)) for i, pair in enumerate(pairs)]
        lower, upper = np.tile([0.0, -0.5], k), np.tile([inf, 0.5], k)
        findex = np.where(np.arange(2 * k) % 2, np.arange(2 * k) - 1, -1)
        if by_W is None:
            by_W, by_findex = (
                Solver(first, compiled=compiled)
                for first in (
                    from_contact(W, q, 0.5),
                    from_findex(W, q, lower, upper, findex),
                )
            )
        by_W.update(W=W, q=q, mu=0.5, ids=ids)
        own = [(*each, side) for each in ids for side in (0, 1)]
        box = {"lower": lower, "upper": upper, "findex": findex}
        by_findex.update(A=W, b=q, ids=own, **box)
        given = W, q, lower, upper, findex
        results = by_W.solve(), by_findex.solve()
        yield results, given, k
        x = results[0].answer.x
        scene.advance(impulses(x))


def test_contacts_come_and_go_in_a_loop_until_it_is_at_rest(compiled):
    numbers = set()
    for results, given, k in falling(60, compiled):
        numbers.add(k)
        for result in results:
            assert result.solved
            assert violation(result.answer, given) < TOL
    assert len(numbers) > 2


@pytest.mark.parametrize("seed", few_of(range(8), 4))
def test_steps_that_jump_satisfy_the_laws(seed, compiled):
    """From the states of the last step, with limits, motors and redundant contacts, of
    which the matrix changes now and then."""
    given, random = list(generated(seed)), default_rng(seed)
    solver = Solver(from_findex(*given), compiled=compiled)
    assert solver.solve().solved
    for step in range(10):
        move = given[0] @ random.normal(size=len(given[1]))
        given[1] = given[1] + 10.0 ** random.integers(-6, 2) * move
        if step % 3 == 2:
            given[0] = 1.1 * given[0]
        solver.update(A=given[0], b=given[1])
        result = solver.solve()
        assert result.solved
        assert violation(result.answer, tuple(given)) < TOL


def test_a_stack_at_rest_keeps_its_states_though_its_contacts_are_redundant():
    scene, routes = contact_in_time("tower", 4, 0), []
    solver = None
    for _ in range(40):
        W, q = by_contacts(scene)
        if solver is None:
            solver = Solver(from_contact(W, q, 0.5))
        solver.update(W=W, q=q)
        result = solver.solve()
        assert result.solved
        routes.append(result.route)
        x = result.answer.x
        scene.advance(impulses(x))
    assert abs(scene.velocities).max() < 1e-9
    assert set(routes[-10:]) == {("newton",)}


def test_a_step_with_the_data_of_the_one_before_takes_one_system():
    """Also where impulses are not unique, and some are at the limit of friction though
    nothing slides."""
    for _, (W, q, *_), _ in list(falling(60, False))[::20]:
        solver = Solver(from_contact(W, q, 0.5))
        assert solver.solve().solved
        solver.update(W=W, q=q)
        result = solver.solve()
        assert result.route == ("newton",)
        assert result.iterations == 1


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_solver_with_another_q_answers_for_the_b_that_makes_it(dimension):
    W, first, second = np.eye(dimension), [-1.0, 0.2, 0.1], [-3.0, -0.4, 0.3]
    e = {"restitution": 0.5, "before": [-1.0, 0.0, 0.0][:dimension]}
    problems = [
        from_contact(W, q[:dimension], 0.5, dimension=dimension, **e)
        for q in (first, second)
    ]
    result = Solver(problems[0], compiled=False).solve(problems[1].q)
    expected = run(problems[1])
    assert result.problem.origin.b == pytest.approx(problems[1].origin.b)
    assert result.answer.x == pytest.approx(expected.answer.x)
    assert result.answer.w == pytest.approx(expected.answer.w)
    assert result.answer.statement == expected.answer.statement
    assert result.problem.origin.impact.q == pytest.approx(second[:dimension])


@pytest.mark.parametrize(
    "problem",
    [
        from_contact(np.eye(2), [-1, 0.2], 0.5),
        from_contact(np.eye(3), [-1, 0.2, 0.1], 0.5, dimension=3),
        lcpcli.from_game([[1, 0], [0, 1]], [[0, 1], [1, 0]]),
        lcpcli.from_lsq([[1, 0], [0, 1]], [1, 2]),
    ],
    ids=["plane", "space", "game", "fit"],
)
def test_a_solver_with_a_q_of_another_kind_answers_for_no_formulation(problem):
    q = problem.q - np.arange(1.0, problem.n + 1)
    result = Solver(problem, compiled=False).solve(q)
    assert result.answer is None
    assert list(result.names) == list(problem.names)


def test_states_go_from_update_to_update_and_not_to_another_matrix():
    W, q = np.eye(6) + 0.1, np.array([-1, 0.1, -1, -5.0, 3.0, 0])
    solver = Solver(from_contact(W, q, 0.5), compiled=False)
    solver.update(ids=["a", "b", "c"])
    solver.solve()
    order = np.array([2, 3, 4, 5, 0, 1])
    solver.update(q=q[order], ids=["b", "c", "a"])
    solver.update(q=q, ids=["a", "b", "c"])
    assert solver.solve().iterations == 1
    solver.update(q=2 * q)
    solver.update(np.eye(4))
    assert solver.solve([-1, -2, 3, 4]).z.tolist() == [1, 2, 0, 0]


def test_steps_of_many_separate_contacts_have_a_sparse_matrix(compiled):
    W = np.eye(600) - 0.3 * (np.eye(600, k=2) + np.eye(600, k=-2))
    q = np.random.default_rng(0).normal(size=600) - 1
    solver = Solver(from_contact(W, q, 0.5), compiled=compiled)
    assert type(solver.M) is csr_array
    for factor in (1.0, 1.01, 1.02):
        solver.update(W=factor * W, q=q / factor)
        assert solver.solve().solved


def test_data_of_a_step_may_be_any_arrays(compiled):
    W, before = np.eye(4), [-1.0, 0, -1, 0]
    columns = np.zeros((6, 2))
    columns[:4, 0] = [-1, 0.2, -1, 0.3]
    columns.setflags(write=False)
    of_form, q = columns[:, 0], columns[:4, 0]
    solver = Solver(from_contact(W, q, 0.5), compiled=compiled)
    expected = [1, -0.2, 1, -0.3]
    for _ in range(2):
        assert solver.solve(of_form).answer.x == pytest.approx(expected)
    solver.update(W=W[::-1, ::-1], q=q)
    assert solver.solve().answer.x == pytest.approx(expected)
    solver.update(restitution=np.array([0.5, 0]), before=np.array(before))
    assert solver.solve().answer.w == pytest.approx([0.5, 0, 0, 0])


def test_friction_of_a_step_cannot_be_changed_for_other_solvers():
    box = {"lower": np.array(LOWER), "upper": np.array(UPPER)}
    solver = Solver(from_findex(A, B, *box.values(), FINDEX))
    solver.update(**box, findex=np.array(FINDEX))
    with pytest.raises(ValueError, match="read-only"):
        solver.solve().problem.origin.friction.coefficients[0] = 0.1


@pytest.mark.parametrize("shift", [0.0, 1e-6])
@pytest.mark.parametrize("dimension", [2, 3])
def test_lemke_is_guaranteed_without_redundant_contacts_in_any_order(shift, dimension):
    """By an exact proof, also with a compliance on the diagonal; not for a q that asks
    for something else of opposite directions, or of the slacks."""
    random, k, facets = default_rng(3), 6, 2 * (dimension - 1)
    J = random.normal(size=(dimension * k, 4 * k)).round(2)
    places = np.arange(dimension * k).reshape(k, dimension)
    friction = Friction(places[:, 0], places[:, 1:], np.full(k, 0.5))
    bounds = np.zeros(len(J)), np.full(len(J), inf)
    b, directions = random.normal(size=len(J)), cones.polygon(facets)
    form = cones.stewart_trinkle(J @ J.T, b, *bounds, friction, directions)
    M, q, *_ = form.conditions
    M = M + shift * np.eye(q.size)
    order = random.permutation(q.size)
    problem = Problem(M[order][:, order], q[order])
    found = lcpcli.inspect(problem)
    assert found.classes["copositive"].word == "yes"
    assert found.guarantees["lemke"].word == "yes"
    assert run(problem, "lemke").solved
    for place in (q.size - 1,) if shift else (k, q.size - 1):
        other = q.copy()
        other[place] -= 9.0
        changed = lcpcli.inspect(Problem(problem.M, other[order]))
        assert changed.guarantees["lemke"].word == "not decided"


def test_numbers_are_exact_as_decimals():
    """A - mu a is no double here."""
    problem = from_findex([[1.1, 0.3], [0.3, 1.3]], B, LOWER, UPPER, FINDEX)
    rows = problem.formulation.exact_conditions()[0]
    assert rows[0][0] == Fraction(11, 10) - Fraction(1, 2) * Fraction(3, 10)


def test_what_is_proved_to_be_exact_passes_the_exact_check():
    problem = from_contact([[1 / 3, 0], [0, 1]], [-1 / 7, 1], 1 / 3)
    z = lcpcli.exact(problem).exact.z
    assert lcpcli.check(problem, z).exact


@pytest.mark.parametrize("limit", [9.0, inf])
def test_the_caller_may_write_the_arrays_of_a_step_again(limit, compiled):
    """As an engine does that has one buffer for each of them."""
    data = {"A": np.array(A, float), "b": np.array([-2.0, -3.0])}
    data |= {"lower": np.array([0, -0.5]), "upper": np.array([limit, 0.5])}
    data["findex"] = np.array([-1, 0])
    solver = Solver(from_findex(**data), compiled=compiled)
    solver.solve()
    rng = default_rng(0)
    for _ in range(8):
        mu = rng.uniform(0, 1)
        data["lower"][:], data["upper"][:] = (0, -mu), (limit / rng.uniform(1, 90), mu)
        data["A"][0, 0] = rng.uniform(1, 2)
        data["b"][:] = rng.uniform(-4, -1, 2)
        solver.update(**data)
        result = solver.solve()
        cold = run(from_findex(**data))
        assert result.solved
        assert np.allclose(result.answer.x, cold.answer.x, rtol=0, atol=1e-9)
        before = result.answer.x.copy()
        data["upper"][:] = data["lower"][:] = data["b"][:] = 7.0
        solver.update(b=np.array([-1.0, -2.0]))
        again = solver.solve()
        assert (again.z <= again.problem.upper + 1e-12).all()
        assert result.answer.x.tolist() == before.tolist()


def steps_of_an_engine(key, rng):
    """Yield data of steps, in which W, q, mu or all of them change, or nothing does."""
    W, q, mu = np.eye(2), np.array([-1.0, 0.3]), 0.5
    for step in range(40):
        if step % 4 == 0:
            mu = float(rng.uniform(0, 1))
        if step % 3 == 0:
            k = int(rng.integers(1, 4))
            J = rng.normal(size=(2 * k, 2 * k + 2))
            W, q = J @ J.T, rng.normal(size=2 * k)
        if step % 5 == 1:
            q = q * rng.uniform(0.9, 1.1)
        if key == "W":
            yield {"W": W, "q": q, "mu": mu}
            continue
        positions = np.arange(q.size)
        box = np.tile([0, -mu], q.size // 2), np.tile([np.inf, mu], q.size // 2)
        findex = np.where(positions % 2, positions - 1, -1)
        yield {"A": W, "b": q, "lower": box[0], "upper": box[1], "findex": findex}


def test_steps_by_kernels_keep_to_the_limit_on_iterations():
    pytest.importorskip("numba")
    first, *steps = steps_of_an_engine("W", default_rng(2))
    solver = Solver(from_contact(**first), compiled=True, max_iterations=1)
    solver.solve()
    for data in steps:
        solver.update(**data)
        assert solver.solve().iterations <= 1


@pytest.mark.parametrize("key", ["W", "findex"])
def test_a_step_by_kernels_has_the_problem_and_the_solution_of_one_without(key):
    """Also where mu alone changes, and where contacts come and go."""
    pytest.importorskip("numba")
    makers = {"W": from_contact, "findex": from_findex}
    solvers = []
    for data in steps_of_an_engine(key, np.random.default_rng(1)):
        if not solvers:
            first = makers[key](**data)
            solvers = [Solver(first, compiled=each) for each in (False, True)]
        results = []
        for solver in solvers:
            solver.update(**data)
            results.append(solver.solve())
        expected, result = results
        assert result.solved
        assert result.problem.M.tolist() == makers[key](**data).M.tolist()
        assert result.problem.q.tolist() == expected.problem.q.tolist()
        assert np.allclose(result.answer.x, expected.answer.x, rtol=0, atol=1e-9)
        if result.route == expected.route:  # lemke has the basis of its last vertex
            assert result.basis == expected.basis
        assert result.relative_residual <= TOL
        states = [[each.state for each in one.answer.contacts] for one in results]
        assert states[0] == states[1]


def test_a_step_that_is_refused_leaves_the_solver_as_it_was(compiled):
    W, q = np.array(A, float), np.array([-2.0, -3.0])
    solver = Solver(from_contact(W, q, 0.5), compiled=compiled)
    before = solver.solve().answer.x
    for field, data in (
        (r"W\[0\]\[1\]", {"W": np.where(np.eye(2), W, np.nan)}),
        (r"q\[1\]", {"q": np.array([1.0, np.inf])}),
        ("W", {"W": np.eye(2) * 1e308, "mu": 10.0, "q": q}),
        ("W", {"W": np.eye(3)}),
    ):
        # Kernels that run as Python warn of an overflow, as compiled ones do not.
        with (
            np.errstate(over="ignore"),
            pytest.raises(lcpcli.errors.ProblemError, match=f"^{field}: "),
        ):
            solver.update(**data)
        assert solver.solve().answer.x.tolist() == before.tolist()


def test_x_is_verified_in_place_of_z():
    problem = from_findex(A, B, LOWER, UPPER, FINDEX)
    assert lcpcli.check(problem, [10 / 11, 5 / 11]).accepted
    assert not lcpcli.check(problem, [1, 0.5]).accepted
    assert lcpcli.check(problem, run(problem).z).accepted


@pytest.mark.parametrize("change", [-1e-3, 0.0, 1e-3])
def test_an_impulse_between_its_bounds_is_accepted_without_a_velocity_alone(change):
    problem = from_findex(A, [-1, -0.1], LOWER, UPPER, FINDEX)
    result = run(problem)
    assert result.answer.contacts[0].state == "sticking"
    moved = result.z.copy()
    moved[1] += change
    point = Point(Criterion(problem), moved)
    word = problem.origin.accepted(replace(result, point=point)).status.word
    assert word == ("stalled" if change else "solved")


@pytest.mark.parametrize("seed", [155, 279, 677, 1344])
def test_where_lemke_ends_in_a_ray_the_other_form_is_solved(seed):
    random = default_rng(seed)
    k = int(random.integers(1, 4))
    J = random.normal(size=(2 * k, int(random.integers(max(1, k), 3 * k + 1))))
    W, q = J @ J.T, J @ random.normal(size=J.shape[1])
    mu = float(random.choice([0.5, 1, 2, 5, 20]))
    problem = from_contact(W, q, mu)
    bare = lcpcli.solve(problem.M, problem.q, "lemke")
    assert bare.status.word == "ray"
    result = run(problem, "lemke")
    assert result.solved
    assert "Stewart and Trinkle" in result.message
    lower, upper = np.tile([0.0, -mu], k), np.tile([inf, mu], k)
    findex = np.where(np.arange(2 * k) % 2, np.arange(2 * k) - 1, -1)
    assert violation(result.answer, (W, q, lower, upper, findex)) < TOL


@pytest.mark.parametrize("size", [1.0, 2.0**40])
def test_a_fixed_point_of_boxes_satisfies_the_law(size):
    """Where the boxes of an engine come to rest; the first of them does not."""
    A, b, lower, upper, findex = generated(6)
    of_normals = np.where(findex < 0, size, 1.0)
    given = A, size * b, of_normals * lower, of_normals * upper, findex
    problem = from_findex(*given, lagged=True)
    assert "a fixed point" in problem.note
    result = run(problem)
    assert result.solved
    assert violation(SimpleNamespace(x=result.z), given) < 1e-8


def test_boxes_without_a_fixed_point_are_told():
    """A larger normal force makes friction that takes it away again."""
    A = [[1.0, 1.2], [1.2, 2.0]]
    given = A, [-1.0, -3.0], [0, -5.0], [inf, 5.0], [-1, 0]
    assert "no fixed point" in from_findex(*given, lagged=True).note
    assert run(from_findex(*given)).solved


def test_names_say_what_the_unknowns_are():
    names = from_findex(A, B, LOWER, UPPER, FINDEX).names
    assert names == ["x1", "x2 + 0.5 x1", "slip x2"]
    spatial = from_contact(np.eye(3), [-1, 0, 0], 0.5, dimension=3, facets=4)
    assert len(spatial.names) == spatial.n


def test_an_origin_of_other_numbers_is_refused():
    problem = from_findex(A, B, LOWER, UPPER, FINDEX)
    with pytest.raises(lcpcli.errors.ProblemError, match="does not yield"):
        Problem(2 * problem.M, problem.q, origin=problem.origin)


REFUSED = calls(
    "ProblemError",
    """
from_findex(A, B, 1, 0, [-1, -1]) => lower[0]: {ABOVE:1|upper[0]|0}; {IN_ORDER}{FROM_0}
from_findex(A, B, 0, [1, 1], [-1, 1])
    => findex[1]: is 1, the index of this unknown; give the index of a normal \
unknown, or -1 for none{FROM_0}
from_findex(A, B, 0, [1, 1], [-1, 2])
    => findex[1]: is 2, but the indices of 2 unknowns are at most 1; give the index of \
a normal unknown, or -1 for none{FROM_0}
from_findex(np.eye(3), [1, 1, 1], -1, 1, [1, 2, -1])
    => findex[0]: is 1, a tangential unknown itself; give the index of a normal \
unknown, or -1 for none{FROM_0}
from_findex(A, B, 0, 1, [-1]) => findex: {ENTRIES:1 entry|2 unknowns}; {AGREE}
from_findex([[1, 2]], B, 0, 1, [-1, -1]) => A: {SHAPE:1|2}; {SQUARE}
from_findex(A, B, [0, -1], [1, -0.5], [-1, 0])
    => upper[1]: is -0.5, but findex makes it a coefficient of friction; give a \
number from 0{FROM_0}
from_findex(A, B, 0, inf, [-1, 0])
    => upper[1]: is infinite, but findex makes it a coefficient of friction; give a \
finite one, or findex -1 for no limit{FROM_0}
from_findex(A, B, 0, [1, 0.5], [-1, 0])
    => lower[1]: is 0, but findex makes it minus upper[1], -0.5; {AGREE}{FROM_0}
from_findex(A, B, -0.5, 0.5, [-1, 0])
    => lower[0]: is -0.5, but findex[1] makes unknown 0 a normal one; give a number \
from 0{FROM_0}
from_contact(A, B, -0.5) => mu[0]: {IS:-0.5}; give a number from 0{FROM_0}
from_contact(A, B, None)
    => mu[0]: is not a finite number in double precision; give a finite number{FROM_0}
from_contact(A, B, 1, restitution=[None], before=B)
    => restitution[0]: is not a number; give a number (indices count from 0)
from_contact(A, B, [1, 1]) => mu: {ENTRIES:2 entries|1 contact}; {AGREE}
from_contact([[1, 2]], B, 0.5) => W: {SHAPE:1|2}; {SQUARE}
from_contact(A, [1, 2, 3], 0.5)
    => q: {ENTRIES:3 entries|contacts of 2 each}; {AGREE}
Solver(from_contact(A, B, 1)).update(ids=[1, 2]) => ids: {ENTRIES:2 ids|1 contact}; \
{AGREE}
Solver(from_contact(np.eye(4), [1, 2, 3, 4], 1)).update(ids=["a", "a"])
    => ids[1]: is 'a', as ids[0] is; give each contact another one
Solver(from_contact(A, B, 1)).update(ids=[[1]])
    => ids[0]: is a list; give a number or a text
Solver(from_contact(np.eye(4), [1, 2, 3, 4], 1)).update(ids=[np.zeros(2), 1])
    => ids[0]: is of type ndarray; give a number or a text
Solver(from_contact(np.zeros((0, 0)), [], 1)).update(W=A, q=B)
    => mu: is not known, as there was no contact in the step before; give it with the \
contacts that come
Solver(from_contact(A, B, 1)).update(ids=3) => ids: is a number; give a list of ids
Solver(from_contact(A, B, 1)).update(gap=[1, 2])
    => gap: {NO_KEY:the data of contacts}; the keys are W, q, mu, restitution, \
before, ids
from_contact(A, B, 1, restitution=0.5)
    => before: {MISSING}, though there is restitution; add it, or leave restitution out
from_contact(A, B, 1, restitution=2, before=B)
    => restitution[0]: {IS:2}; give a number from 0 to 1{FROM_0}
Solver(A).update(q=[1, 2])
    => q: is no data of the problem of this Solver; give M, or another problem
from_contact(A, B, 0.5, dimension=4) => dimension: {IS:4}; give 2 or 3
from_contact(np.eye(3), [1, 2, 3], 0.5, dimension=3, facets=5)
    => facets: {IS:5}; give an even number from 4 to 1000
from_contact(np.eye(3), [1, 2, 3], 0.5, dimension=3, facets=1e308)
    => facets: {IS:1e+308}; give an even number from 4 to 1000
""",
)
FILES = contents(
    "slide.json",
    """
{"findex": [-1, 1], "A": [[1, 0], [0, 1]], "b": [1, 1], "hi": 1}
    => findex[1]: is 1, the index of this unknown; give the index of a normal \
unknown, or -1 for none{FROM_0}
{"findex": [-1, 0], "A": [[1, 0], [0, 1]], "b": [1, 1], "lo": [0, 0], "hi": [1, 0.5]}
    => lo[1]: is 0, but findex makes it minus hi[1], -0.5; {AGREE}{FROM_0}
{"findex": [-1, 0], "b": [1, 2]} => A: {MISSING}; add the key A
{"W": [[1, 0], [0, 1]], "q": [1, 1]} => mu: {MISSING}; add the key mu
{"W": [[1, 0], [0, 1]], "q": [1, 1], "mu": 1, "e": 0.1}
    => e: {NO_KEY:a problem of contact}; the keys are W, q, mu, dimension, facets, \
restitution, before, name, source, note
""",
)


@pytest.mark.parametrize("refusal", REFUSED, ids=str)
def test_bad_input_is_one_line(refusal):
    assert raised(refusal.command, {"A": A, "B": B}) == refusal.line


@pytest.mark.parametrize("refusal", FILES, ids=str)
def test_bad_files_are_one_line(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line
