"""Other solvers by name, imported on demand. The peer `p` is the object p (with _ for -) in its file. Solvers that
cannot be interrupted run in processes of their own, which a crash or the time limit ends."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any, Protocol, cast

from lcpcli import clock
from lcpcli.errors import OptionError, ParameterError, likely, quoted

if TYPE_CHECKING:
    from lcpcli.typing import Vector

# the file of each peer, and its meaning
REGISTRY = {
    "quantecon": ("packages", "Lemke's method with the lexicographic rule, compiled (QuantEcon.py)"),
    "piqp": ("packages", "proximal interior-point method for quadratic programs (PIQP)"),
    "clarabel": ("packages", "interior-point method for conic programs (Clarabel)"),
    "osqp": ("packages", "operator splitting for quadratic programs (OSQP)"),
    "daqp": ("packages", "dual active-set method for quadratic programs and affine variational inequalities (DAQP)"),
    "highs": ("packages", "active-set method for quadratic programs (HiGHS)"),
    "path-start": ("path_library", "stabilized Newton method from a problem's start, also nonlinear ones (PATH 5.2)"),
    "gambit": ("packages", "Lemke's method for one equilibrium of a game (Gambit)"),
}
PEERS = {name: meaning for name, (_, meaning) in REGISTRY.items()}
NONLINEAR = ("path-start",)  # those that also take nonlinear problems


@dataclass(frozen=True, eq=False)
class Claim:
    """What a solver claims of a problem, not yet verified.

    z : shape (n,), or None if there is none.
    solved : whether z is claimed to be a solution to within the solver's tolerance.
    seconds : from the arrays of the problem to the answer, without importing and compiling; of a method, verified.
    statement, status : how the run ended, in the solver's own words, and in a word.
    setup_seconds, iterations, evaluations, curve : of a method, as of a `Result`, and (k, seconds, error) of some
        iterates, with the residual for the error if no solution is known; None if unknown.
    """

    z: Vector | None
    solved: bool
    seconds: float
    statement: str
    status: str = ""
    setup_seconds: float | None = None
    iterations: int | None = None
    evaluations: int | None = None
    curve: list[tuple[int, float, float | None]] | None = None


class Peer(Protocol):
    """Another solver. Only those of `NONLINEAR` are asked about nonlinear problems.

    version : the installed one; None if there is none. excludes : why the peer does not take a problem, as a clause; ""
    if it does. solve : with tol as the peer's own tolerance and in at most time_limit seconds, if the peer has these
    settings; it raises OptionError if the peer is not installed.
    """

    def version(self) -> str | None: ...
    def excludes(self, problem: Any) -> str: ...
    def solve(self, problem: Any, tol: float, time_limit: float) -> Claim: ...


def load(name: str) -> Peer:
    if name not in REGISTRY:
        raise _unknown(name)
    return cast(Peer, getattr(import_module(f"lcpcli.peers.{REGISTRY[name][0]}"), name.replace("-", "_")))


def installed(distribution: str) -> str | None:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def not_installed(package: str) -> OptionError:
    """Return the error for a package of the extra `peers` that is missing."""
    return ParameterError("peer", f"{package} is not installed", "pip install 'linear-complementarity[peers]'")


def select(names: Iterable[str]) -> list[str]:
    """Return the named peers, each once; the part of a name before a dash selects all of that package. Raises
    OptionError for an unknown name, with a suggestion."""
    selected: dict[str, None] = {}
    for name in names:
        meant = [peer for peer in REGISTRY if peer == name or peer.startswith(f"{name}-")]
        if not meant:
            raise _unknown(name)
        selected |= dict.fromkeys(meant)
    return list(selected)


def _unknown(name: str) -> OptionError:
    return ParameterError("peer", f"{quoted(name)} is unknown", likely(name, REGISTRY))


def run(arguments: Sequence[str], time_limit: float) -> tuple[str, float]:
    """Run a command that prints a line once all is loaded; return how it failed, or "", and its seconds from then."""
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()
            began = clock.seconds()
            code = process.wait(None if time_limit == float("inf") else time_limit)
        except subprocess.TimeoutExpired:
            return "stopped at the time limit", clock.seconds() - began
        finally:
            process.kill()
        seconds = clock.seconds() - began
    if code < 0:
        return f"killed by {signal.Signals(-code).name}", seconds
    return f"failed with exit code {code}" if code else "", seconds
