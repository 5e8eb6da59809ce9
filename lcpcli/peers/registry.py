"""Other solvers by name, imported on demand. The peer `p` is the object p (with _ for -) in its file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast

from lcpcli.errors import OptionError, likely, quoted

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.typing import Vector


class Entry(NamedTuple):
    """A peer: its file and its meaning."""

    file: str
    meaning: str


REGISTRY = {
    "quantecon": Entry("packages", "Lemke's method with the lexicographic rule, compiled (QuantEcon.py)"),
    "piqp": Entry("packages", "proximal interior-point method for quadratic programs (PIQP)"),
    "clarabel": Entry("packages", "interior-point method for conic programs (Clarabel)"),
    "osqp": Entry("packages", "operator splitting for quadratic programs (OSQP)"),
    "daqp": Entry(
        "packages", "dual active-set method for quadratic programs and affine variational inequalities (DAQP)"
    ),
    "highs": Entry("packages", "active-set method for quadratic programs (HiGHS)"),
    "siconos-newton": Entry("siconos", "Newton's method on the minimum function, with a line search (Siconos)"),
    "siconos-pgs": Entry("siconos", "projected Gauss-Seidel (Siconos)"),
    "siconos-lemke": Entry("siconos", "Lemke's method with the lexicographic rule (Siconos)"),
}
PEERS = {name: entry.meaning for name, entry in REGISTRY.items()}


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
    """Another solver."""

    def version(self) -> str | None:
        """The installed version, None if it is not installed."""

    def excludes(self, problem: Problem) -> str:
        """Why it cannot be given this problem, as a clause; "" if it can."""

    def solve(self, problem: Problem, tol: float, time_limit: float) -> Claim:
        """Its answer, with tol as its own tolerance and at most time_limit seconds, if it has such settings.

        Raises OptionError if it is not installed.
        """


def load(name: str) -> Peer:
    """The peer of that name."""
    if name not in REGISTRY:
        raise _unknown(name)
    return cast(Peer, getattr(import_module(f"lcpcli.peers.{REGISTRY[name].file}"), name.replace("-", "_")))


def select(names: Iterable[str]) -> list[str]:
    """The named peers, each once. The part of a name before the dash ("siconos") selects all peers of that package.

    Raises OptionError for an unknown name, with a suggestion.
    """
    selected: dict[str, None] = {}
    for name in names:
        meant = [peer for peer in REGISTRY if peer == name or peer.startswith(f"{name}-")]
        if not meant:
            raise _unknown(name)
        selected |= dict.fromkeys(meant)
    return list(selected)


def _unknown(name: str) -> OptionError:
    return OptionError("--peer", f"{quoted(name)} is unknown", likely(name, REGISTRY))


def distribution_version(package: str) -> str | None:
    """The version of a distribution, found without importing it; None if it is not installed."""
    from importlib import metadata

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
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
