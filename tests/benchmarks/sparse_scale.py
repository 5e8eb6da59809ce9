"""`auto` on obstacle problems beside PIQP, on large ones, and on other sparse
M-matrices: sparse_scale.py [PART ...]

100, 300 : eleven obstacle problems on a grid of this width, each solved by `auto` and
    by PIQP (to 1e-10, as for `lcp bench`) in turn in this process: medians of the
    seconds from arrays in memory to the answer, and of their ratio.
growth : grids of 10^4 to 10^6 points, each in a process of its own: seconds, those of
    the processor, iterations, peak memory, and the exponents of n.
huge : grids of 10^5, 10^6, 4 * 10^6 and 10^7 points, two obstacles and one with an
    anisotropic membrane, in the same way: five gigabytes, and half an hour.
others : other sparse M-matrices: seconds, and how they were solved.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from statistics import median

from measuring import in_processes
from obstacles import MEMBRANES, OTHERS

import lcpcli
from lcpcli.peers.packages import piqp

REPEATS, FEW = 7, 3
WIDTHS = (100, 150, 220, 330, 500, 700, 1000)
GROWING = ("cap", "gallery", "bumps")
HUGE_WIDTHS = (317, 1000, 2000, 3163)
HUGE = ("bumps", "gallery", "bumps, anisotropic 10")
MEASURES = ("seconds", "processor", "GB")


def beside_piqp(m: int, repeats: int) -> None:
    lcpcli.solve(*MEMBRANES["gallery"](30))  # imports
    for name, make in MEMBRANES.items():
        data, times = make(m), []
        for _ in range(repeats):
            began = time.perf_counter()
            result = lcpcli.solve(*data)
            own = time.perf_counter() - began
            claim = piqp.solve(lcpcli.Problem(*data), 1e-10, float("inf"))
            assert claim.solved
            times.append((own, claim.seconds))
        own, other = (median(column) for column in zip(*times, strict=True))
        seconds = (
            f"{1e3 * own:8.1f} ms, PIQP {1e3 * other:8.1f} ms, ratio "
            f"{median(a / b for a, b in times):.2f}"
        )
        print(
            f"{name:24} {seconds}; {result.status.word}, "
            f"{result.relative_residual:.0e}",
            flush=True,
        )


def alone(name: str, m: int) -> dict[str, float]:
    """n, seconds by the wall and of the processor, iterations, and the peak memory of
    the process in GB."""
    lcpcli.solve(*MEMBRANES[name](30))
    data = MEMBRANES[name](m)
    began, processor = time.perf_counter(), time.process_time()
    result = lcpcli.solve(*data)
    seconds, processor = time.perf_counter() - began, time.process_time() - processor
    assert result.solved
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return {
        "n": m * m,
        "seconds": seconds,
        "processor": processor,
        "iterations": result.iterations,
        "GB": memory,
    }


def others() -> None:
    for name, make in OTHERS.items():
        data = make()
        results = [lcpcli.solve(*data) for _ in range(FEW)]
        seconds = f"{1e3 * median(result.seconds for result in results):9.1f} ms"
        print(
            f"{name:34} {seconds}; {results[0].status.word} by "
            f"{', '.join(results[0].route)}",
            flush=True,
        )


def main() -> None:
    parts = sys.argv[1:] or ["100", "300", "growth", "huge", "others"]
    if parts[0] == "alone":
        print(json.dumps(alone(parts[1], int(parts[2]))))
        return
    for part in parts:
        print(f"\n{part}", flush=True)
        if part in ("growth", "huge"):
            names, widths = (
                (GROWING, WIDTHS) if part == "growth" else (HUGE, HUGE_WIDTHS)
            )
            for name in names:
                in_processes(__file__, name, widths, *MEASURES)
        elif part == "others":
            others()
        else:
            beside_piqp(int(part), REPEATS if int(part) <= 100 else FEW)


if __name__ == "__main__":
    main()
