"""The views of records: modules of rooms above, loaded on first use, whose functions the methods of records call.

A record, such as a Problem or a Result, holds what was found; what shows, explains or differentiates it is a function
above it. The class owns its methods all the same, so that an unpickled object has them: each is one line that calls a
view. Nothing is imported upwards, and no time of a run is that of loading a view.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from lcpcli.clock import imports

if TYPE_CHECKING:
    from lcpcli.parametric import batches as batches
    from lcpcli.parametric import derivative as derivative
    from lcpcli.report import inspection_text as inspection_text
    from lcpcli.report import json_lines as json_lines
    from lcpcli.report import notebook as notebook
    from lcpcli.report import path_figure as path_figure
    from lcpcli.report import path_formats as path_formats
    from lcpcli.report import plotting as plotting
    from lcpcli.report import verification_text as verification_text
    from lcpcli.solving import advice as advice
    from lcpcli.solving import answer as answer
    from lcpcli.solving import minimum as minimum
    from lcpcli.solving import suggestions as suggestions
    from lcpcli.verify import digits as digits

ROOMS = {  # the modules by their rooms
    "verify": "digits",
    "solving": "advice answer minimum suggestions",
    "parametric": "batches derivative",
    "report": "inspection_text json_lines notebook path_figure path_formats plotting verification_text",
}


if not TYPE_CHECKING:  # otherwise type checkers would not find misspelt names

    def __getattr__(name: str) -> Any:
        for room, names in ROOMS.items():
            if name in names.split():
                with imports:
                    module = globals()[name] = import_module(f"lcpcli.{room}.{name}")
                return module
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
