"""All equilibria of games, by lcpcli.solutions and by the three algorithms of Nashpy: equilibria.py [seconds]

For each game the number of equilibria that each finds and the seconds that it takes, in processes of their own that
are stopped after so many seconds, 60 by default. Nashpy's equilibria are counted once each, to nine digits.
"""

from __future__ import annotations

import multiprocessing
import sys
import time
import warnings
from typing import Any

import nashpy
import numpy as np
from measuring import show

import lcpcli
from lcpcli.files import contents

ALGORITHMS = ("support_enumeration", "vertex_enumeration", "lemke_howson_enumeration")


def games() -> dict[str, tuple[Any, Any]]:
    """Payoffs by name."""
    found: dict[str, tuple[Any, Any]] = {}
    for name in ("coordination-4", "winkels", "von-stengel-75"):
        origin: Any = lcpcli.read(contents.shipped_path(f"games/{name}.nfg")).origin
        found[name] = origin.A, origin.B
    for n in (6, 8, 10):
        A, B = np.random.default_rng(n).integers(-50, 51, (2, n, n)).astype(float)
        found[f"random {n} x {n}"] = A, B
    return found


def ours(A: Any, B: Any) -> tuple[int, str]:
    found = lcpcli.solutions(lcpcli.from_game(A, B))
    for _ in found:
        continue
    assert found.equilibria is not None
    return len(found.equilibria.extreme), "" if found.complete else " incomplete"


def theirs(A: Any, B: Any, algorithm: str) -> tuple[int, str]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about degenerate games
        all_of_them = list(getattr(nashpy.Game(A, B), algorithm)())
    once = {
        tuple(np.round(np.concatenate(each), 9) + 0.0) for each in all_of_them if np.isfinite(np.hstack(each)).all()
    }
    return len(once), f" of {len(all_of_them)}" if len(all_of_them) > len(once) else ""


def timed(function: Any, arguments: tuple[Any, ...], results: Any) -> None:
    began = time.perf_counter()
    number, remark = function(*arguments)
    results.put(f"{number}{remark} in {time.perf_counter() - began:.3g} s")


def told(limit: float, function: Any, *arguments: Any) -> str:
    results = multiprocessing.Queue()
    process = multiprocessing.Process(target=timed, args=(function, arguments, results))
    process.start()
    process.join(limit)
    if process.is_alive():
        process.kill()
        return f"over {limit:g} s"
    return str(results.get())


if __name__ == "__main__":
    limit = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    widths = 5 * (26,)
    show(("game", "lcpcli.solutions", *ALGORITHMS), widths)
    for name, payoffs in games().items():
        show((name, told(limit, ours, *payoffs), *(told(limit, theirs, *payoffs, each) for each in ALGORITHMS)), widths)
