"""How many threads the BLAS uses: one, unless the matrix is so large that more of them save time.

The threads of a BLAS wait for each other busily. Beside two busy processes on two processors, a dense problem with
n = 2000 was seen to take 8 to 27 times as long as alone in two threads, and 1.6 times as long in one thread; alone, two
threads save a tenth to a quarter of the time.

The number belongs to the process. Commands set it in the environment before numpy, which reads it when it is loaded
(`lcpcli.cli.problems.settle_threads`); where numpy is loaded, threadpoolctl changes it for the duration of a call.
Nothing heavy is imported here before it is needed.
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
from lcpcli.errors import ParameterError

GENERAL = "OMP_NUM_THREADS"  # what a library goes by if its own variable is not set
VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", GENERAL)
MOST_DIGITS = 9  # of a number in the environment that is read
FEWEST_THREADED_ROWS = 100  # with fewer than 9216 entries OpenBLAS multiplies by vectors in one thread anyway
# Rows of a dense matrix from which more threads pay. Measured on two processors, with one thread / two, in seconds:
# n = 2000 0.16 / 0.11 by auto and 0.27 / 0.21 by fixed-point, 3000 0.46 / 0.40 and 0.79 / 0.60, 5000 1.6 / 1.2 and
# 2.9 / 2.0. Beside two busy processes two threads took up to 12 times as long as one at n = 3000, 4 times at 5000.
MANY_ROWS = 5000

Function = TypeVar("Function", bound=Callable[..., Any])


def in_environment() -> int | None:
    """Return the number of threads that the environment sets; None if it sets none."""
    values = [os.environ.get(name, "") for name in VARIABLES]
    return next((int(value[:MOST_DIGITS]) for value in values if value.isdecimal()), None)


def with_limited_threads(function: Function) -> Function:
    """Return a function (problem, ...) that calls the given one with as many threads as its keyword `threads` says.

    By default the environment sets their number; if not, it is one, unless M is so large that more save time. A
    nonlinear problem has no M, but linear systems with up to twice as many unknowns.
    """

    @wraps(function)
    def limited_function(problem: Any, *given: Any, **named: Any) -> Any:
        number = _number(problem, named.get(options.THREADS.name))
        if number is None:
            return function(problem, *given, **named)
        with limited(number):
            return function(problem, *given, **named)

    return cast(Function, limited_function)


def _number(problem: Any, asked: int | None) -> int | None:
    """Return the number of threads for a problem, None to leave it as it is; raise OptionError if the number asked for
    cannot be set."""
    if asked is not None:
        options.check((options.THREADS,), {options.THREADS.name: asked})
        if _libraries() is None:
            hint = "pip install 'linear-complementarity[threads]'"
            raise ParameterError(options.THREADS.name, "needs threadpoolctl", hint)
        return int(asked)
    M = getattr(problem, "M", None)
    rows = problem.n if M is not None else 2 * problem.n
    if rows < FEWEST_THREADED_ROWS or _decided_by_environment():
        return None
    with imports:
        from lcpcli.linalg.matrices import is_sparse
    return 1 if rows < MANY_ROWS or is_sparse(M) else None


@cache  # the BLAS too reads it only once
def _decided_by_environment() -> bool:
    return in_environment() is not None


class _Shared:
    """The number of threads of the process while calls are under way that ask for one: the smallest of theirs. The
    first of them changes it, and the last one puts it back."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._asked: dict[object, int] = {}  # by calls
        self._usual: list[int] = []  # the numbers from before the first of them, of each library

    def ask(self, call: object, number: int, libraries: Sequence[Any]) -> None:
        """Take the number for which a call asks."""
        with self._lock:
            if not self._asked:
                self._usual = [library.get_num_threads() for library in libraries]
            self._asked[call] = number
            self._set(libraries, [min(self._asked.values())] * len(libraries))

    def leave(self, call: object, libraries: Sequence[Any]) -> None:
        """Forget the number of a call, which is over."""
        with self._lock:
            if self._asked.pop(call, None) is None:  # Ctrl-C came first
                return
            least = min(self._asked.values(), default=None)
            pairs = zip(libraries, self._usual, strict=True)
            self._set(libraries, [usual if least is None or _of_thread(each) else least for each, usual in pairs])

    def _set(self, libraries: Sequence[Any], numbers: Sequence[int]) -> None:
        for library, number in zip(libraries, numbers, strict=True):
            library.set_num_threads(number)
            if hasattr(library, "clear_controlling_thread"):  # else threadpoolctl >= 3.8 would refuse other threads
                library.clear_controlling_thread()


def _of_thread(library: Any) -> bool:
    """Return whether each thread has a number of its own for this library."""
    return getattr(library, "threading_layer", "") == "openmp"


_shared = _Shared()  # as the number is that of the process
_thread = threading.local()  # is_limited : whether it is within a context of `limited`


@contextmanager
def limited(number: int) -> Iterator[None]:
    """Open a context in which the BLAS of numpy and that of scipy use that many threads, if threadpoolctl is installed.

    Of nested contexts the outermost one decides. As the number belongs to the process, the smallest one counts where
    contexts of several threads overlap, and the last of these to close puts back what was there before.
    """
    libraries, call = _libraries(), object()
    if libraries is None or getattr(_thread, "is_limited", False):
        yield
        return
    try:
        _thread.is_limited = True
        _shared.ask(call, number, libraries)
        yield
    finally:
        _shared.leave(call, libraries)
        _thread.is_limited = False


@cache
def _libraries() -> list[Any] | None:
    """Return threadpoolctl's controllers of the BLAS that are loaded, which it finds in milliseconds; None without
    threadpoolctl."""
    with imports:
        try:
            from threadpoolctl import ThreadpoolController
        except ImportError:
            return None
        import scipy.linalg  # noqa: F401 (so that its BLAS is among them)

        return [each for each in ThreadpoolController().lib_controllers if each.user_api == "blas"]
