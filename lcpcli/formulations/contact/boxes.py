"""The contact model of game engines: a sequence of mixed problems with friction bounds
from the previous one.
"""

from __future__ import annotations

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ProblemError
from lcpcli.formulations.contact.friction import Contact
from lcpcli.model.problem import Problem

MAX_BOXES = 100
# A change of the friction bounds below this, relative to the largest one, is considered
# 0.
AT_REST = 1e-10


def last_box(contact: Contact, name: str, source: str, note: str) -> Problem:
    """Return the mixed problem in which the friction bounds no longer change, or the
    last of MAX_BOXES; its note says which. Raises ProblemError if one of them is not
    solved.
    """
    with imports:
        from lcpcli.solving.call import run
    tangents = contact.friction.tangents[:, 0]
    x, told = np.zeros(contact.b.size), f"no fixed point in {MAX_BOXES} boxes"
    for number in range(1, MAX_BOXES + 1):
        lower, upper = contact.box(x)
        box = Problem(contact.A, contact.b, lower=lower, upper=upper)
        result = run(box)
        if not result.solved:
            reason = f"have no solved box {number}: {result.message}"
            raise ProblemError("A and b", reason, "leave lagged out")
        x = result.z
        max_friction, before = contact.box(x)[1][tangents], upper[tangents]
        size = abs(max_friction).max(initial=0.0)
        if abs(max_friction - before).max(initial=0.0) <= AT_REST * size:
            told = f"a fixed point: box {number}"
            break
    note = ". ".join(filter(None, (note, f"Boxes of friction that lags: {told}")))
    return box.having(name=name, source=source, note=note)
