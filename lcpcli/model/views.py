"""The views of records: modules of subpackages above, loaded on first use, whose
functions the methods of records call.

A record, such as a Problem or a Result, holds data; what shows, explains or
differentiates it is a function above it. The class has methods all the same, so that an
unpickled object has them: each is one line that calls a view. Nothing is imported
upwards, and no time of a run is that of loading a view.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from lcpcli.clock import imports

SUBPACKAGES = {  # of the modules
    "digits": "verify",
    "advice": "solving",
    "derivative": "parametric",
    "inspection_text": "report",
    "outcome": "report",
    "path_formats": "report",
    "plotting": "report",
    "result_formats": "report",
    "tables": "report",
    "verification_text": "report",
}


def __getattr__(name: str) -> Any:
    if name not in SUBPACKAGES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    with imports:
        module = globals()[name] = import_module(f"lcpcli.{SUBPACKAGES[name]}.{name}")
    return module
