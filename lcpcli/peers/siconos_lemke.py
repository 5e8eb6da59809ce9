"""Siconos' Lemke method with the lexicographic minimum ratio test.

The method has no tolerance; the driver's check of its answer does.
"""

from __future__ import annotations

from lcpcli.peers import siconos, storage

version, excludes = siconos.version, storage.not_dense
solve = siconos.solver("SICONOS_LCP_LEMKE")
