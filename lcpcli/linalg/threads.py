"""The number of threads that the BLAS uses: one, unless the matrix is so large that
more threads save time.

The threads of a BLAS wait for each other in busy loops. On a machine with two
processors that were occupied by two other processes, a dense problem with n = 2000 was
seen to take 8 to 27 times as long as on the idle machine if the BLAS used two threads,
and 1.6 times as long if it used one. On the idle machine, two threads save a tenth to a
quarter of the time.

The number of threads is a property of the process. Commands set it in the environment
before numpy is loaded, which reads it then (`lcpcli.cli.problems.settle_threads`); if
numpy is loaded already, threadpoolctl changes the number for the duration of a call.
Nothing heavy is imported here before it is needed.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import cache, wraps
from typing import Any, TypeVar, cast

from lcpcli import options
from lcpcli.clock import imports
from lcpcli.errors import ParameterError, missing

# Libraries read this variable if the one that is specific to them is not set.
GENERAL = "OMP_NUM_THREADS"
VARIABLES = (
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    GENERAL,
)
MAX_DIGITS = 9  # digits that are read of a number in the environment
# OpenBLAS uses one thread for a matrix-vector product of fewer than 9216 = 96^2
# entries.
MIN_THREADED_ROWS = 100
# Rows of a dense matrix from which several threads are used. Measured on two idle
# processors, in seconds with one thread / two threads: n = 2000 0.16 / 0.11 by auto and
# 0.27 / 0.21 by fixed-point, 3000 0.46 / 0.40 and 0.79 / 0.60, 5000 1.6 / 1.2 and 2.9 /
# 2.0. While two other processes were running, two threads took up to 12 times as long
# as one at n = 3000 and 4 times at n = 5000: below this size the loss outweighs the
# gain.
MANY_ROWS = 5000

# Entries of a dense rectangular matrix A from which OpenBLAS may use several threads
# for A'A or factors of A.
MIN_THREADED_ENTRIES = 2500

Function = TypeVar("Function", bound=Callable[..., Any])


@cache  # the BLAS also reads the environment only once
def in_environment() -> int | None:
    """Return the number of threads that the environment sets; None if it sets none."""
    values = [os.environ.get(name, "") for name in VARIABLES]
    return next(
        (int(value[:MAX_DIGITS]) for value in values if value.isdecimal()), None
    )


def with_limited_threads(function: Function) -> Function:
    """Return `function`, a function of a problem, so that the BLAS uses as many threads
    in its calls as the keyword `threads` says.

    Without the keyword the environment sets their number; if it sets none, one thread
    is used, unless M is so large that more save time. A nonlinear problem has no M, but
    its linear systems have up to twice as many unknowns.
    """

    @wraps(function)
    def limited_function(problem: Any, *arguments: Any, **keywords: Any) -> Any:
        asked = keywords.get(options.THREADS.name)
        is_small = asked is None and 2 * problem.n < MIN_THREADED_ROWS
        number = None if is_small else _number(problem, asked)
        if number is None:
            return function(problem, *arguments, **keywords)
        with limited(number):
            return function(problem, *arguments, **keywords)

    return cast(Function, limited_function)


def _number(problem: Any, asked: int | None) -> int | None:
    """Return the number of threads to set for a problem, or None to leave it unchanged;
    raise OptionError if a number was requested that is invalid, or cannot be set
    because threadpoolctl is not installed.
    """
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


def limited_for(A: Any) -> AbstractContextManager[None]:
    """Return a context in which the BLAS uses one thread for a dense or sparse matrix
    of any shape, unless the environment sets their number, A is so small that it uses
    one anyway, or so large that more save time.
    """
    rows, columns = A.shape
    entries = rows * columns
    if entries < MIN_THREADED_ENTRIES or in_environment() is not None:
        return nullcontext()
    with imports:
        from lcpcli.linalg.matrices import is_sparse
    if min(rows, columns) >= MANY_ROWS and not is_sparse(A):
        return nullcontext()
    return limited(1)


_lock = threading.Lock()
# The numbers requested by the contexts that are open: the process uses the smallest
# one.
_asked: dict[object, int] = {}
# The number of threads of each library before the first context was opened.
_usual: list[int] = []
# The attribute is_limited of this object tells whether the current thread is inside a
# context of `limited`.
_thread = threading.local()


@contextmanager
def limited(number: int) -> Iterator[None]:
    """Open a context in which the BLAS of numpy and that of scipy use this number of
    threads, if threadpoolctl is installed.

    Of nested contexts the outermost one decides. As the number belongs to the process,
    the smallest requested number is in force while contexts of several threads overlap,
    and the last of these to close restores the numbers from before the first one.
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
    """Set the number of threads that a context requests, or drop its request when it
    exits (`number` is None). The first context changes the number of the process, and
    the last one restores it.
    """
    with _lock:
        if not _asked:
            _usual[:] = [library.get_num_threads() for library in libraries]
        if number is None:
            _asked.pop(call, None)  # Ctrl-C may have come before it was entered
        else:
            _asked[call] = number
        smallest_number = min(_asked.values(), default=None)
        for library, usual in zip(libraries, _usual, strict=True):
            has_one_of_each_thread = getattr(library, "threading_layer", "") == "openmp"
            is_usual = smallest_number is None or (
                number is None and has_one_of_each_thread
            )
            library.set_num_threads(usual if is_usual else smallest_number)
            # Without this, threadpoolctl >= 3.8 would refuse calls from other threads.
            if hasattr(library, "clear_controlling_thread"):
                library.clear_controlling_thread()


@cache
def _libraries() -> list[Any] | None:
    """Return threadpoolctl's controllers of the BLAS libraries that are loaded, or None
    if threadpoolctl is not installed.
    """
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
