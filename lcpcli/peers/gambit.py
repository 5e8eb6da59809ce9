"""Gambit, in its own process: one equilibrium of a game of two players, by Lemke's method in floating point.

R. Savani, T. L. Turocy, Gambit: the package for computation in game theory, https://www.gambit-project.org. The method
is from B. C. Eaves, The linear complementarity problem, Management Science 17 (1971) 612-634. It has no tolerance, and
its time limit ends the process, as it may not end by itself.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from lcpcli.model.problem import Problem
from lcpcli.peers import registry
from lcpcli.peers.quadratic import dense
from lcpcli.peers.registry import Claim, installed, not_installed

SOLVE = """
import os, sys, time
import numpy as np
import pygambit
data = np.load(sys.argv[1])
print("ready", flush=True)
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
began = time.perf_counter()
game = pygambit.Game.from_arrays(-data["rows"], -data["columns"])
found = pygambit.nash.lcp_solve(game, rational=False, stop_after=1).equilibria
x, y = ([float(found[0][s]) for s in p.strategies] for p in game.players) if found else ([], [])
np.savez(sys.argv[2], seconds=time.perf_counter() - began, x=x, y=y)
"""


class _Gambit:
    """Gambit as a `registry.Peer`."""

    module = "pygambit"

    def version(self) -> str | None:
        return installed(self.module)

    def excludes(self, problem: Problem) -> str:
        return "" if _strategies(problem) else "takes games of two players only"

    def solve(self, problem: Problem, tol: float, time_limit: float) -> Claim:  # noqa: ARG002 (there is no tolerance)
        if self.version() is None:
            raise not_installed(self.module)
        m, M = _strategies(problem), dense(problem.M)
        R, C = M[:m, m:], M[m:, :m].T
        with tempfile.TemporaryDirectory() as folder:
            files = [str(Path(folder) / name) for name in ("game.npz", "result.npz")]
            np.savez(files[0], rows=R, columns=C)
            ending, seconds = registry.run([sys.executable, "-c", SOLVE, *files], time_limit)
            if ending:
                return Claim(None, False, seconds, ending)
            with np.load(files[1]) as result:
                x, y, seconds = result["x"], result["y"], float(result["seconds"])
        if not x.size:
            return Claim(None, False, seconds, "no equilibrium")
        z = np.concatenate((x / (C.T @ x).min(), y / (R @ y).min()))
        return Claim(z, True, seconds, "an equilibrium")


gambit = _Gambit()


def _strategies(problem: Problem) -> int:
    """Return the number of the row player's strategies if M = [0 R; C' 0] with positive costs R and C, and q = -e, on
    z >= 0; 0 for any other problem."""
    if problem.is_mixed or (problem.q != -1).any():
        return 0
    M = dense(problem.M)
    m = int(np.argmax(M[0] > 0))
    game = np.zeros(M.shape, dtype=bool)
    game[:m, m:] = game[m:, :m] = True
    return m if np.array_equal(M > 0, game) and not M[~game].any() else 0
