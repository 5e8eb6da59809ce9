"""Siconos' generalized Newton method on min(z, Mz + q), with a line search on the Fischer-Burmeister function.

Its own limit of 1000 iterations applies.
"""

from __future__ import annotations

from lcpcli.peers import siconos

version, excludes = siconos.version, siconos.excludes
solve = siconos.solver("SICONOS_LCP_NEWTON_MIN_FBLSA")
