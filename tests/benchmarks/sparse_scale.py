"""`auto` on large sparse problems, as multiples of one sparse factorization of M: sparse_scale.py

Prints seconds, the relative residual that was recomputed, the factorization's seconds (scipy's splu of M in the same
process, where it can be had) and the peak memory of the process.
"""

from __future__ import annotations

import resource
import time

import numpy as np
from scipy.sparse.linalg import splu

import lcpcli
from lcpcli.gallery import families as gallery

CASES = {
    "tridiagonal, n = 10^6": ("tridiagonal", 10**6, True),
    "diagonally dominant, 10 a row, n = 10^5": ("dominant", 10**5, False),
    "obstacle problem, n = 1000 x 1000": ("obstacle", 10**6, True),
}


def main() -> None:
    for title, (family, n, factorize) in CASES.items():
        problem = gallery.make(family, n)
        result = lcpcli.run(problem, "auto")
        residual = np.abs(np.minimum(result.z, problem.w(result.z))).max() / np.abs(problem.q).max()
        seconds = result.seconds
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        print(f"{title}: {result.status.word} by {', '.join(result.route)}")
        print(f"  {seconds:.2f} s, relative residual {residual:.1e}, peak memory so far {memory:.2f} GB")
        if factorize:
            began = time.perf_counter()
            splu(problem.M.tocsc())
            factorization = time.perf_counter() - began
            print(f"  {seconds / factorization:.2f} factorizations of {factorization:.2f} s", flush=True)


if __name__ == "__main__":
    main()
