"""The views of records: modules of rooms above, loaded on first use, whose functions
the methods of records call.

A record, such as a Problem or a Result, holds what was found; what shows, explains or
differentiates it is a function above it. The class owns its methods all the same, so
that an unpickled object has them: each is one line that calls a view. Nothing is
imported upwards, and no time of a run is that of loading a view.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from lcpcli.clock import imports

ROOMS = {  # the modules by their rooms
    "verify": "digits",
    "solving": "advice minimum",
    "parametric": "derivative",
    "report": (
        "inspection_text outcome path_formats plotting result_formats tables "
        "verification_text"
    ),
}


def __getattr__(name: str) -> Any:
    for room, names in ROOMS.items():
        if name in names.split():
            with imports:
                module = globals()[name] = import_module(f"lcpcli.{room}.{name}")
            return module
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
