"""The command line of a population and its record: one JSON object a line, first a
header, then an entry for each case.

    # all cases, with the lcpcli that is on the path
    python tests/seams/oracle.py -o record
    # some cases of other random numbers
    python tests/seams/oracle.py --sample 50 --seed 1
    # one case, with its data
    python tests/seams/oracle.py --only 'lcp 17'

Only public functions of lcpcli are used, so that a record can be made with any
checkout: PYTHONPATH=OTHER python ...
"""

import argparse
import json
import os
import sys
import time
from collections import Counter
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

# The order of sums must not depend on threads.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
sys.path.append(str(Path(__file__).parents[1]))  # for what the tests share

import exact as exact  # noqa: E402
import exact_measure as exact_measure  # noqa: E402
import nonlinear_problems as nonlinear_problems  # noqa: E402
import numpy as np  # noqa: E402

GENEROUS_SECONDS = 120.0  # a limit for cases that hang; what ends the others is counted


class Case(NamedTuple):
    """One case: its key within the population, and a function that makes its problem
    anew."""

    key: str
    make: Callable[[], Any]


def main(cases, outcome):
    """Run the population's cases as the arguments say, write the record, and report
    what is false on standard error.

    cases : returns the cases for a seed and, if one is given, a folder of problem
        files.
    outcome : returns what is compared of one case. "false" among its names says what is
        wrong, whatever the other checkout does; the exit code is then 1.
    """
    arguments = _arguments()
    data = [arguments.data] if arguments.data else []
    chosen = cases(arguments.seed, *map(Path, data))
    if arguments.only is not None:
        chosen = [case for case in chosen if case.key == arguments.only]
        for case in chosen:
            print(described(case.make()))
    elif arguments.sample is not None and arguments.sample < len(chosen):
        picked = np.random.default_rng(0).choice(
            len(chosen), arguments.sample, replace=False
        )
        chosen = [chosen[k] for k in sorted(picked)]
    import lcpcli

    header = {
        "population": Path(sys.argv[0]).stem,
        "seed": arguments.seed,
        "data": arguments.data,
        "package": str(Path(lcpcli.__file__).parent),
        "version": lcpcli.__version__,
    }
    began, entries = time.process_time(), []
    with (
        open(arguments.output, "w", encoding="utf-8")
        if arguments.output
        else sys.stdout as out
    ):
        print(json.dumps(header), file=out)
        for case in chosen:
            entries.append({"key": case.key, **_outcome(case, outcome)})
            print(json.dumps(entries[-1]), file=out, flush=True)
    raise SystemExit(
        _report(header["population"], entries, time.process_time() - began)
    )


def _arguments():
    parser = argparse.ArgumentParser(description=sys.modules["__main__"].__doc__)
    parser.add_argument(
        "-o", "--output", help="the file of the record; by default standard output"
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="of the random numbers; 0 by default"
    )
    parser.add_argument(
        "--sample",
        type=int,
        metavar="K",
        help="run only K cases, spread over the population",
    )
    parser.add_argument(
        "--only", metavar="KEY", help="run one case, and print its data"
    )
    parser.add_argument(
        "--data", metavar="DIR", help="verdicts: also run the files in this folder"
    )
    return parser.parse_args()


def _outcome(case, outcome):
    try:
        return outcome(case, case.make())
    # What a call raises is what it did: it is recorded and compared like any other
    # outcome.
    except Exception as error:
        return {"status": f"{type(error).__name__}: {error}"}


def _report(population, entries, seconds):
    false = [entry for entry in entries if entry.get("false")]
    for entry in false:
        print(
            f"FALSE {entry['key']}: {entry['status']}; {entry['false']}",
            file=sys.stderr,
        )
    counts = Counter(
        (entry["key"].split()[0], entry.get("truth") or "", entry["status"])
        for entry in entries
    )
    for (kind, truth, status), number in sorted(counts.items()):
        print(f"{kind:16}{truth:16}{status[:60]:16}{number:8}", file=sys.stderr)
    print(
        f"{population}: {len(entries)} cases, {len(false)} false, {seconds:.0f} "
        "s of processor time",
        file=sys.stderr,
    )
    return 1 if false else 0


def of_result(result):
    """Return what is compared of a Result: status, z, the methods that took part, and a
    proof."""
    entry = {
        "status": result.status.word,
        "route": "+".join(result.route),
        "iterations": result.iterations,
        "z": [float(value) for value in result.z],
    }
    certificate = result.certificate
    if certificate is not None:
        entry["proof"] = certificate.kind + (
            " up to rounding" * ("rounding" in certificate.statement)
        )
        if certificate.exact is not None:
            entry["y"] = [str(value) for value in certificate.exact]
        elif certificate.vector is not None and certificate.kind == "farkas":
            entry["y"] = [float(value) for value in certificate.vector]
    return entry


def hash_of(*arrays):
    """Return a hash of the bytes of some arrays of doubles, in which -0 counts as 0."""
    digest = sha256()
    for array in arrays:
        digest.update((np.asarray(array, dtype=np.float64) + 0.0).tobytes())
    return digest.hexdigest()[:16]


def described(made):
    """Return the data of a case in words, small ones in full."""
    if not hasattr(made, "M"):
        return str(made)
    M = made.M if isinstance(made.M, np.ndarray) else made.M.toarray()
    bounds = [
        np.broadcast_to(bound, made.n).tolist() for bound in (made.lower, made.upper)
    ]
    return f"M = {M.tolist()}\nq = {made.q.tolist()}\nlower, upper = {bounds}"
