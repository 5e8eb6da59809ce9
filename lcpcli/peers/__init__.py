"""Other solvers by name, imported when they are asked for. A peer `p` is the module p of this package.

A peer's module opens with what it is, and has

    PACKAGE : the name of the distribution that must be installed.
    version() -> str | None : the installed version, None if it is not installed.
    excludes(problem) -> str : why it does not take such a problem, as a clause; "" if it does.
    solve(problem, tol, time_limit) -> Claim : what it makes of the problem, at its own tolerance tol where it has one.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Protocol, cast

from lcpcli.errors import OptionError

if TYPE_CHECKING:
    from lcpcli.problem import Problem
    from lcpcli.typing import Vector

PEERS = {
    "quantecon": "Lemke's method with the lexicographic rule, compiled (QuantEcon.py)",
}


@dataclass(frozen=True, eq=False)
class Claim:
    """What a peer says about a problem; nothing of it has been checked.

    z : shape (n,), or None where it gave none.
    solved : whether it says that z is a solution to its tolerance.
    seconds : time of its own work alone: no import, no compilation, no conversion of the data.
    statement : its own word for how it ended.
    """

    z: Vector | None
    solved: bool
    seconds: float
    statement: str


class Peer(Protocol):
    PACKAGE: str

    def version(self) -> str | None: ...

    def excludes(self, problem: Problem) -> str: ...

    def solve(self, problem: Problem, tol: float, time_limit: float) -> Claim: ...


def load(name: str) -> Peer:
    """The peer of that name."""
    if name not in PEERS:
        raise OptionError("--peer", f"{name!r} is unknown", f"choose one of {', '.join(PEERS)}")
    return cast(Peer, import_module(f"lcpcli.peers.{name.replace('-', '_')}"))
