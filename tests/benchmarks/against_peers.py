"""`auto` against other solvers on the same problems in the same run: against_peers.py dense|sparse

Prints the median seconds of each over interleaved repeats, the relative residual that was recomputed, and the ratio of
auto to the fastest peer whose residual is at most 1e-5.
"""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import peers

import lcpcli
from lcpcli import gallery

ACCEPTABLE = 1e-5
REST = 0.1  # seconds in which the threads of what ran before stop spinning
SLOW = 3.0  # seconds; a peer that takes longer is run once


def ours(M: Any, q: Any) -> tuple[float, Any]:
    result = lcpcli.run(lcpcli.Problem(M, q), "auto")
    if not result.solved:
        raise SystemExit(f"auto has not solved it: {result.message}")
    return result.setup_seconds + result.solve_seconds, result.z


def compare(
    title: str, problem: lcpcli.Problem, symmetric: bool, repeats: int, leave_out: tuple[str, ...] = ()
) -> None:
    M, q = problem.M, problem.q
    solvers = {"auto": ours} | peers.available(symmetric, isinstance(M, np.ndarray))
    times: dict[str, list[float]] = {name: [] for name in solvers if name not in leave_out}
    residuals: dict[str, float] = {}
    for _ in range(repeats):
        for name in times:
            if name == "auto" or not times[name] or times[name][0] < SLOW:
                time.sleep(REST)
                seconds, z = solvers[name](M, q)
                times[name].append(seconds)
                residuals[name] = float(np.abs(np.minimum(z, M @ z + q)).max() / np.abs(q).max())
    medians = {name: statistics.median(values) for name, values in times.items()}
    print(title)
    for name, seconds in sorted(medians.items(), key=lambda item: item[1]):
        print(f"  {name:16} {seconds * 1e3:10.2f} ms   residual {residuals[name]:.1e}")
    rivals = {name: t for name, t in medians.items() if name != "auto" and residuals[name] <= ACCEPTABLE}
    if rivals:
        fastest = min(rivals, key=lambda name: rivals[name])
        print(f"  auto / {fastest}: {medians['auto'] / rivals[fastest]:.2f}", flush=True)


def main() -> None:
    if sys.argv[1:] == ["dense"]:
        for n in (300, 1000, 2000):
            for symmetric in (True, False):
                lemkes = ("quantecon lemke", "siconos lemke") if n > 300 else ()
                kind = "symmetric" if symmetric else "nonsymmetric"
                problem = gallery.make("harker-pang", n, symmetric=symmetric)
                compare(f"Harker-Pang, {kind}, n = {n}", problem, symmetric, 5, lemkes)
    elif sys.argv[1:] == ["sparse"]:
        for m in (100, 300):
            compare(f"obstacle problem on a {m} x {m} grid", gallery.make("obstacle", m * m), symmetric=True, repeats=3)
    else:
        raise SystemExit(__doc__)


if __name__ == "__main__":
    main()
