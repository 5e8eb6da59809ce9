"""The gallery's families are what they say: their numbers, the class of M, the known
solutions and verdicts."""

import inspect
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcpcli import Status, run
from lcpcli.gallery import families as gallery
from lcpcli.inspection.verdict import NO, YES, classify
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.verify.certificate import Proof

from .. import exact

FIXED = [name for name in gallery.FAMILIES if gallery.REGISTRY[name].size]
SPARSE = (
    "tridiagonal",
    "dominant",
    "obstacle",
    "journal-bearing",
    "american-put",
    "diagonal",
    "two-obstacles",
    "torsion",
    "circuit",
    "spatial-prices",
    "portfolio",
    "control",
    "transport",
)
WITH_SOLUTION = (
    "lp",
    "qp",
    "murty",
    "fathi",
    "ben-gharbia-gilbert",
    "curtis-han-robinson",
    "kostreva",
    "growth",
    "hilbert",
    "diagonal",
    "degenerate",
    "near-degenerate",
    "ray",
    "boxes",
    "planted",
    "indefinite",
)
GRAINS = {
    "rigid-boxes": 8,
    "circuit": 8,
    "control": 20,
    "portfolio": 8,
    "poker": 28,
    "bargaining": 100,
}  # together
# What exact arithmetic says of a matrix of the class that a family has in these words.
CLASSES = {
    "P": {"p_matrix": YES},
    "M": {"m_matrix": YES},
    "H+": {"h_plus": YES},
    "positive definite": {"positive_definite": YES},
    "not positive definite": {"positive_definite": NO},
    "positive semidefinite": {"positive_semidefinite": YES},
    "symmetric positive definite": {"positive_definite": YES, "symmetric": YES},
    "skew-symmetric": {"skew_symmetric": YES},
    "copositive": {"copositive": YES},
    "any": {},
    "none": {"p_matrix": NO},
}
# Denominators of solutions that are no floats.
IN_FRACTIONS = {"curtis-han-robinson": 19, "kostreva": 3}


def of_size(name, n, seed=0, **parameters):
    return gallery.make(name, None if name in FIXED else n, seed, **parameters)


OTHER_PARAMETERS = [
    ("ben-gharbia-gilbert", {"alpha": 1.5}),
    ("journal-bearing", {"eccentricity": 0.99}),
    ("contact", {"friction": 0.0, "compliance": 0.5}),
    ("contact", {"friction": 3.0}),
    ("rigid-boxes", {"kind": "heap", "friction": 0.0}),
    ("rigid-boxes", {"kind": "crushed"}),
    ("near-singular", {"epsilon": 1e-12}),
    ("near-degenerate", {"epsilon": 1e-12}),
    ("ill-scaled", {"decades": 50}),
    ("diagonal", {"decades": 0}),
    ("hilbert", {"degenerate": True}),
    ("harker-pang", {"symmetric": True}),
    ("planted", {"entries": 3}),
    ("indefinite", {"symmetric": True}),
    ("indefinite", {"strict": True}),
]


@pytest.mark.parametrize(
    ("name", "parameters"),
    [*((name, {}) for name in gallery.FAMILIES), *OTHER_PARAMETERS],
)
def test_matrices_are_of_the_stated_class_and_known_solutions_exact(name, parameters):
    for n in (1, 3, 6):
        problem = of_size(name, n, seed=n, **parameters)
        for words in (
            gallery.entry(name).matrices.split(", ")
            if n == 6 or n == 3 >= problem.n
            else ()
        ):
            found = classify(problem.M, last=[*CLASSES[words], "symmetric"][0])
            assert {each: found[each].word for each in CLASSES[words]} == CLASSES[
                words
            ], words
        for z in problem.solutions:
            denominator = IN_FRACTIONS.get(name)
            rational = [
                Fraction(v).limit_denominator(denominator)
                if denominator
                else Fraction(v)
                for v in z.tolist()
            ]
            assert [float(v) for v in rational] == z.tolist()
            assert exact.solves(problem, rational)


@settings(max_examples=4)
@given(n=st.integers(1, 5), seed=st.integers(0, 10**6))
def test_infeasible_problems_are_so_by_the_vector_in_the_note_and_unsolvable_ones_not(
    n, seed
):
    problem = gallery.make("infeasible", n, seed)
    k = int(problem.note.split("first ")[1].split(" ")[0])
    assert Proof("farkas", (np.arange(n) < k).astype(float)).holds(problem)
    assert not exact.feasible(problem)
    problem = gallery.make("unsolvable", min(n, 5), seed)
    assert exact.feasible(problem)
    assert exact.solution(problem) is None


@settings(max_examples=6)
@given(n=st.integers(1, 12), seed=st.integers(0, 10**6))
def test_lemke_ends_on_a_ray_on_some_families_and_needs_two_to_the_n_pivots_on_another(
    n, seed
):
    problem = gallery.make("ray", n, seed)
    assert exact.solves(problem, [Fraction(v) for v in problem.solutions[0].tolist()])
    assert run(problem, "lemke").status is Status.RAY
    result = run(gallery.make("bimatrix", 3 * n, seed), "lemke")
    assert (result.status, result.iterations) == (Status.RAY, 1)
    if n <= 8:
        assert (
            run(
                gallery.make("fathi", n), "lemke", cover="ones", ties="lexicographic"
            ).iterations
            == 2**n
        )


@settings(max_examples=8)
@given(n=st.integers(1, 40), seed=st.integers(0, 10**6))
def test_programs_have_the_one_solution_that_is_known(n, seed):
    """Strictly complementary, with a regular basis: as M is positive semidefinite,
    there is no other."""
    for name in ("lp", "qp"):
        problem = gallery.make(name, n, seed)
        (z,) = problem.solutions
        P = z > 0
        assert (np.minimum(z, problem.w(z)) == 0).all()
        assert (np.maximum(z, problem.w(z)) > 0).all()
        assert np.linalg.matrix_rank(dense(problem.M)[np.ix_(P, P)]) == P.sum()


def test_linear_programs_are_sparse_when_large_and_solved():
    problem = gallery.make("lp", 600)
    assert [is_sparse(problem.M), is_sparse(gallery.make("lp", 200).M)] == [True, False]
    assert (
        np.minimum(problem.solutions[0], problem.w(problem.solutions[0])) == 0
    ).all()
    assert run(problem).solved


@pytest.mark.parametrize("name", gallery.FAMILIES)
def test_same_arguments_give_the_same_numbers_and_other_seeds_others(name):
    one, same, other = (of_size(name, 10, seed) for seed in (3, 3, 4))
    assert np.array_equal(dense(one.M), dense(same.M))
    assert np.array_equal(one.q, same.q)
    equal = np.array_equal(dense(one.M), dense(other.M)) and np.array_equal(
        one.q, other.q
    )
    assert equal is not gallery.is_random(name)


@pytest.mark.parametrize("name", gallery.FAMILIES)
def test_families_say_what_they_are_and_auto_comes_to_what_is_known(name):
    family = gallery.load(name)
    problem = gallery.make(name)
    assert gallery.FAMILIES[name]
    assert "\n" not in gallery.FAMILIES[name]
    assert family.__doc__
    assert problem.note or name == "harker-pang"
    assert problem.source
    assert problem.name in (name, f"{name}-{problem.n}")
    assert is_sparse(problem.M) or name not in SPARSE
    assert len(problem.solutions) == 1 or name not in WITH_SOLUTION
    assert problem.verdict == name or name not in ("infeasible", "unsolvable")
    assert (
        run(problem).status.word == (problem.verdict or "solved") or name == "gaussian"
    )
    for parameter in gallery.parameters_of(name):
        assert parameter in str(inspect.getdoc(family))
    if name not in FIXED:
        grain = GRAINS.get(name, 2)
        assert abs(gallery.make(name, 100).n - 100) <= grain / 2
        assert gallery.make(name, 1).n <= max(grain, 4)
