"""Linear complementarity problems: find z >= 0 with w = M z + q >= 0 and z'w = 0.

The public names are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lcpcli.api import solve as solve
    from lcpcli.bounds import error_bound as error_bound
    from lcpcli.driver import Limits as Limits
    from lcpcli.driver import run as run
    from lcpcli.files import read as read
    from lcpcli.files import write as write
    from lcpcli.problem import Problem as Problem
    from lcpcli.result import Result as Result
    from lcpcli.result import Status as Status
    from lcpcli.trace import Trace as Trace

__version__ = "0.1.0"

_HOMES = {
    "Limits": "driver",
    "Problem": "problem",
    "Result": "result",
    "Status": "result",
    "Trace": "trace",
    "error_bound": "bounds",
    "read": "files",
    "run": "driver",
    "solve": "api",
    "write": "files",
}

__all__ = ["Limits", "Problem", "Result", "Status", "Trace", "error_bound", "read", "run", "solve", "write"]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"lcpcli.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
