"""`auto` on obstacle problems beside PIQP, on large ones, and on other sparse M-matrices: sparse_scale.py [PART ...]

100, 300 : eleven obstacle problems on a grid of this width, each solved by `auto` and by PIQP (to 1e-10, as for `lcp
    bench`) in turn in this process: medians of the seconds from arrays in memory to the answer, and of their ratio.
growth : grids of 10^4 to 10^6 points, each in a process of its own: seconds, those of the processor,
    peak memory, and the exponents of n.
huge : 2000 x 2000 points.
others : other sparse M-matrices: seconds, and how they were solved.
"""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
import sys
import time

from obstacles import MEMBRANES, OTHERS

import lcpcli
from lcpcli.bench.statistics import growth
from lcpcli.peers.packages import piqp

REPEATS, FEW = 7, 3
WIDTHS = (100, 150, 220, 330, 500, 700, 1000)
GROWING = ("cap", "gallery", "bumps")


def beside_piqp(m: int, repeats: int) -> None:
    lcpcli.solve(*MEMBRANES["gallery"](30))  # imports
    for name, make in MEMBRANES.items():
        data, times = make(m), []
        for _ in range(repeats):
            began = time.perf_counter()
            result = lcpcli.solve(*data)
            times.append((time.perf_counter() - began, piqp_seconds(data)))
        own, other = (statistics.median(column) for column in zip(*times, strict=True))
        ratio = statistics.median(one / two for one, two in times)
        print(
            f"{name:24} {1e3 * own:8.1f} ms, PIQP {1e3 * other:8.1f} ms, ratio {ratio:.2f}; "
            f"{result.status.word}, {result.relative_residual:.0e}",
            flush=True,
        )


def piqp_seconds(data: tuple[object, object]) -> float:
    claim = piqp.solve(lcpcli.Problem(*data), 1e-10, float("inf"))
    assert claim.solved
    return claim.seconds


def alone(name: str, m: int) -> dict[str, float]:
    """n, seconds by the wall and of the processor, and the peak memory of the process in GB."""
    lcpcli.solve(*MEMBRANES[name](30))
    data = MEMBRANES[name](m)
    began, processor = time.perf_counter(), time.process_time()
    result = lcpcli.solve(*data)
    seconds, processor = time.perf_counter() - began, time.process_time() - processor
    assert result.solved
    return {
        "n": m * m,
        "seconds": seconds,
        "processor": processor,
        "GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }


def in_processes(widths: tuple[int, ...], names: tuple[str, ...]) -> None:
    for name in names:
        rows = []
        for m in widths:
            command = [sys.executable, __file__, "alone", name, str(m)]
            rows.append(json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout))
            print(f"{name}: " + ", ".join(f"{key} {value:.4g}" for key, value in rows[-1].items()), flush=True)
        for measure in ("seconds", "processor", "GB"):
            fit = growth([(row["n"], row[measure]) for row in rows])
            if fit is not None:
                print(f"  {measure}: n^{fit.exponent:.2f} ± {fit.margin:.2f}", flush=True)


def others() -> None:
    for name, make in OTHERS.items():
        data = make()
        results = [lcpcli.solve(*data) for _ in range(FEW)]
        seconds = statistics.median(result.seconds for result in results)
        print(
            f"{name:38} {1e3 * seconds:9.1f} ms; {results[0].status.word} by {', '.join(results[0].route)}", flush=True
        )


def main() -> None:
    parts = sys.argv[1:] or ["100", "300", "growth", "huge", "others"]
    if parts[0] == "alone":
        print(json.dumps(alone(parts[1], int(parts[2]))))
        return
    for part in parts:
        print(f"\n{part}", flush=True)
        if part == "growth":
            in_processes(WIDTHS, GROWING)
        elif part == "huge":
            in_processes((2000,), GROWING[:2])
        elif part == "others":
            others()
        else:
            beside_piqp(int(part), REPEATS if int(part) <= 100 else FEW)


if __name__ == "__main__":
    main()
