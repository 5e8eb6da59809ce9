"""What differs between two records of a population, and which one is right.

    # exit code 1 if anything is compared and differs
    python tests/seams/compare.py BEFORE AFTER

Numbers count as equal if they differ by rounding; hashes and words if they are the
same. A case is repeated by its population's script with --seed and --only, as printed;
which record is right is decided in fractions, where it can be.
"""

import argparse
import json
from collections import Counter
from importlib import import_module
from pathlib import Path

import truth

CLOSE = 1e-6  # relative to each number
# Relative to the largest number of a vector: below it, numbers count as equal.
TINY = 1e-12
SHOWN = 20  # differences that are printed for each field


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument(
        "--ignore",
        nargs="*",
        default=[],
        metavar="FIELD",
        help="fields such as route, iterations",
    )
    arguments = parser.parse_args()
    (header, before), (other, after) = read(arguments.before), read(arguments.after)
    if any(header[name] != other[name] for name in ("population", "seed", "data")):
        parser.error("the records are of different populations, seeds or folders")
    made = Remade(header)
    counts = Counter()
    for key in [key for key in before if key in after]:
        fields = [
            field
            for field in differing(before[key], after[key])
            if field not in arguments.ignore
        ]
        for field in fields:
            counts[field] += 1
        if fields and counts[fields[0]] <= SHOWN:
            print(made.line(key, before[key], after[key], fields))
    alone = set(before) ^ set(after)
    differences = (
        ", ".join(f"{field} of {number}" for field, number in sorted(counts.items()))
        or "nothing"
    )
    print(
        f"{header['population']}: {len(set(before) & set(after))} cases in "
        f"both, {len(alone)} in one; {differences}",
        "differs",
    )
    raise SystemExit(1 if counts or alone else 0)


def read(path):
    """Return the header of a record, and its entries by key."""
    header, *lines = map(
        json.loads, Path(path).read_text(encoding="utf-8").splitlines()
    )
    return header, {entry.pop("key"): entry for entry in lines}


def differing(a, b):
    return [
        field
        for field in dict.fromkeys([*a, *b])
        if not equal(a.get(field), b.get(field))
    ]


def equal(a, b, largest=0.0):
    """Return whether two recorded values are the same up to rounding."""
    if isinstance(a, list) and isinstance(b, list):
        numbers = [abs(v) for v in a if isinstance(v, float)]
        return len(a) == len(b) and all(
            equal(v, w, max(numbers, default=0.0)) for v, w in zip(a, b, strict=True)
        )
    if isinstance(a, float) and isinstance(b, float):
        return (
            a == b
            or abs(a - b) <= max(CLOSE * max(abs(a), abs(b)), TINY * largest)
            or (a != a and b != b)
        )
    return bool(a == b)


class Remade:
    """The cases of a population, made again to decide which record is right."""

    def __init__(self, header):
        self._header, self._cases = header, None

    def line(self, key, before, after, fields):
        """Return what differs in a case, what each is worth, and how to repeat it."""
        header = self._header
        changes = (
            f"{f} {_short(before.get(f))} -> {_short(after.get(f))}" for f in fields
        )
        lines = [f"{key}: {', '.join(changes)}"]
        if {"status", "z", "y"} & {*fields}:
            lines.append(
                f"before: {self._worth(key, before)}; after: {self._worth(key, after)}"
            )
        data = f" --data {header['data']}" if header["data"] else ""
        lines.append(
            f"python tests/seams/{header['population']}.py --seed "
            f"{header['seed']}{data} --only {key!r}"
        )
        return "\n    ".join(lines)

    def _worth(self, key, entry):
        if "worth" in entry:
            return str(entry["worth"])
        if self._cases is None:
            header = self._header
            data = [Path(header["data"])] if header["data"] else []
            made = import_module(header["population"]).cases(header["seed"], *data)
            self._cases = {case.key: case.make for case in made}
        problem = self._cases[key]()
        return (
            truth.judge(problem, entry)
            if hasattr(problem, "M") and "z" in entry
            else "undecided"
        )


def _short(value):
    text = str(value)
    return text if len(text) <= 60 else text[:57] + "..."


if __name__ == "__main__":
    main()
