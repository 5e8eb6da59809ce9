"""Siconos' projected Gauss-Seidel method (C. W. Cryer, The solution of a quadratic programming problem using systematic
overrelaxation, SIAM J. Control 9 (1971) 385-392).

Only the time limit applies: its own limit of 1000 sweeps is too small for the tolerances used here.
"""

from __future__ import annotations

from lcpcli.peers import siconos

version, excludes = siconos.version, siconos.excludes
SWEEPS = 10**9
solve = siconos.solver("SICONOS_LCP_PGS", SWEEPS)
