"""The calls of FLINT that may take long, the longest in a process of their own.

FLINT holds the interpreter's lock: neither Ctrl-C nor a time limit could end the wait for it in a thread. A process is
ended at once; starting it takes a fifth of a second. Where none can be started the call is made here.
"""

from __future__ import annotations

import marshal
import math
import subprocess
import sys
from collections.abc import Callable, Sequence
from typing import Any

from lcpcli.interrupts import TimeIsUp, remaining

LONG = 0.5  # seconds of a call that is made in another process
CODE = "import sys; sys.path[:] = sys.argv[1:]; from lcpcli.rational.flint_calls import serve; serve()"

Rows = Sequence[Sequence[int]]


def solved(A: Rows, b: Sequence[int]) -> list[tuple[int, int]] | None:
    """The numerators and denominators of the x with A x = b, for square A; None if A is singular."""
    import flint

    try:
        x = flint.fmpz_mat(A).solve(flint.fmpz_mat(len(b), 1, b))
    except ZeroDivisionError:
        return None
    return [(int(value.p), int(value.q)) for value in x.entries()]


def reduced(A: Rows) -> tuple[list[list[int]], int, int]:
    """The reduced row echelon form of A times a divisor, that divisor, and the rank."""
    import flint

    rows, divisor, rank = flint.fmpz_mat(A).rref()
    return [[int(value) for value in row] for row in rows.tolist()], int(divisor), rank


CALLS: dict[str, Callable[..., Any]] = {"solved": solved, "reduced": reduced}


def call(name: str, seconds: float, *given: Any) -> Any:
    """What that call returns, which takes about so many seconds. Raises TimeIsUp at the end of `within`."""
    if seconds > LONG and sys.executable:
        command, left = [sys.executable, "-c", CODE, *sys.path], remaining()
        try:
            done = subprocess.run(
                command,
                input=marshal.dumps((name, given)),
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                timeout=left if left < math.inf else None,
                check=True,
            )
            return marshal.loads(done.stdout)
        except subprocess.TimeoutExpired:
            raise TimeIsUp from None
        except (OSError, subprocess.CalledProcessError):
            pass
    return CALLS[name](*given)


def serve() -> None:
    """Make the call on standard input, and write what it returns."""
    name, given = marshal.load(sys.stdin.buffer)
    sys.stdout.buffer.write(marshal.dumps(CALLS[name](*given)))
