"""PATH 5.2, called through the GAMS of the package gamspy_base, whose demonstration licence takes small problems.

S. P. Dirkse, M. C. Ferris, The PATH solver: a non-monotone stabilization scheme for mixed complementarity problems,
Optim. Methods Softw. 5 (1995) 123-156; M. C. Ferris, T. S. Munson, Interfaces to PATH 3.0: design, implementation and
usage, Comput. Optim. Appl. 12 (1999) 207-227.

GAMS reads the problem with its bounds as text, and writes z with all digits. As that mostly takes longer than PATH, the
seconds are those that PATH itself reports, without GAMS. The tolerance is PATH's convergence_tolerance, absolute, in
units of the largest |q_i| if that exceeds 1; all its other options are its own, its limits on iterations and restarts
too. `path-zeros` starts from z = 0, as GAMS does by default, `path-ones` from z = 1, both moved to the nearest point
within the bounds: PATH finds some solutions from only one of them.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path

import numpy as np

from lcpcli import clock
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import Conditions
from lcpcli.peers.process import START_SECONDS
from lcpcli.peers.quadratic import not_sparse
from lcpcli.peers.registry import Claim, installed, not_installed

PACKAGE = "gamspy_base"
NO_LIMIT = 1e10  # seconds, GAMS' own default for its time limit, in place of infinity
LICENCE_REFUSES = 7  # the exit code of GAMS
VARIABLES = "set i /1*{n}/; alias(i, j); variable z(i); equation f(i); model lcp /f.z/;\n"
PROBE = "f(i).. z(i) =n= 1; solve lcp using mcp;\n"
DATA = "parameter M(i, j) /\n{M}\n/, q(i) /\n{q}\n/, lower(i) /\n{lower}\n/, upper(i) /\n{upper}\n/;\n"
SOLVE = """z.l(i) = {start!r}; z.lo(i) = lower(i); z.up(i) = upper(i);
f(i).. sum(j, M(i, j) * z(j)) + q(i) =n= 0;
option mcp = path, limrow = 0, limcol = 0, solprint = off;
lcp.optfile = 1; lcp.solvelink = 5; lcp.tolproj = 0; lcp.reslim = {seconds!r};
solve lcp using mcp;
file answer /z.txt/; answer.nr = 2; answer.nd = 17; answer.nw = 26;
put answer; loop(i, put z.l(i) /);
"""
ENDING, SECONDS = re.compile(r"\*\* EXIT - (.*?)\.?\s*$", re.M), re.compile(r"^Total Time[ .]*([0-9.]+)$", re.M)
ERROR = re.compile(r"^\*\*\* (.*?)\s*$", re.M)


@dataclass
class _Path:
    """PATH as a `registry.Peer`. start : the components of the starting point."""

    start: float
    module: str = PACKAGE

    def version(self) -> str | None:
        found = installed(self.module)
        return found and f"GAMS {found}"

    def excludes(self, problem: Problem) -> str:
        return not_sparse(problem) or (_refusal(problem.n) if self.version() else "")

    def solve(self, problem: Problem, tol: float, time_limit: float) -> Claim:
        if self.version() is None:
            raise not_installed(self.module)
        with tempfile.TemporaryDirectory() as folder:
            limit, accuracy = min(time_limit, NO_LIMIT), tol * max(float(np.abs(problem.q).max()), 1.0)
            Path(folder, "path.opt").write_text(f"convergence_tolerance {accuracy!r}\n", encoding="ascii")
            call = SOLVE.format(start=self.start, seconds=limit)
            model = "$offListing\n" + VARIABLES.format(n=problem.n) + _data(conditions_of(problem)) + call
            _, log, seconds = _gams(folder, model, limit + START_SECONDS)
            ending, own = ENDING.search(log), SECONDS.search(log)
            if not ending or not own:
                return Claim(None, False, seconds, _error(log) or "stopped at the time limit")
            z = np.array(Path(folder, "z.txt").read_text(encoding="ascii").split(), dtype=float)
            return Claim(z, ending[1] == "solution found", float(own[1]), ending[1])


path_zeros, path_ones = _Path(0.0), _Path(1.0)


def _data(given: Conditions) -> str:
    """Return the problem in GAMS' language, with all digits.

    Where a row or a column of M is empty, its diagonal entry is EPS, a zero that GAMS keeps: it refuses an equation
    without variables.
    """
    rows, columns = (given.M != 0).nonzero()
    values = np.asarray(given.M[rows, columns])
    triples = zip((rows + 1).tolist(), (columns + 1).tolist(), values.tolist(), strict=True)
    lines = [f"{i}.{j} {value!r}" for i, j, value in triples]
    full = set((rows + 1).tolist()) & set((columns + 1).tolist())
    lines += [f"{i}.{i} EPS" for i in range(1, given.q.size + 1) if i not in full]
    vectors = {name: _listed(getattr(given, name).tolist()) for name in ("q", "lower", "upper")}
    return DATA.format(M="\n".join(lines), **vectors)


def _listed(vector: Iterable[float]) -> str:
    return "\n".join(f"{i} {value!r}" for i, value in enumerate(vector, 1))


@cache
def _refusal(n: int) -> str:
    """Return why the licence at hand does not take n unknowns, as a clause; "" if it does."""
    with tempfile.TemporaryDirectory() as folder:
        code, log, _ = _gams(folder, VARIABLES.format(n=n) + PROBE, START_SECONDS)
    return f"licence: {_error(log)}" if code == LICENCE_REFUSES else ""


def _error(log: str) -> str:
    error = ERROR.search(log)
    return error[1] if error else ""


def _gams(folder: str, model: str, time_limit: float) -> tuple[int | None, str, float]:
    """Run GAMS on a model; return its exit code, None if it was stopped, its log, and the seconds of the whole."""
    Path(folder, "lcp.gms").write_text(model, encoding="ascii")
    gams = shutil.which("gams", path=import_module(PACKAGE).directory)
    began = clock.seconds()
    try:
        done = subprocess.run(
            [gams or "gams", "lcp.gms", "logOption=3"], cwd=folder, capture_output=True, text=True, timeout=time_limit
        )
    except subprocess.TimeoutExpired:
        return None, "", clock.seconds() - began
    return done.returncode, done.stdout, clock.seconds() - began
