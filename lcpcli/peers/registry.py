"""Other solvers by name, imported on demand. The peer `p` is the module p of this package (with _ for -).

A peer's docstring says what the solver is and what the tolerance means to it. Its module provides

    version() -> str | None : the installed version, None if it is not installed.
    excludes(problem) -> str : why it cannot be given this problem, as a clause; "" if it can.
    solve(problem, tol, time_limit) -> Claim : its answer to the problem, with tol as its own tolerance and at most
        time_limit seconds, if it has such settings. OptionError if it is not installed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol, cast

from lcpcli.errors import OptionError, likely, quoted

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.typing import Vector

PEERS = {
    "quantecon": "Lemke's method with the lexicographic rule, compiled (QuantEcon.py)",
    "piqp": "proximal interior-point method for quadratic programs (PIQP)",
    "clarabel": "interior-point method for conic programs (Clarabel)",
    "osqp": "operator splitting for quadratic programs (OSQP)",
    "daqp": "dual active-set method for quadratic programs and affine variational inequalities (DAQP)",
    "highs": "active-set method for quadratic programs (HiGHS)",
    "siconos-newton": "Newton's method on the minimum function, with a line search (Siconos)",
    "siconos-pgs": "projected Gauss-Seidel (Siconos)",
    "siconos-lemke": "Lemke's method with the lexicographic rule (Siconos)",
}


@dataclass(frozen=True, eq=False)
class Claim:
    """What a peer claims about a problem; none of it has been checked.

    z : shape (n,), or None if it returned none.
    solved : whether it claims that z is a solution to within its tolerance.
    seconds : from the arrays of the problem to its answer, without importing and compiling.
    statement : how it ended, in its own words.
    """

    z: Vector | None
    solved: bool
    seconds: float
    statement: str


class Peer(Protocol):
    def version(self) -> str | None: ...

    def excludes(self, problem: Problem) -> str: ...

    def solve(self, problem: Problem, tol: float, time_limit: float) -> Claim: ...


def load(name: str) -> Peer:
    """The peer of that name."""
    if name not in PEERS:
        raise _unknown(name)
    return cast(Peer, import_module(f"lcpcli.peers.{name.replace('-', '_')}"))


def select(names: Iterable[str]) -> list[str]:
    """The named peers, each once. The part of a name before the dash ("siconos") selects all peers of that package.

    Raises OptionError for an unknown name, with a suggestion.
    """
    selected: dict[str, None] = {}
    for name in names:
        meant = [peer for peer in PEERS if peer == name or peer.startswith(f"{name}-")]
        if not meant:
            raise _unknown(name)
        selected |= dict.fromkeys(meant)
    return list(selected)


def installed() -> list[str]:
    """The peers that are installed."""
    return [name for name in PEERS if load(name).version() is not None]


def distribution_version(package: str) -> str | None:
    """The version of a distribution, found without importing it; None if it is not installed."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as version_of

    try:
        return version_of(package)
    except PackageNotFoundError:
        return None


def library(module: str) -> Any:
    """A solver's Python package, imported. OptionError if it is not installed."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module.partition(".")[0]:
            raise
        hint = "pip install 'linear-complementarity[peers]'"
        raise OptionError("--peer", f"{error.name} is not installed", hint) from None


def _unknown(name: str) -> OptionError:
    return OptionError("--peer", f"{quoted(name)} is unknown", likely(name, PEERS))
