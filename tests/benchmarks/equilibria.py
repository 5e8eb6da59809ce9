"""All equilibria of games, by lcpcli.solutions and by other programs: equilibria.py
[seconds]

The others are lrsnash of lrslib, Gambit's enummixed in rational numbers, and three
algorithms of Nashpy, those of them that are installed. For each game the number of
equilibria that each finds and the seconds that it takes, in processes of their own that
are stopped after so many seconds, 60 by default; who was stopped is not asked about
larger random games. Nashpy's equilibria are counted once each, to nine digits.
"""

from __future__ import annotations

import multiprocessing
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from contextlib import suppress
from fractions import Fraction
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from measuring import show

import lcpcli
from lcpcli.files import contents


def games() -> dict[str, tuple[Any, Any]]:
    """Payoffs by name."""
    found: dict[str, tuple[Any, Any]] = {}
    for name in ("coordination-4", "winkels", "von-stengel-75"):
        origin: Any = lcpcli.read(contents.shipped_path(f"games/{name}.nfg")).origin
        found[name] = origin.A, origin.B
    for n in (6, 8, 10, 12, 14, 16, 18):
        A, B = np.random.default_rng(n).integers(-50, 51, (2, n, n)).astype(float)
        found[f"random {n} x {n}"] = A, B
    return found


def ours(A: Any, B: Any) -> tuple[int, str]:
    found = lcpcli.solutions(lcpcli.from_game(A, B))
    for _ in found:
        continue
    assert found.equilibria is not None
    return len(found.equilibria.extreme), "" if found.complete else " incomplete"


def lrsnash(A: Any, B: Any) -> tuple[int, str]:
    rows = (
        " ".join(str(Fraction(payoff)) for payoff in row) for row in np.vstack((A, B))
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "game.txt")
        path.write_text(
            "\n".join([f"{A.shape[0]} {A.shape[1]}", *rows, ""]), encoding="ascii"
        )
        log = subprocess.run(
            ["lrsnash", "-s", path], capture_output=True, text=True, check=True
        ).stdout
    return int(re.findall(r"equilibria found: (\d+)", log)[-1]), ""


def enummixed(A: Any, B: Any) -> tuple[int, str]:
    pygambit = import_module("pygambit")
    game = pygambit.Game.from_arrays(
        *([[Fraction(payoff) for payoff in row] for row in table] for table in (A, B))
    )
    return len(pygambit.nash.enummixed_solve(game, rational=True).equilibria), ""


def nashpy(A: Any, B: Any, algorithm: str) -> tuple[int, str]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about degenerate games
        all_of_them = list(getattr(import_module("nashpy").Game(A, B), algorithm)())
    once = {
        tuple(np.round(np.concatenate(each), 9) + 0.0)
        for each in all_of_them
        if np.isfinite(np.hstack(each)).all()
    }
    return len(once), f" of {len(all_of_them)}" if len(all_of_them) > len(once) else ""


NASHPY = {
    name: partial(nashpy, algorithm=name)
    for name in (
        "support_enumeration",
        "vertex_enumeration",
        "lemke_howson_enumeration",
    )
}


def solvers() -> dict[str, Any]:
    """The installed ones by name, with what they import loaded."""
    ours(np.eye(2), np.eye(2))
    found = {"lcpcli.solutions": ours}
    if shutil.which("lrsnash"):
        found["lrsnash"] = lrsnash
    for package, algorithms in {
        "pygambit": {"enummixed": enummixed},
        "nashpy": NASHPY,
    }.items():
        with suppress(ModuleNotFoundError):
            import_module(package)
            found |= algorithms
    return found


def timed(function: Any, arguments: tuple[Any, ...], results: Any) -> None:
    os.setpgrp()  # so that a program that it starts is stopped as well
    began = time.perf_counter()
    number, remark = function(*arguments)
    results.put(f"{number}{remark} in {time.perf_counter() - began:.3g} s")


def told(limit: float, function: Any, *arguments: Any) -> str:
    """The number of equilibria and the seconds; "" if it was stopped."""
    results = multiprocessing.SimpleQueue()
    process = multiprocessing.Process(target=timed, args=(function, arguments, results))
    process.start()
    process.join(limit)
    if process.is_alive():
        assert process.pid is not None
        os.killpg(process.pid, signal.SIGKILL)
        return ""
    return "failed" if results.empty() else str(results.get())


if __name__ == "__main__":
    limit, asked = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0, solvers()
    widths = (16, *(max(26, len(name)) for name in asked))
    show(("game", *asked), widths)
    for name, payoffs in games().items():
        cells = {
            each: told(limit, solve, *payoffs) if solve else "-"
            for each, solve in asked.items()
        }
        show((name, *(cell or f"over {limit:g} s" for cell in cells.values())), widths)
        if name.startswith("random"):
            asked = {
                each: solve if cells[each] else None for each, solve in asked.items()
            }
