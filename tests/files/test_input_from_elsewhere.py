"""Files as other programs and people write them: what is missing as None or null,
numbers as texts, matrices that are symmetric up to rounding."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from scipy import sparse

import lcpcli
from lcpcli import Problem, read
from lcpcli.errors import ProblemError

from ..conftest import read_exact, save_json

# A program with two variables, whose minimizer each part changes.
PARTS = {
    "P": np.array([[2.0, 0.5], [0.5, 1.0]]),
    "q": np.array([-2.0, -4.0]),
    "G": np.array([[1.0, 1.0]]),
    "h": np.array([1.5]),
    "A": np.array([[1.0, -1.0]]),
    "b": np.array([-0.25]),
    "lb": np.array([-np.inf, 0.0]),
    "ub": np.array([3.0, 0.5]),
}
MISSING = [
    [name for part, is_left in zip(("G h", "A b", "lb", "ub"), which, strict=True)
     if is_left for name in part.split()]
    for which in product((False, True), repeat=4)
]  # fmt: skip


@pytest.mark.parametrize("is_sparse", [False, True], ids=["dense", "sparse P"])
@pytest.mark.parametrize("missing", MISSING, ids=" ".join)
def test_what_qpsolvers_saves_as_none_is_not_given(missing, is_sparse, tmp_path):
    qpsolvers = pytest.importorskip("qpsolvers", reason="needs qpsolvers")
    given = {key: None if key in missing else PARTS[key] for key in PARTS}
    stored = given | ({"P": sparse.csc_matrix(PARTS["P"])} if is_sparse else {})
    file = tmp_path / "saved.npz"
    qpsolvers.Problem(**stored).save(str(file))
    assert lcpcli.run(read(file)).answer.x == pytest.approx(lcpcli.solve_qp(**given))


@pytest.mark.parametrize("key", ["G", "A"])
def test_sparse_matrix_that_qpsolvers_pickles_is_refused_and_never_left_out(
    key, tmp_path
):
    """Its own `Problem.load` takes such a matrix for one that is not given."""
    qpsolvers = pytest.importorskip("qpsolvers", reason="needs qpsolvers")
    file = tmp_path / "saved.npz"
    problem = qpsolvers.Problem(**PARTS | {key: sparse.csc_matrix(PARTS[key])})
    problem.save(str(file))
    with pytest.raises(ProblemError, match=rf"{key}: is a sparse matrix as a pickle"):
        read(file)


@pytest.mark.parametrize("key", ["M", "q", "lower", "x0", "solution", "name", "names"])
def test_none_and_null_for_a_key_of_a_problem_are_as_if_it_were_left_out(key, tmp_path):
    """But for bounds, where null means none."""
    fields = {"M": [[2, 1], [1, 2]], "q": [-5, 1], key: None}
    file, archive = tmp_path / "p.json", tmp_path / "p.npz"
    save_json(file, fields)
    np.savez(archive, **{key: np.array(value) for key, value in fields.items()})
    for path in (file, archive):
        if key in ("M", "q"):
            with pytest.raises(ProblemError, match=key):
                read(path)
            continue
        z = lcpcli.run(read(path)).z
        right = [11 / 3, -7 / 3] if key == "lower" else [2.5, 0.0]
        assert z == pytest.approx(right)


NUMBERS = {
    "-7/3": Fraction(-7, 3),
    "+1/3": Fraction(1, 3),
    "1e-3": Fraction(1, 1000),
    "2E2": Fraction(200),
    " 22/7\t": Fraction(22, 7),
    ".5": Fraction(1, 2),
    "5.": Fraction(5),
    "0.1000000000000000000001": Fraction(10**21 + 1, 10**22),
}


@pytest.mark.parametrize(("text", "value"), NUMBERS.items())
def test_number_as_a_text_is_that_number_and_exactly_so(text, value, tmp_path):
    """In M, q and a bound, by rows and by coordinates."""
    file = tmp_path / "p.json"
    by_coordinates = {
        "format": "coo",
        "shape": ["2", "2"],
        "rows": ["0", 1],
        "cols": [0, "1"],
        "values": [text, "1"],
    }
    for M in ([[text, 0], ["0", "1"]], by_coordinates):
        save_json(file, {"M": M, "q": ["-1", text], "upper": [text, None], "lower": -9})
        problem = read(file)
        assert problem.M[0, 0] == problem.q[1] == problem.box.upper[0] == float(value)
        exact = read_exact(str(file))
        assert exact.M[0][0] == value
        assert exact.upper == [value, None]
        assert Fraction(exact.constants[1], exact.scales[1]) == value


FORMS = {
    "from_qp": {
        "Q": [["2", "1/2"], [0.5, "1"]],
        "c": ["-2", "-8/2"],
        "A": [["1", " 1 "], [1, "-1"]],
        "row_lower": ["-inf", "-1/4"],
        "row_upper": ["3/2", "Infinity"],
        "lower": [None, "0"],
        "upper": ["inf", ".5"],
        "constant": "1/2",
    },
    "from_qpsolvers": {
        "P": [["2", "1/2"], [0.5, "1"]],
        "q": ["-2", "-4e0"],
        "G": [["1", "1"], ["1", "0"]],
        "h": ["3/2", "inf"],
        "A": [["1", "-1"]],
        "b": ["-1/4"],
        "lb": "-Infinity",
        "ub": [None, "1/2"],
    },
    "from_osqp": {
        "P": [["2", "1/2"], [0.5, "1"]],
        "q": ["-2", "-4"],
        "A": [["1", "1"], [1, "-1"]],
        "l": ["-inf", "-1/4"],
        "u": ["3/2", None],
    },
}


def in_doubles(key, value):
    """What a text, or a list of them, means under a key of a program."""
    if isinstance(value, list):
        return [in_doubles(key, each) for each in value]
    if value is None:
        return -np.inf if key == "lower" else np.inf
    return float(value) if "inf" in str(value).lower() else float(Fraction(value))


@pytest.mark.parametrize("form", FORMS)
def test_programs_have_numbers_as_texts_and_words_for_infinity(form, tmp_path):
    written = FORMS[form]
    meant = {key: in_doubles(key, value) for key, value in written.items()}
    file = tmp_path / "p.json"
    save_json(file, written)
    found, right = read(file), getattr(lcpcli, form)(**meant)
    assert (found.M == right.M).all()
    assert (found.q == right.q).all()
    for key in ("lower", "upper"):
        assert np.array_equal(getattr(found.box, key), getattr(right.box, key))
    assert found.origin == right.origin


WORDS = ["INF", "+inf", " infinity ", None]


def rounded_products(rng, n):
    """Matrices that are symmetric but for the rounding of a product, an inverse or a
    division."""
    B = rng.standard_normal((n + 5, n))
    V, _ = np.linalg.qr(rng.standard_normal((n, n)))
    weights = rng.uniform(1, 2, n + 5)
    return [
        V @ np.diag(rng.uniform(-5, 5, n)) @ V.T,
        np.linalg.inv(B.T @ B + n * np.eye(n)),
        np.corrcoef(B.T),
        sparse.csc_array(B).T @ sparse.diags_array(weights) @ sparse.csc_array(B),
        (B.T.astype(np.float32) * weights.astype(np.float32)) @ B.astype(np.float32),
    ]


@pytest.mark.parametrize("n", [2, 7, 40])
def test_matrix_that_is_symmetric_up_to_rounding_is_made_symmetric(n):
    for Q in rounded_products(np.random.default_rng(n), n):
        M = lcpcli.from_qp(Q, -np.ones(n)).M
        assert not abs(M - M.T).max()
        assert abs(M - Q).max() <= abs(Q - Q.T).max()


ROUNDED = np.array([[2.0, 0.1 + 0.2], [0.3, 1.0]])


def test_every_way_in_takes_a_matrix_that_is_symmetric_up_to_rounding(tmp_path):
    q, origin = [-1.0, -1.0], {"kind": "qp", "variables": 2}
    right = pytest.approx([0.7 / 1.91, 1.7 / 1.91])
    assert (ROUNDED != ROUNDED.T).any()
    assert lcpcli.solve_qp(ROUNDED, q) == right
    problems = [
        lcpcli.from_qp(ROUNDED, q),
        lcpcli.from_qpsolvers(sparse.csr_array(ROUNDED), q),
        lcpcli.from_osqp(ROUNDED, q),
        Problem(ROUNDED, q, origin=origin),
        Problem(sparse.csr_array(ROUNDED), q, origin=origin),
    ]
    for name, key in (("Q", "c"), ("P", "q")):
        file, archive = tmp_path / f"{name}.json", tmp_path / f"{name}.npz"
        bounds = {"lb": None} if name == "P" else {}
        save_json(file, {name: ROUNDED.tolist(), key: q} | bounds)
        np.savez(archive, **{name: ROUNDED, key: q, **bounds})
        problems += [read(file), read(archive)]
        assert read_exact(str(file)).M[0][1] == read_exact(str(file)).M[1][0]
    for problem in problems:
        assert not abs(problem.M - problem.M.T).max()
        answer = lcpcli.run(problem).answer
        assert answer.x == right
        assert answer.proved == "unique_optimum"


def test_more_is_refused_with_the_pair_and_the_call_for_an_inequality():
    other = [[2, 0.3, 0], [0.3, 1, 1.0], [0, 1.0001, 1]]
    with pytest.raises(ProblemError) as refusal:
        lcpcli.solve_qp(other, [-1, -1, -1], lb=0)
    assert str(refusal.value).startswith("P[1][2]: is 1 and P[2][1] is 1.0001")
    assert "in Python from_avi" in str(refusal.value)
    with pytest.raises(ProblemError, match="does not yield this M and q"):
        Problem(other, [-1, -1, -1], origin={"kind": "qp", "variables": 3})
