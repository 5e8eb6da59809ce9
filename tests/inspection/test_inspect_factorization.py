"""The factorization in lcp inspect: exact entries, the faster library, and a note where there is none."""

from __future__ import annotations

import json
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from lcpcli import Problem
from lcpcli.cli.help import FOLDER
from lcpcli.inspection import difficulty as diagnosis
from lcpcli.inspection.difficulty import factorization
from lcpcli.inspection.inspection import inspect
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.linalg import shifted_systems
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.patterns import fill
from lcpcli.methods.interior_steps import Regularization
from lcpcli.report import inspection_text

N = 500


def banded(width: int, above: float = -1.0) -> sparse.csr_array:
    """Diagonally dominant, with -1 below the diagonal; its factors lie within its band."""
    values = [*[-1.0] * width, 4.0 * width, *[above] * width]
    return sparse.diags_array(values, offsets=range(-width, width + 1), shape=(N, N)).tocsr()


def problem(M: Any, **bounds: Any) -> Problem:
    return Problem(M, -np.ones(M.shape[0]), **bounds)


def shown(own: Problem) -> dict[str, Any] | None:
    found: dict[str, Any] | None = json.loads(inspection_text.as_json(inspect(own)))["factorization"]
    return found


def text(own: Problem) -> str:
    return " ".join(inspection_text.as_text(inspect(own)).split())


@pytest.mark.parametrize("width", [1, 2, 4])
def test_factors_of_a_banded_matrix_have_the_entries_of_its_band(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    one = N * (width + 1) - width * (width + 1) // 2
    both = 2 * one - N
    unsymmetric = shown(problem(banded(width, -0.5)))
    monkeypatch.setattr(shifted_systems, "_has_qdldl", lambda: False)
    for found in (unsymmetric, shown(problem(banded(width)))):
        assert found is not None
        assert found["library"] == "SuperLU"
        assert found["nonzeros"] == found["factor_nonzeros"] == both
        assert found["ratio"] == 1
        assert min(found["first_seconds"], found["repeated_seconds"]) > 0
        assert found["note"] is None
    monkeypatch.undo()
    pytest.importorskip("qdldl")
    monkeypatch.setattr(shifted_systems, "PATIENCE_SECONDS", np.inf)
    found = shown(problem(banded(width)))
    assert found is not None
    assert (found["library"], found["nonzeros"], found["factor_nonzeros"]) == ("QDLDL", both, one)
    assert found["ratio"] == one / both
    assert f"M + D by QDLDL: {both} entries of M, {one} of the factors" in text(problem(banded(width)))


def test_rows_and_columns_of_fixed_variables_do_not_count() -> None:
    lower = np.where(np.arange(N) % 2, 1.0, 0.0)
    found = shown(problem(banded(1), lower=lower, upper=np.where(lower, 1.0, np.inf)))
    assert found is not None
    assert found["nonzeros"] == found["factor_nonzeros"] == N // 2  # every other one is left, on the diagonal


def test_dense_matrices_have_no_fill_to_show() -> None:
    dense = problem(banded(1).toarray())
    assert shown(dense) is None
    assert "M + D" not in text(dense)


@pytest.mark.parametrize(
    ("own", "note"),
    [
        (problem(-(1 + Regularization.rho) * sparse.eye_array(3, format="csr")), "failed"),
        (problem(sparse.eye_array(3, format="csr"), lower=1.0, upper=1.0), "not needed: all variables are fixed"),
    ],
    ids=["singular", "fixed"],
)
def test_a_note_says_why_there_is_none(own: Problem, note: str) -> None:
    found = shown(own)
    assert found is not None
    assert found["note"].startswith(note)
    assert {found[key] for key in found if key not in ("nonzeros", "note")} == {None}
    assert f"factorization of M + D {note}" in text(own)


@pytest.mark.parametrize("done", [0, 1, 2])
@pytest.mark.parametrize(
    ("error", "note"), [(TimeIsUp, "stopped after 5 s"), (SingularMatrix, "failed"), (MemoryError, "failed")]
)
def test_what_is_known_before_it_ends_early_is_kept(
    done: int, error: type[Exception], note: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    factorize = iter([*[None] * done, error]).__next__

    def fake(_: Any) -> None:
        if (raised := factorize()) is not None:
            raise raised

    own = SimpleNamespace(factorize=fake, library="SuperLU", nonzeros=7)
    monkeypatch.setattr(diagnosis, "sparse_systems", lambda M, S: own)  # noqa: ARG005
    found = factorization(problem(banded(1)), 5.0)
    assert found is not None
    assert found.note.startswith(note)
    assert (found.factor_nonzeros == 7) == (found.first is not None) == (done > 0)
    assert (found.repeated is not None) == (done > 1)


@pytest.mark.parametrize(("seconds", "library"), [(0.5, "SuperLU"), (2.0, "QDLDL")])
def test_the_library_is_the_one_that_repeats_it_faster(
    seconds: float, library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("qdldl")
    for module in (diagnosis, shifted_systems):
        clock = SimpleNamespace(seconds=iter([0.0, 9.0, 0.0, 1.0, 0.0, seconds]).__next__)
        monkeypatch.setattr(module, "clock", clock)
    found = factorization(problem(banded(1)), 5.0)
    assert found is not None
    assert (found.library, found.first, found.repeated) == (library, 9.0, min(seconds, 1.0))


def test_too_many_entries_are_counted_before_any_is_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    own = problem(sparse.csr_array(np.triu(np.ones((9, 9)))))
    monkeypatch.setattr(diagnosis, "affordable", lambda M: False)  # noqa: ARG005
    monkeypatch.setattr(diagnosis, "MOST_FILL", 36)
    assert factorization(own, 5.0).note == ""
    monkeypatch.setattr(diagnosis, "MOST_FILL", 35)
    monkeypatch.setattr(diagnosis, "sparse_systems", lambda M, S: pytest.fail("tried"))  # noqa: ARG005
    assert "factorization of M + D not tried: its factors may have more than 4e+01 entries" in text(own)


@pytest.mark.parametrize("seed", range(5))
def test_entries_of_factors_are_counted_as_elimination_makes_them(seed: int) -> None:
    random = np.random.default_rng(seed)
    M = sparse.csr_array(np.eye(30) + (random.random((30, 30)) < 0.05))
    pattern = (M + M.T).toarray() != 0
    order = np.argsort(pattern.sum(axis=0), kind="stable")
    pattern = pattern[np.ix_(order, order)]
    for j in range(30):
        below = np.flatnonzero(pattern[j + 1 :, j]) + j + 1
        pattern[np.ix_(below, below)] = True
    entries = int(np.tril(pattern, -1).sum())
    assert fill(M, entries) == entries
    assert entries > (np.count_nonzero((M + M.T).toarray()) - 30) / 2
    assert fill(M, entries - 1) > entries - 1
    with within(0.0), pytest.raises(TimeIsUp):
        fill(M, entries)


def test_every_key_in_json_is_documented() -> None:
    documented = re.findall(r"^\| `factorization\.(\w+)` \|", (FOLDER / "json.md").read_text(), re.MULTILINE)
    found = shown(problem(banded(1)))
    assert found is not None
    assert documented == list(found)
