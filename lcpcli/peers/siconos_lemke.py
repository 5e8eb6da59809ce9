"""Siconos' Lemke method with the lexicographic minimum ratio test.

The method has no tolerance; the driver's check of its answer does.
"""

from __future__ import annotations

from lcpcli.peers import siconos

version, excludes = siconos.version, siconos.excludes
solve = siconos.solver("SICONOS_LCP_LEMKE")
