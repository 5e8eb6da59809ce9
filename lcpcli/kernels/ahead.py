"""All kernels compiled ahead of their first use."""

from __future__ import annotations

import os
from collections.abc import Callable

from numba.core.dispatcher import Dispatcher

from lcpcli.kernels.announcement import ONCE

KERNELS = 17  # that the modules `compiled` and `compiled_mixed` use


def compile_all(tell: Callable[[str], None]) -> tuple[int, int, str]:
    """Load all kernels, which compiles those that the cache lacks; `tell` is called with the name of each as that
    begins. Return how many were compiled, how many were there, and the folder with the cache, "" without any."""
    ONCE.tell = tell
    from lcpcli.kernels import compiled, compiled_mixed

    used = [*vars(compiled).values(), *vars(compiled_mixed).values()]
    made = {id(kernel): kernel for kernel in used if isinstance(kernel, Dispatcher)}.values()
    now = sum(bool(kernel.stats.cache_misses) for kernel in made)
    folder = os.path.commonpath([str(kernel.stats.cache_path) for kernel in made]) if made else ""
    return now, len(made) - now, folder
