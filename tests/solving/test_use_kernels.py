"""A process whose calls all use the compiled kernels: by `use_kernels` or its
environment, and never by itself."""

import os
import subprocess
import sys

import numpy as np
import pytest

import lcpcli
from lcpcli import options, solve
from lcpcli.errors import OptionError, ParameterError
from lcpcli.gallery import families
from lcpcli.linalg.matrices import dense
from lcpcli.options import KERNELS
from lcpcli.solving import direct_run

from .. import kernels_together  # noqa: F401

pytest.importorskip("numba")
NAMES = ("harker-pang", "boxes", "contact", "bimatrix", "obstacle")
pytestmark = pytest.mark.usefixtures("kernels_by_default")


def demand(p):
    return p + p**2 / 4 - np.array([9, 4]) / (1 + p)


def columns(problem):
    return np.column_stack([problem.q * factor for factor in (1.0, 2.0, 0.5, 3.0)])


WAYS = {
    "alone": lambda p, **own: [
        lcpcli.run(p, **own),
        solve(p.M, p.q, **p.bounds, **own),
    ],
    "list": lambda p, **own: list(lcpcli.solve_many(2 * [p], **own)),
    "one matrix": lambda p, **own: list(
        lcpcli.solve_many(p.M, columns(p), **p.bounds, **own)
    ),
    "batch": lambda p, **own: list(
        lcpcli.solve_many(dense(p.M)[None], p.q[None], **p.bounds, **own)
    ),
    "nonlinear": lambda _, **own: [lcpcli.solve_mcp(demand, x0=[1.0, 1.0], **own)],
}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize("name", NAMES)
def test_answers_are_those_of_calls_that_ask_for_the_kernels(name, way):
    problem = families.make(name, 12, 3)
    asked, plain = way(problem, compiled=True), way(problem)
    lcpcli.use_kernels()
    for result, other, usual, off in zip(
        way(problem), asked, plain, way(problem, compiled=False), strict=True
    ):
        assert result.solved
        assert np.array_equal(result.z, other.z)
        assert result.route == other.route
        assert result.options == other.options
        assert result.basis == other.basis
        assert "compiled" not in usual.options
        assert off.options == usual.options


def test_results_of_single_problems_say_whether_kernels_made_them():
    before = solve([[2, 1], [1, 2]], [-5, -6])
    lcpcli.use_kernels()
    during = [
        solve([[2, 1], [1, 2]], [-5, -6]),
        lcpcli.Solver([[2, 1], [1, 2]]).solve([-5, -6]),
    ]
    during += [
        lcpcli.run(lcpcli.from_qp(np.eye(3), -np.ones(3))),
        lcpcli.run(families.make("obstacle", 900, 0)),
    ]
    assert [
        result.to_dict()["options"].get("compiled") for result in [before, *during]
    ] == [None, *4 * [True]]
    lcpcli.use_kernels(False)
    assert solve([[2, 1], [1, 2]], [-5, -6]).options == before.options


def test_other_methods_are_as_before_and_not_refused():
    before = solve([[2, 1], [1, 2]], [-5, -6], "shi")
    lcpcli.use_kernels()
    result = solve([[2, 1], [1, 2]], [-5, -6], "shi")
    (of_many,) = lcpcli.solve_many([result.problem], "shi")
    assert result.options == of_many.options == before.options
    assert np.array_equal(result.z, before.z)


def test_without_numba_it_is_refused_and_nothing_changes(
    monkeypatch, kernels_by_default
):
    monkeypatch.setattr(direct_run, "has_numba", lambda: False)
    with pytest.raises(
        ParameterError, match=r"^use_kernels: needs numba; pip install numba$"
    ):
        lcpcli.use_kernels()
    lcpcli.use_kernels(False)
    assert solve([[2]], [-1]).solved
    monkeypatch.setattr(options, "has_numba", lambda: False)
    kernels_by_default("1")
    with pytest.raises(
        OptionError, match=r"^LCPCLI_KERNELS: needs numba; pip install numba$"
    ):
        solve([[2]], [-1])
    assert solve([[2]], [-1], compiled=False).solved


CALL = (
    "import lcpcli, sys; print(lcpcli.solve([[2]], [-1]).options.get('compiled'), "
    "'numba' in sys.modules)"
)


@pytest.mark.parametrize(
    ("value", "says"), [("1", "True True"), ("0", "None False"), ("", "None False")]
)
def test_a_process_starts_with_them_by_its_environment(value, says):
    own = os.environ | {KERNELS: value}
    done = subprocess.run(
        [sys.executable, "-c", CALL],
        capture_output=True,
        text=True,
        check=True,
        env=own,
    )
    assert done.stdout.strip() == says
