"""What the benchmarks share: calls in turns, so that what disturbs one disturbs all;
processes; rows of tables."""

import json
import math
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import linregress, t

Call = Callable[[], Any]


def in_turns(
    *calls, most, least=1, budget=math.inf, warm_up=1, clock=time.perf_counter
):
    """The seconds of each call in `least` to `most` rounds, as many as so many seconds
    allow, behind a warm-up."""
    rounds = []
    began = time.perf_counter()
    while len(rounds) < warm_up + least or (
        len(rounds) < warm_up + most and time.perf_counter() - began < budget
    ):
        rounds.append([])
        for call in calls:
            before = clock()
            call()
            rounds[-1].append(clock() - before)
    return [*zip(*rounds[warm_up:], strict=True)]


def show(cells, widths):
    """Print a row of a table, flush right."""
    texts = (f"{cell:.3g}" if isinstance(cell, float) else str(cell) for cell in cells)
    print(
        "  ".join(text.rjust(width) for text, width in zip(texts, widths, strict=True)),
        flush=True,
    )


def in_processes(script, name, sizes, *measures):
    """Print the JSON of `script alone NAME SIZE` for each size, then how these measures
    grow with n."""
    rows = []
    for size in sizes:
        command = [sys.executable, script, "alone", name, str(size)]
        rows.append(
            json.loads(
                subprocess.run(
                    command, capture_output=True, text=True, check=True
                ).stdout
            )
        )
        print(
            f"{name}: "
            + ", ".join(f"{key} {value:.4g}" for key, value in rows[-1].items()),
            flush=True,
        )
    for measure in measures:
        if len(rows) > 2:
            fit = linregress(*np.log([(row["n"], row[measure]) for row in rows]).T)
            # Of a 95 % confidence interval of the exponent.
            margin = fit.stderr * t.ppf(0.975, len(rows) - 2)
            print(f"  {measure}: n^{fit.slope:.2f} ± {margin:.2f}", flush=True)
