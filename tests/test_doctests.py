"""The examples in the docstrings run, every public name has some, and what the interpreter shows is short and true."""

from __future__ import annotations

import doctest
import inspect
import pydoc
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import eye_array

import lcpcli
from lcpcli import Problem, Trace, read, run, solve
from lcpcli.files import contents

HOMES = ["lcpcli", *sorted({getattr(lcpcli, name).__module__ for name in lcpcli.__all__})]


@pytest.mark.parametrize("module", HOMES)
def test_examples_run(module: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = doctest.testmod(import_module(module), optionflags=doctest.ELLIPSIS)
    assert found.attempted
    assert not found.failed


def test_every_public_name_has_an_example_and_stands_in_the_help() -> None:
    text = pydoc.plain(pydoc.render_doc(lcpcli))
    assert "find z >= 0" in text
    for name in lcpcli.__all__:
        assert ">>> " in (inspect.getdoc(getattr(lcpcli, name)) or ""), name
        assert name in text


def test_result_shows_what_matters_in_one_line() -> None:
    result = run(read(contents.shipped_path("paper-example-1.json")), "fixed-point")
    assert repr(result).startswith("<Result: solved by fixed-point, n = 4, residual ")
    assert ", error 1.2e-10, in " in repr(result)
    assert repr(result).endswith("z = (1, 0, 1, 0)>")
    failed = run(result.problem, "fixed-point", max_iterations=2)
    assert repr(failed).startswith("<Result: iteration limit by fixed-point, ")


def test_long_results_and_traces_are_shown_short() -> None:
    n = 10_000
    result = solve(eye_array(n), -np.ones(n), trace=True)
    assert len(repr(result)) < 200
    assert "1, ..., 1)" in repr(result)
    assert repr(result.trace).startswith("<Trace: ")
    assert len(repr(result.trace)) < 80
    assert repr(Trace(every=5)) == "<Trace: 0 iterates, every = 5>"
    assert repr(result.problem) == f"<Problem: n = {n}, sparse, {n} stored entries>"


def test_notebooks_show_tables_in_which_names_are_harmless() -> None:
    problem = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, 1.25], name="<script>", solutions=[[2.5, 0.0]])
    html = problem._repr_html_()
    assert "<script>" not in html
    assert "&lt;script&gt;" in html
    assert "<td>1.25</td>" in html
    shown = run(problem, "newton")._repr_html_()
    assert "solved by newton" in shown
    assert "(2.5, 0)" in shown
    failed = run(problem, "fixed-point", max_iterations=1)._repr_html_()
    assert "stopped at the iteration limit" in failed
    assert "try method=&quot;auto&quot;" in failed
    assert "<table>" not in Problem(np.eye(9), np.ones(9))._repr_html_(), "of a small problem alone"
