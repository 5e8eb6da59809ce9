"""The kernels of the extra `fast`, which are loaded with this module, if there is
numba.

The processes of a run of tests compile them between them, each module once: numba has
them on disk afterwards.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import lcpcli

# modules that use none of each other, those that take longest first: each is compiled
# by whoever comes first
MODULES = "mixed_kernels", "pivoting_kernels", "kernels", "measure_kernels"


def loaded(name: str, waits: bool) -> bool:
    """Load a module, which compiles its kernels; return whether it was done: not while
    another process does it."""
    import fcntl

    with (Path(lcpcli.__file__).parent / "kernels" / f"{name}.py").open() as source:
        try:
            fcntl.flock(
                source, fcntl.LOCK_EX if waits else fcntl.LOCK_EX | fcntl.LOCK_NB
            )
        except BlockingIOError:
            return False
        import_module(f"lcpcli.kernels.{name}")
    return True


worker = os.environ.get("PYTEST_XDIST_WORKER", "")
if worker and find_spec("numba") is not None and sys.platform != "win32":
    for name in [name for name in MODULES if not loaded(name, waits=False)]:
        loaded(name, waits=True)
