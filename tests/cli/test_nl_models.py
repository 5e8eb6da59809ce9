"""Models of AMPL in the commands, and lcp in the place of a solver that AMPL calls."""

import gzip
from types import SimpleNamespace

import numpy as np
import pytest

import lcpcli
from lcpcli.formulations.nonlinear_model import ampl
from lcpcli.formulations.nonlinear_model.ampl import NUMBERS
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.solving import solve_mcp
from lcpcli.solving.result import Status

from .. import literature
from ..files.nl_writing import model
from .models import FILES, PLANT


@pytest.fixture(autouse=True)
def models(folder):
    for name, content in FILES.items():
        (folder / name).write_bytes(content)
    return folder


@pytest.mark.parametrize("name", ["solve", "check", "inspect", "ampl", "faults"])
def test_commands_print_what_the_document_shows(name, document):
    document(f"models/{name}")


def test_ampl_hears_of_stationary_points_and_gives_options_in_two_places(
    lcp, models, monkeypatch
):
    assert (
        "stalled: z is almost a stationary point"
        in lcp("hopeless -AMPL restarts=0").out
    )
    *_, value, last = (models / "hopeless.sol").read_text().splitlines()
    assert np.isfinite(float(value))
    assert 403 <= int(last.removeprefix("objno 0 ")) < 500
    monkeypatch.setenv("lcp_options", "max_iterations=0 tol=1e-8")
    assert lcp("linear -AMPL").code == 0
    for options, number in (((), 400), (("max_iterations=90",), 0)):
        assert lcp("market", "-AMPL", *options).code == 0
        assert (models / "market.sol").read_text().endswith(f"\nobjno 0 {number}\n")


def test_number_for_ampl_says_solved_of_nothing_but_what_is_solved():
    assert {status for status, number in NUMBERS.items() if number < 200} == {
        Status.SOLVED
    }
    assert all(
        200 <= number < 300
        for status, number in NUMBERS.items()
        if status.has_no_solution
    )


def test_run_without_a_finite_point_writes_no_values(models, monkeypatch):
    run = SimpleNamespace(
        message="a message",
        iterations=1,
        residual=1.0,
        advice="",
        problem=SimpleNamespace(origin=None),
    )
    for status, z, told in (
        (Status.DIVERGED, np.array([np.nan, 1.0]), 500),
        (Status.TIME_LIMIT, None, 500),
        (Status.UNSOLVABLE, None, 201),
    ):
        ended = SimpleNamespace(**vars(run), status=status, z=z)
        monkeypatch.setattr(solve_mcp, "run_nonlinear", lambda *_, own=ended, **__: own)
        assert ampl.run(str(models / "market"), []) == 0
        *_, values, last = (models / "market.sol").read_text().splitlines()
        assert (values, last) == ("0", f"objno 0 {told}")


def test_terms_that_cancel_keep_their_domain(lcp, folder):
    log = ("log", "v0")
    for name, terms in (
        ("difference", ("-", log, log)),
        ("product", ("*", 0, log)),
        ("power", ("^", log, 0)),
    ):
        side = 0 if name == "power" else -1  # x = -1, where the logarithm is undefined
        (folder / f"{name}.nl").write_bytes(
            model(1, [((4, side), {0: 1}, terms)], [(3,)])
        )
        done = lcp(f"solve {name}.nl --z0 1 -m josephy-newton:restarts=0 -q")
        assert done.code == 1, done


def test_nonlinear_problems_are_verified_in_python():
    problem = literature.josephy()
    assert lcpcli.check(problem, problem.solutions[0]).accepted
    assert not lcpcli.check(problem, [0, 0, 0, 1]).accepted
    cancelling = NonlinearProblem(
        lambda z: np.exp(z) - 1.0000000001, lower=None, x0=[0.0]
    )
    for each in (cancelling, literature.mathiesen()):
        assert lcpcli.check(each, lcpcli.solve_mcp(each).z).accepted, each
    assert not lcpcli.check(cancelling, [1e-9]).accepted
    assert not lcpcli.check(
        NonlinearProblem(lambda z: z - 1, x0=[0.0], upper=0.5), [1.0]
    ).accepted


def test_inspection_in_python_counts_the_operators_of_a_model(models):
    inspected = lcpcli.inspect(lcpcli.read_nl(models / "market.nl"))
    assert inspected.operators == {"power": 1, "quotient": 1}
    assert inspected.common_expressions == 0
    assert inspected.fixed_variables == 1


def test_inspection_of_problems_without_an_expression_has_no_operators():
    # J of the first one is singular at 0.
    for problem, hints in ((literature.josephy(), 1), (literature.bratu(12), 0)):
        inspected = lcpcli.inspect(problem)
        assert inspected.structural_rank == problem.n
        assert len(inspected.hints) == hints
        assert inspected.operators is None
        assert "structural rank" in repr(inspected)


def test_compressed_models_have_their_names(models, lcp):
    (models / "plant.nl.gz").write_bytes(gzip.compress(PLANT))
    assert lcp("solve plant.nl.gz --format json").record["names"] == ["plant"]
