"""`interior` for sparse M in compiled form, by the extra `fast`: to import it takes tenths of a second, or half a
minute if numba has to compile its kernels, once on a machine."""

from __future__ import annotations

from pathlib import Path
from zlib import crc32

from numba import njit, types

from lcpcli.kernels import (
    interior_finish_kernels,
    interior_kernels,
    interior_point_kernels,
    interior_scaling_kernels,
    interior_step_kernels,
    interior_system_kernels,
    ldl_kernels,
    ordering_kernels,
    quotient_graph_kernels,
)
from lcpcli.kernels.announcement import announced
from lcpcli.methods import interior, interior_scaling, interior_steps, interior_systems

INDICES, NUMBERS = types.Array(types.int32, 1, "C", readonly=True), types.Array(types.float64, 1, "C", readonly=True)
SIGNATURE = (INDICES, INDICES, NUMBERS, NUMBERS, NUMBERS, NUMBERS, types.float64, types.Array(types.int8, 1, "C"))
SOURCES = (
    *(interior, interior_finish_kernels, interior_kernels, interior_point_kernels, interior_scaling),
    *(interior_scaling_kernels, interior_step_kernels, interior_steps),
    *(interior_system_kernels, interior_systems, ldl_kernels, ordering_kernels, quotient_graph_kernels),
)
VERSION = crc32(b"".join(Path(str(module.__file__)).read_bytes() for module in SOURCES))
OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}

with announced():
    run = njit(SIGNATURE, **OPTIONS)(interior_kernels.entry(VERSION))
