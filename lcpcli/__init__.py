"""Linear complementarity problems: find z >= 0 with w = M z + q >= 0 and z'w = 0.

M is a real matrix of shape (n, n), dense or sparse, q a vector of n numbers.

    solve        one call from M and q to a Result
    Problem      M and q, with a name, a starting point and known solutions
    read, write  problems from and to files
    run          the same from a Problem, as read from a file; with the same options
    Result       the outcome: its Status, z, w, the residual and more
    error_bound  a proved bound on the distance of a z from the solution
    from_qp      the Problem of a quadratic program; Result.answer has its minimizer
    from_game    the Problem of a two-player game; Result.answer has its equilibrium

>>> import lcpcli
>>> result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
>>> result.solved, result.z.round(6).tolist(), result.w.round(6).tolist()
(True, [1.333333, 2.333333], [0.0, 0.0])

Invalid problems and options raise a `lcpcli.errors.LCPError`, which says where, what is wrong, and how to fix it. The
public names are loaded on first use, so that importing the package costs nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lcpcli.bounds.error_bound import error_bound as error_bound
    from lcpcli.files.reading import read as read
    from lcpcli.files.writing import write as write
    from lcpcli.model.from_game import from_game as from_game
    from lcpcli.model.from_program import from_qp as from_qp
    from lcpcli.model.problem import Problem as Problem
    from lcpcli.solving.call import run as run
    from lcpcli.solving.call import solve as solve
    from lcpcli.solving.result import Result as Result
    from lcpcli.solving.result import Status as Status
    from lcpcli.solving.trace import Trace as Trace

__version__ = "0.1.0"

_HOMES = {
    "Problem": "model.problem",
    "Result": "solving.result",
    "Status": "solving.result",
    "Trace": "solving.trace",
    "error_bound": "bounds.error_bound",
    "from_game": "model.from_game",
    "from_qp": "model.from_program",
    "read": "files.reading",
    "run": "solving.call",
    "solve": "solving.call",
    "write": "files.writing",
}

__all__ = [
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


_PICTURES = {  # representations of classes, by functions of report.notebook
    "Problem": {"__repr__": "problem_text", "_repr_html_": "problem_html"},
    "Result": {"__repr__": "result_text", "_repr_html_": "result_html"},
    "Trace": {"__repr__": "trace_text"},
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"lcpcli.{_HOMES[name]}"), name)
    _give_pictures()
    return value


def _give_pictures() -> None:
    """Give the loaded classes the representations of report/, which is imported on demand."""
    for name in list(_PICTURES):
        module = sys.modules.get(f"lcpcli.{_HOMES[name]}")
        if module is not None:
            for method, function in _PICTURES.pop(name).items():
                setattr(getattr(module, name), method, _picture(function))


def _picture(function: str) -> Callable[[Any], str]:
    def shown(self: Any) -> str:
        drawn: str = getattr(import_module("lcpcli.report.notebook"), function)(self)
        return drawn

    return shown


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
