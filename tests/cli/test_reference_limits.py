"""`lcp compare` with a time limit that ends while the reference is refined."""

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.interrupts import TimeIsUp, deadline_after
from lcpcli.solving import proof


@pytest.mark.parametrize("form", ["table", "json", "csv", "markdown"])
def test_time_limit_within_the_reference_leaves_it_out(form, lcp, tmp_path):
    rng = np.random.default_rng(0)
    A = rng.standard_normal((300, 300))
    np.savez(tmp_path / "p.npz", M=A @ A.T + np.eye(300), q=rng.standard_normal(300))
    for limit in ("1e-4", "1e-3", "1e-2", "0.1"):
        command = f"compare {tmp_path / 'p.npz'} --method lemke --time-limit {limit}"
        outcome = lcp(f"{command} --format {form}")
        assert outcome.code != 2
        assert "Traceback" not in outcome.err


def test_refinement_that_runs_out_of_time_leaves_the_problem_without_a_reference(
    monkeypatch,
):
    def late(*_):
        raise TimeIsUp

    monkeypatch.setattr(proof, "accurate_basic_solution", late)
    monkeypatch.setattr(proof, "MAX_EXACT_UNKNOWNS", 0)
    problem = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
    with deadline_after(10):
        assert not proof.with_reference(problem).solutions
