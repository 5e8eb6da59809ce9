"""How many threads the BLAS uses: one, unless the matrix is so large that more of them
save time.

The threads of a BLAS wait for each other busily. Beside two busy processes on two
processors, a dense problem with n = 2000 was seen to take 8 to 27 times as long as
alone in two threads, and 1.6 times as long in one thread; alone, two threads save a
tenth to a quarter of the time.

The number belongs to the process. Commands set it in the environment before numpy,
which reads it when it is loaded (`lcpcli.cli.problems.settle_threads`); where numpy is
loaded, threadpoolctl changes it for the duration of a call. Nothing heavy is imported
here before it is needed.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, wraps
from typing import Any, TypeVar, cast

from lcpcli import options
from lcpcli.clock import imports
from lcpcli.errors import ParameterError, missing

GENERAL = "OMP_NUM_THREADS"  # what a library goes by if its own variable is not set
VARIABLES = (
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    GENERAL,
)
MAX_DIGITS = 9  # of a number in the environment that is read
# With fewer than 9216 entries OpenBLAS multiplies by vectors in one thread anyway.
MIN_THREADED_ROWS = 100
# Rows of a dense matrix from which more threads pay. Measured on two processors, with
# one thread / two, in seconds: n = 2000 0.16 / 0.11 by auto and 0.27 / 0.21 by
# fixed-point, 3000 0.46 / 0.40 and 0.79 / 0.60, 5000 1.6 / 1.2 and 2.9 / 2.0. Beside
# two busy processes two threads took up to 12 times as long as one at n = 3000, 4 times
# at 5000.
MANY_ROWS = 5000

Function = TypeVar("Function", bound=Callable[..., Any])


@cache  # the BLAS too reads it only once
def in_environment() -> int | None:
    """Return the number of threads that the environment sets; None if it sets none."""
    values = [os.environ.get(name, "") for name in VARIABLES]
    return next(
        (int(value[:MAX_DIGITS]) for value in values if value.isdecimal()), None
    )


def with_limited_threads(function: Function) -> Function:
    """Return a function (problem, ...) that calls the given one with as many threads as
    its keyword `threads` says.

    By default the environment sets their number; if not, it is one, unless M is so
    large that more save time. A nonlinear problem has no M, but linear systems with up
    to twice as many unknowns.
    """

    @wraps(function)
    def limited_function(problem: Any, *arguments: Any, **keywords: Any) -> Any:
        is_small = (
            2 * problem.n < MIN_THREADED_ROWS and options.THREADS.name not in keywords
        )
        number = (
            None if is_small else _number(problem, keywords.get(options.THREADS.name))
        )
        if number is None:
            return function(problem, *arguments, **keywords)
        with limited(number):
            return function(problem, *arguments, **keywords)

    return cast(Function, limited_function)


def _number(problem: Any, asked: int | None) -> int | None:
    """Return the number of threads for a problem, None to leave it as it is; raise
    OptionError if it cannot be set."""
    if asked is not None:
        options.check((options.THREADS,), {options.THREADS.name: asked})
        if _libraries() is None:
            raise ParameterError(options.THREADS.name, *missing("threadpoolctl"))
        return int(asked)
    M = getattr(problem, "M", None)
    rows = problem.n if M is not None else 2 * problem.n
    if rows < MIN_THREADED_ROWS or in_environment() is not None:
        return None
    with imports:
        from lcpcli.linalg.matrices import is_sparse
    return 1 if rows < MANY_ROWS or is_sparse(M) else None


_lock = threading.Lock()
# By the calls under way: the number of the process is the least of these.
_asked: dict[object, int] = {}
_usual: list[int] = []  # those from before the first of them, of each library
_thread = threading.local()  # is_limited : whether it is within a context of `limited`


@contextmanager
def limited(number: int) -> Iterator[None]:
    """Open a context in which the BLAS of numpy and that of scipy use that many
    threads, if threadpoolctl is installed.

    Of nested contexts the outermost one decides. As the number belongs to the process,
    the smallest one counts where contexts of several threads overlap, and the last of
    these to close puts back what was there before.
    """
    libraries, call = _libraries(), object()
    if libraries is None or getattr(_thread, "is_limited", False):
        yield
        return
    try:
        _thread.is_limited = True
        _set_thread_number(libraries, call, number)
        yield
    finally:
        _set_thread_number(libraries, call)
        _thread.is_limited = False


def _set_thread_number(
    libraries: Sequence[Any], call: object, number: int | None = None
) -> None:
    """Set the number of threads that a call requests, or drop the request at its end.
    The first call changes the number of the process, and the last one restores it."""
    with _lock:
        if not _asked:
            _usual[:] = [library.get_num_threads() for library in libraries]
        if number is None:
            _asked.pop(call, None)  # which is not there if Ctrl-C came first
        else:
            _asked[call] = number
        smallest_number = min(_asked.values(), default=None)
        for library, usual in zip(libraries, _usual, strict=True):
            has_one_of_each_thread = getattr(library, "threading_layer", "") == "openmp"
            is_usual = smallest_number is None or (
                number is None and has_one_of_each_thread
            )
            library.set_num_threads(usual if is_usual else smallest_number)
            # Else threadpoolctl >= 3.8 would refuse other threads.
            if hasattr(library, "clear_controlling_thread"):
                library.clear_controlling_thread()


@cache
def _libraries() -> list[Any] | None:
    """Return threadpoolctl's controllers of the BLAS that are loaded; None without
    threadpoolctl."""
    with imports:
        try:
            from threadpoolctl import ThreadpoolController
        except ImportError:
            return None
        import scipy.linalg  # noqa: F401 (so that its BLAS is among them)

        return [
            controller
            for controller in ThreadpoolController().lib_controllers
            if controller.user_api == "blas"
        ]
