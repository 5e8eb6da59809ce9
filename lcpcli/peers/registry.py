"""Other solvers by name, imported on demand. The peer `p` is the object p (with _ for
-) in its file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from lcpcli.errors import OptionError, ParameterError, likely, unknown

if TYPE_CHECKING:
    from lcpcli.typing import Vector

# the file of each peer, and its meaning
REGISTRY = {
    "quantecon": (
        "packages",
        "Lemke's method with the lexicographic rule, compiled (QuantEcon.py)",
    ),
    "piqp": (
        "packages",
        "proximal interior-point method for quadratic programs (PIQP)",
    ),
    "daqp": (
        "packages",
        "dual active-set method for quadratic programs and affine variational "
        "inequalities (DAQP)",
    ),
    "highs": ("packages", "active-set method for quadratic programs (HiGHS)"),
    "path-start": (
        "path_library",
        "stabilized Newton method from a problem's start, also nonlinear ones "
        "(PATH 5.2, a proprietary library)",
    ),
    "gambit": ("packages", "Lemke's method for one equilibrium of a game (Gambit)"),
}
PEERS = {name: meaning for name, (_, meaning) in REGISTRY.items()}
NONLINEAR = ("path-start",)  # those that also take nonlinear problems


@dataclass(frozen=True, eq=False)
class Claim:
    """What a solver claims of a problem, not yet verified.

    z : shape (n,), or None if there is none.
    solved : whether z is claimed to be a solution to within the solver's tolerance.
    seconds : from the arrays of the problem to the answer, without importing and
        compiling; of a method, verified.
    statement, status : how the run ended, in the words of the solver, and in a word.
    setup_seconds, iterations, evaluations, curve : of a method, as of a `Result`, and
        (k, seconds, error) of some iterates, with the residual for the error if no
        solution is known; None if unknown.
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


def load(name: str) -> Any:
    """Return a `PackageSolver`."""
    if name not in REGISTRY:
        raise _unknown(name)
    return getattr(
        import_module(f"lcpcli.peers.{REGISTRY[name][0]}"), name.replace("-", "_")
    )


def select(names: Iterable[str]) -> list[str]:
    """Return the named peers, each once; the part of a name before a dash selects all
    of that package. Raises OptionError for an unknown name, with a suggestion."""
    selected: dict[str, None] = {}
    for name in names:
        meant = [
            peer for peer in REGISTRY if peer == name or peer.startswith(f"{name}-")
        ]
        if not meant:
            raise _unknown(name)
        selected |= dict.fromkeys(meant)
    return list(selected)


def _unknown(name: str) -> OptionError:
    return ParameterError("peer", unknown(name), likely(name, REGISTRY))
