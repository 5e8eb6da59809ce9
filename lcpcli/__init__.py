"""Linear complementarity problems: find z >= 0 with w = M z + q >= 0 and z'w = 0.

M is a real matrix of shape (n, n), dense or sparse, q a vector of n numbers.

    solve        one call from M and q to a Result
    Problem      M and q, with a name, a start and the solutions that are known
    read, write  problems from and to files
    run          a method on a Problem, with Limits and a Trace of the iterates
    Result       what came out: its Status, z, w, the residual and more
    error_bound  how far a z can be from the solution, proved
    from_qp      the Problem of a quadratic program; Result.answer has its minimum
    from_game    the Problem of a game of two players; Result.answer has its equilibrium

>>> import lcpcli
>>> result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
>>> result.solved, result.z.round(6).tolist(), result.w.round(6).tolist()
(True, [1.333333, 2.333333], [0.0, 0.0])

What cannot be used as a problem or an option is a `lcpcli.errors.LCPError`, which names the place, the fault and the
mend. The public names are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lcpcli.api import solve as solve
    from lcpcli.bounds import error_bound as error_bound
    from lcpcli.driver import run as run
    from lcpcli.files import read as read
    from lcpcli.files import write as write
    from lcpcli.limits import Limits as Limits
    from lcpcli.origins.game import from_game as from_game
    from lcpcli.origins.qp import from_qp as from_qp
    from lcpcli.problem import Problem as Problem
    from lcpcli.result import Result as Result
    from lcpcli.result import Status as Status
    from lcpcli.trace import Trace as Trace

__version__ = "0.1.0"

_HOMES = {
    "Limits": "limits",
    "Problem": "problem",
    "Result": "result",
    "Status": "result",
    "Trace": "trace",
    "error_bound": "bounds",
    "from_game": "origins.game",
    "from_qp": "origins.qp",
    "read": "files",
    "run": "driver",
    "solve": "api",
    "write": "files",
}

__all__ = [
    "Limits",
    "Problem",
    "Result",
    "Status",
    "Trace",
    "error_bound",
    "from_game",
    "from_qp",
    "read",
    "run",
    "solve",
    "write",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"lcpcli.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
