"""Siconos (V. Acary and others, https://nonsmooth.gricad-pages.univ-grenoble-alpes.fr/siconos), in its own process.

Siconos comes with Linux distributions rather than from package indexes, so the environment variable LCP_SICONOS_PYTHON
names the Python interpreter that has it; by default it is the one running lcp. A crash ends only the separate process.

Siconos is called through its driver, which checks what its solvers return: called directly, its Lemke method reports
success when it ends on a ray. The tolerance applies to the driver's error, |min(z, w)|_2 / |q|_2.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from lcpcli.errors import ParameterError
from lcpcli.model.problem import Problem
from lcpcli.peers import process
from lcpcli.peers.quadratic import dense, not_dense, not_lcp
from lcpcli.peers.registry import Claim

PYTHON = "LCP_SICONOS_PYTHON"
ASK = "from importlib.metadata import version; print(version('siconos'))"
SOLVE = """
import os, sys, time
import numpy as np
import siconos.numerics as sn
problem_file, result_file, solver, tol, iterations = sys.argv[1:]
data = np.load(problem_file)
options = sn.SolverOptions(getattr(sn, solver))
options.dparam[sn.SICONOS_DPARAM_TOL] = float(tol)
if int(iterations):
    options.iparam[sn.SICONOS_IPARAM_MAX_ITER] = int(iterations)
z, w = np.zeros(data["q"].size), np.zeros(data["q"].size)
M, q = data["M"], data["q"]
print("ready", flush=True)
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
began = time.perf_counter()
problem = sn.LCP(np.asfortranarray(M), q)
info = sn.linearComplementarity_driver(problem, z, w, options)
np.savez(result_file, seconds=time.perf_counter() - began, z=z, info=info)
"""


@dataclass
class Siconos:
    """One of Siconos' solvers: its constant in siconos.numerics, and the iteration limit; 0 keeps the solver's own."""

    solver: str
    iterations: int = 0

    def version(self) -> str | None:
        return _version(_python())

    def excludes(self, problem: Problem) -> str:
        return not_lcp(problem) or not_dense(problem)

    def solve(self, problem: Problem, tol: float, time_limit: float) -> Claim:
        if self.version() is None:
            raise ParameterError(
                "peer", "Siconos is not installed", f"set {PYTHON} to a Python interpreter that has it"
            )
        with tempfile.TemporaryDirectory() as folder:
            files = [str(Path(folder) / name) for name in ("problem.npz", "result.npz")]
            np.savez(files[0], M=dense(problem.M), q=problem.q)
            ending, seconds = process.run(
                [_python(), "-c", SOLVE, *files, self.solver, str(tol), str(self.iterations)], time_limit
            )
            if ending:
                return Claim(None, False, seconds, ending)
            with np.load(files[1]) as result:
                info = int(result["info"])
                return Claim(result["z"], info == 0, float(result["seconds"]), f"info {info}")


def _python() -> str:
    return os.environ.get(PYTHON, sys.executable)


@cache
def _version(python: str) -> str | None:
    try:
        done = subprocess.run(
            [python, "-c", ASK], capture_output=True, text=True, timeout=process.START_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None if done.returncode == 0 else None


# a generalized Newton method on min(z, Mz + q), with a line search on the Fischer-Burmeister function
siconos_newton = Siconos("SICONOS_LCP_NEWTON_MIN_FBLSA")
# C. W. Cryer, The solution of a quadratic programming problem using systematic overrelaxation, SIAM J. Control 9 (1971)
# 385-392; its own limit of 1000 sweeps is too small for the tolerances used here
siconos_pgs = Siconos("SICONOS_LCP_PGS", iterations=10**9)
# the lexicographic minimum ratio test; it has no tolerance, unlike the driver's check of its answer
siconos_lemke = Siconos("SICONOS_LCP_LEMKE")
