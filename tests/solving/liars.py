"""A toy method that lies: what it yields and how it ends is made up by a test, and the
loop has to find out."""

import json
import sys
from types import ModuleType

import numpy as np
import pytest

from lcpcli import run
from lcpcli.methods.registry import METHODS, Method
from lcpcli.methods.stages import Finished, Iterate
from lcpcli.model.changes import shifted

from .. import exact_measure

# The statement of false certificates.
LIE = "by a proof that there is no need to look at"


class Liar:
    """The method "liar", for as long as a test takes.

    steps : its iterates, in the variables of the given problem.
    ending : an ending, or what makes one from the problem that the method works on.
    """

    def __init__(self, patch):
        self._patch = patch

    def register(self, problem, steps=(), ending=None, **declaration):
        """Make it yield these iterates and end like this."""
        moved = problem.reference_z is not None

        # Every method has it.
        def liar(own, x0):  # noqa: ARG001
            for step in steps:
                yield step._replace(x=shifted(problem).start(step.x)) if moved else step
            return ending(own) if callable(ending) else ending or Finished()

        module = ModuleType("lcpcli.methods.liar")
        module.__dict__["liar"] = liar
        self._patch.setitem(sys.modules, module.__name__, module)
        self._patch.setitem(
            METHODS,
            "liar",
            Method("a method that lies", **{"takes_bounds": True} | declaration),
        )

    def run(self, problem, steps=(), ending=None, declaration=None, **options):
        self.register(problem, steps, ending, **(declaration or {}))
        method = "liar"
        return run(problem, method, **options)


def at(z, F=None):
    """An iterate whose z is this admissible one, with F as claimed."""
    z = np.asarray(z, dtype=float)
    return Iterate(z / 2, None if F is None else np.full(z.size, F), "", 1)


def assert_refused(result, *statuses):
    """Nothing in a result says that the problem is solved or has no solution, and its
    measures are those of its z."""
    text = result.to_json()
    record = json.loads(text)
    assert record["status"] == result.status.word
    assert record["status"] in (statuses or ("stalled",)), result.message
    assert (result.solved, result.success, result.status.has_no_solution) == (
        False,
        False,
        False,
    )
    assert result.certificate is None
    assert (record["solved"], record["certificate"], record["exact"]) == (
        False,
        None,
        None,
    )
    assert LIE not in text
    assert "proved" not in result.message
    assert np.isfinite(result.z).all()
    assert np.array_equal(record["z"], result.z)
    true = exact_measure.relative_residual(result.problem, result.z)
    assert true > result.tol
    assert result.relative_residual == pytest.approx(true, rel=0.1)
    if result.problem.origin is not None:
        statement = record["answer"]["statement"]
        shown = {key for key, value in record["answer"].items() if value is not None}
        if record["answer"]["kind"] == "qp":
            assert statement.startswith("x does not solve the program: ")
            assert shown <= {
                "kind",
                "statement",
                "x",
                "y",
                "bound_multipliers",
                "objective",
                "rows",
                "columns",
            } | {
                "activities",
                "slacks",
            }
        else:
            assert statement.startswith("not solved, so there ")
            assert shown <= {"kind", "statement"}
