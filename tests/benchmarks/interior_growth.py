"""How time and memory of `interior` grow with n on three sparse families:
interior_growth.py

Every size is solved by a process of its own. Prints seconds, iterations and the memory
that solving adds to that of the imports and the problem, then exponents of n with their
95 % intervals, over all sizes.
"""

from __future__ import annotations

import json
import resource
import sys

from measuring import in_processes

import lcpcli
from lcpcli.gallery import families as gallery

SIZES = (3_000, 10_000, 30_000, 100_000)
FAMILIES = {
    "control": SIZES,
    "transport": SIZES,
    "two-obstacles": (3_025, 10_000, 30_276, 99_856),
}
REPEATS = 3


def solved(family: str, n: int) -> dict[str, float]:
    """n, the least seconds of some runs, iterations and MB."""
    lcpcli.run(gallery.make(family, 400), "interior")  # imports
    problem = gallery.make(family, n)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    results = [lcpcli.run(problem, "interior") for _ in range(REPEATS)]
    assert all(result.solved for result in results)
    added = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 2**10
    seconds = min(result.seconds for result in results)
    return {
        "n": problem.n,
        "seconds": seconds,
        "iterations": results[0].iterations,
        "megabytes": added,
    }


if __name__ == "__main__":
    if sys.argv[1:2] == ["alone"]:
        print(json.dumps(solved(sys.argv[2], int(sys.argv[3]))))
    else:
        for family, sizes in FAMILIES.items():
            in_processes(__file__, family, sizes, "seconds", "megabytes")
