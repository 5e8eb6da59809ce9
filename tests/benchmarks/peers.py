"""Other solvers on the same problem: each is a function (M, q) -> (seconds, z), timed around its own work alone.

Those that are not installed are left out, Siconos' interpreter may be another one (LCP_SICONOS_PYTHON). Tolerances are
1e-9 where a peer has one.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

TOLERANCE = 1e-9
Peer = Callable[[Any, Any], tuple[float, Any]]


def quantecon(M: Any, q: Any) -> tuple[float, Any]:
    from quantecon.optimize import lcp_lemke

    lcp_lemke(np.eye(2), -np.ones(2))  # compiles
    began = time.perf_counter()
    z = lcp_lemke(M, q, max_iter=10**6).z
    return time.perf_counter() - began, z


def piqp(M: Any, q: Any) -> tuple[float, Any]:
    import piqp as library

    solver = library.SparseSolver() if sparse.issparse(M) else library.DenseSolver()
    solver.settings.eps_abs = TOLERANCE * float(np.abs(q).max())
    solver.settings.eps_rel = TOLERANCE
    P, lower = sparse.csc_matrix(M) if sparse.issparse(M) else M, np.zeros(q.size)
    began = time.perf_counter()
    solver.setup(P, q, x_l=lower)
    solver.solve()
    return time.perf_counter() - began, solver.result.x


def daqp(M: Any, q: Any) -> tuple[float, Any]:
    import daqp as library

    n = q.size
    empty, upper, lower, sense = np.zeros((0, n)), np.full(n, 1e30), np.zeros(n), np.zeros(n, dtype=np.int32)
    began = time.perf_counter()
    z = library.solve(M, q, empty, upper, lower, sense)[0]
    return time.perf_counter() - began, z


def clarabel(M: Any, q: Any) -> tuple[float, Any]:
    import clarabel as library

    n = q.size
    settings = library.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    P, A = sparse.csc_matrix(sparse.triu(M)), sparse.csc_matrix(-sparse.eye(n))
    began = time.perf_counter()
    solution = library.DefaultSolver(P, q, A, np.zeros(n), [library.NonnegativeConeT(n)], settings).solve()
    return time.perf_counter() - began, np.array(solution.x)


def osqp(M: Any, q: Any) -> tuple[float, Any]:
    import osqp as library

    n = q.size
    P, A, solver = sparse.csc_matrix(sparse.triu(M)), sparse.csc_matrix(sparse.eye(n)), library.OSQP()
    settings = {"eps_abs": TOLERANCE, "eps_rel": TOLERANCE, "max_iter": 20000, "verbose": False}
    began = time.perf_counter()
    solver.setup(P, q, A, np.zeros(n), np.full(n, np.inf), **settings)
    z = solver.solve().x
    return time.perf_counter() - began, z


SICONOS = """
import sys, time
import numpy as np
import siconos.numerics as sn
data = np.load(sys.argv[1])
name, function = sys.argv[2:4]
z, w = np.zeros(data["q"].size), np.zeros(data["q"].size)
options = sn.SolverOptions(getattr(sn, name))
options.dparam[sn.SICONOS_DPARAM_TOL] = float(sys.argv[4])
if name == "SICONOS_LCP_PGS":
    options.iparam[sn.SICONOS_IPARAM_MAX_ITER] = 20000
problem = sn.LCP(np.asfortranarray(data["M"]), data["q"])
began = time.perf_counter()
getattr(sn, function)(problem, z, w, options)
np.savez(sys.argv[1], seconds=time.perf_counter() - began, z=z)
"""


def siconos(name: str, function: str) -> Peer:
    """One of Siconos' solvers, in a process of its own."""
    python = os.environ.get("LCP_SICONOS_PYTHON", sys.executable)

    def solve(M: Any, q: Any) -> tuple[float, Any]:
        with tempfile.TemporaryDirectory() as folder:
            file = str(Path(folder) / "problem.npz")
            np.savez(file, M=M, q=q)
            arguments = [python, "-c", SICONOS, file, name, function, str(TOLERANCE)]
            subprocess.run(arguments, check=True, capture_output=True)
            result = np.load(file)
            return float(result["seconds"]), result["z"]

    return solve


def has_siconos() -> bool:
    python = os.environ.get("LCP_SICONOS_PYTHON", sys.executable)
    return subprocess.run([python, "-c", "import siconos.numerics"], capture_output=True, check=False).returncode == 0


def available(symmetric: bool, dense: bool) -> dict[str, Peer]:
    """The installed peers that take such a matrix; quadratic programs need it symmetric."""
    peers: dict[str, Peer] = {}
    quadratic = {"piqp": piqp, "daqp": daqp} if dense else {"piqp": piqp, "clarabel": clarabel, "osqp": osqp}
    if symmetric:
        peers |= {name: peer for name, peer in quadratic.items() if find_spec(name)}
    if dense and find_spec("quantecon"):
        peers["quantecon lemke"] = quantecon
    if dense and has_siconos():
        peers["siconos newton"] = siconos("SICONOS_LCP_NEWTON_MIN_FBLSA", "lcp_newton_minFB")
        peers["siconos pgs"] = siconos("SICONOS_LCP_PGS", "lcp_pgs")
        peers["siconos lemke"] = siconos("SICONOS_LCP_LEMKE", "lcp_lexicolemke")
    return peers
