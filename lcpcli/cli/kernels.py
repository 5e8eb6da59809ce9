"""lcp kernels: the kernels of the extra `fast` are compiled ahead of their first use."""

from __future__ import annotations

import click

from lcpcli.cli.command import command
from lcpcli.cli.terminal import shows_progress
from lcpcli.errors import OptionError, count
from lcpcli.options import MISSING, has_numba


@command(
    short_help="Compile the kernels of the extra fast ahead of time.",
    examples=("lcp kernels",),
    epilog="LCPCLI_KERNELS=1 in the environment makes all runs use them: see lcp help speed.",
    exits={0: "all are compiled", 2: "numba is missing, or cannot write its cache (one-line message)"},
)
def kernels() -> None:
    """Compile the kernels of the extra fast that numba does not have in its cache, and say where that is."""
    from lcpcli.report.terminal import progress

    if not has_numba():
        raise OptionError("kernels", *MISSING)
    try:
        from lcpcli.kernels.ahead import KERNELS, compile_all

        with progress(KERNELS, shows_progress(False)) as tell:
            now, before, folder = compile_all(tell)
    except RuntimeError as error:  # the cache has no place
        raise OptionError("numba", str(error), "set NUMBA_CACHE_DIR to a folder that can be written") from None
    if not folder:
        raise OptionError("NUMBA_DISABLE_JIT", "is set, so that nothing is compiled", "unset it")
    click.echo(f"{count(now, 'kernel')} compiled, {before} already there; the cache is in {folder}")
