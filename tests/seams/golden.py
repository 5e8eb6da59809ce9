"""What every command prints in every format: golden.py -o FOLDER [--only NAME...], then
golden.py --compare OLD NEW.

    # the lcpcli of this checkout
    python tests/seams/golden.py -o new
    # that of another one
    PYTHONPATH=../before python tests/seams/golden.py -o old
    # what differs, command by command
    python tests/seams/golden.py --compare old new

Each command has a file in FOLDER, with its exit code, standard output, standard error
and the files that it wrote. Times, versions, dates and paths are masked. --only selects
commands by the beginnings of their words. The exit code of --compare is 1 if anything
differs.
"""

import argparse
import difflib
import os
import re
import shlex
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parents[2]
TABLES = ("table", "json", "csv", "markdown", "latex", "html")
SETTINGS = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "COLUMNS": "100",
    "NO_COLOR": "1",
    "PYTHONHASHSEED": "0",
}
DIFFERENT_LINES = 12  # shown of each command
# lcp with a clock that advances by the same step at each look, so that decisions by
# time are the same in each run
BOOT = """
import itertools, sys, time
ticks = itertools.count()
for name in ("perf_counter", "process_time", "thread_time", "monotonic"):
    setattr(time, name, lambda: next(ticks) * 1e-4)
from lcpcli.cli.main import main
sys.argv = ["lcp", *sys.argv[1:]]
main()
"""
MASKS = [  # what differs from run to run, or from machine to machine
    (r"(\d[\d.,]*(e[+-]?\d+)?|-) ?(ns|µs|us|ms|s|min|h)\b", "TIME"),
    (
        r'("?\w*(seconds|times?|overhead|speed|duration|started|date|cpu|memory)'
        r'\w*"?:\s*)(\[[^\]]*\]|[^,\s}\]]+)',
        r"\1TIME",
    ),
    (
        r'("(version|python|numpy|scipy|platform|processor|machine|system|commit)'
        r'\w*":\s*)("[^"]*"|[^,\s}\]]+)',
        r"\1MASKED",
    ),
    (r"\b20\d\d-\d\d-\d\d([T ][\d:.+Z-]*)?", "DATE"),
    (r"data:image/svg\+xml;base64,[^\"]*", "FIGURE"),
    (r'\b(lcp|lcpcli|version|Version|lcpcli":) "?\d+\.\d+\.\d+"?', "VERSION"),
    (r"time/(ms|us|\$\\mu\$s|s)", "time"),
    (r" *\b\d+\.\d{3}(?=( \||  *\\\\)?\n)", " TIME"),  # the last column of a table
]
INPUTS = {  # files that the commands read, in the folder in which they run
    "mixed.json": (
        '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": [0, null], "upper": [1, null]}'
    ),
    "none.json": '{"M": [[0, 0], [0, 0]], "q": [-1, 1]}',
    "ray.json": '{"M": [[0, 1], [-1, 0]], "q": [-1, -1]}',
    "many.json": '{"M": [[1, 2], [2, 1]], "q": [-1, -1]}',
    "plain.csv": "2,1,-5\n1,2,-6\n",
    "other.json": '{"M": [[2, 1], [1, 2]], "q": [5, -6]}',
    "from.json": '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}',
    "M.csv": "2,1\n1,2\n",
    "q.csv": "-5\n-6\n",
    "Q.csv": "-5,1,3\n-6,-2,4\n",
    "lines.jsonl": (
        '{"M": [[2]], "q": [-1]}\n{"M": [[0]], "q": [-1]}\n{"M": [[1]], "q": [2]}\n'
    ),
    "qp.json": (
        '{"Q": [[4, 1], [1, 2]], "c": [1, 1], "A": [[1, 1]], "row_lower": [1], '
        '"row_upper": [1]}'
    ),
    "lp.json": '{"c": [1, 2], "A": [[1, 1]], "row_lower": [1], "lower": [0, 0]}',
    "infeasible.json": (
        '{"c": [1], "A": [[1], [1]], "row_lower": [2, null], "row_upper": [null, 1]}'
    ),
    "game.json": '{"A": [[3, 0], [5, 1]], "B": [[3, 5], [0, 1]]}',
    "z.json": "[1.3333333333333333, 2.3333333333333335]",
    "wrong.json": "[1, 1]",
    "ragged.csv": "2,1,-5\n1,2\n",
    "letters.csv": "2,a,-5\n1,2,-6\n",
    "broken.json": '{"M": [[1]',
    "short.json": '{"M": [[1, 0], [0, 1]], "q": [1]}',
}
PROBLEMS = (
    "paper-example-1 bimatrix diode-bridge mixed.json none.json ray.json qp.json "
    "lp.json infeasible.json game.json"
)
METHODS = "auto shi fixed-point newton lemke milp interior"
COMPARED = "--method newton --method lemke --method fixed-point:omega=2"
FAMILIES = (
    "harker-pang ill-scaled tridiagonal dominant obstacle two-obstacles torsion "
    "journal-bearing american-put contact "
    "rigid-boxes bimatrix poker bargaining circuit relays spatial-prices boxes "
    "lp qp portfolio frontier lasso control "
    "transport murty all-cones fathi ben-gharbia-gilbert curtis-han-robinson kostreva"
)
TOPICS = (
    "changes cite derivatives development formats json many measuring methods "
    "mixed nonlinear paper paths programs "
    "proofs python sequences solutions sources speed stability statuses tasks"
)
COMMANDS = "solve compare path bench check inspect make convert completion help"
REFUSED = (
    "solve absent.json",
    *(
        f"{command} {name}"
        for command in ("solve", "inspect")
        for name in ("ragged.csv", "letters.csv", "broken.json")
    ),
    *(
        "solve short.json",
        "solve paper-example-1 --method none",
        "solve paper-example-1 --tol 2",
        "solve mixed.json --p 0",
    ),
    *(
        "check from.json",
        "path from.json",
        "make none",
        "make obstacle -n 0",
        "convert M.csv -o p.xyz",
        "completion csh",
    ),
    *(
        "bench none",
        "help zzzz",
        "solve plain.csv --format xml",
        "path from.json mixed.json",
        "compare --sweep none=1",
    ),
)


def commands():
    """The commands, without `lcp`."""
    for form in TABLES:
        chosen = f"--format {form}"
        for name in PROBLEMS.split():
            yield f"solve {name} {chosen}"
        for options in ("--exact", "--bound", "--all", "--every 1 --method newton"):
            yield f"solve from.json {options} {chosen}"
        for problem in (
            "many.json --all",
            "bimatrix --all",
            "none.json --exact",
            "mixed.json --exact",
            "M.csv Q.csv",
        ):
            yield f"solve {problem} {chosen}"
        yield f"solve lines.jsonl {chosen}"
        yield f"compare from.json mixed.json {COMPARED} {chosen}"
        yield f"path from.json other.json --at 0.5 {chosen}"
        yield f"path from.json --direction 1,1 --to 4 --exact {chosen}"
        yield (
            "bench paper-example-1 from.json --method newton --method lemke "
            f"--budget 0 {chosen}"
        )
        for name in ("paper-example-1", "mixed.json", "qp.json", "bimatrix"):
            yield f"inspect {name} {chosen}"
        for z in ("z.json", "wrong.json", "z.json --exact"):
            yield f"check from.json {z} {chosen}"
    for method in METHODS.split():
        for name in ("paper-example-2", "mixed.json", "none.json"):
            yield f"solve {name} --method {method} --max-iterations 50 --format json"
    for family in FAMILIES.split():
        yield f"make {family} -n 6"
    for suffix in ("json", "csv", "mtx", "npz", "npy", "mat"):
        yield f"convert from.json -o written.{suffix}"
    for name, suffix in (
        ("qp.json", "mps"),
        ("lp.json", "mps"),
        ("mixed.json", "csv"),
        ("game.json", "json"),
    ):
        yield f"convert {name} -o written.{suffix}"
    for suffix in ("txt", "json", "csv", "md", "tex", "html"):
        yield f"solve mixed.json -o written.{suffix}"
    yield from (
        "make --list",
        "--version",
        "--help",
        "help",
    )
    yield from (f"completion {shell}" for shell in ("bash", "zsh", "fish"))
    yield from (f"help {topic}" for topic in TOPICS.split())
    yield from (f"{command} --help" for command in COMMANDS.split())
    yield from REFUSED


def masked(text, folder):
    """The text without what changes from run to run."""
    text = text.replace(folder, "FOLDER").replace(str(HERE), "CHECKOUT")
    for pattern, replacement in MASKS:
        text = re.sub(pattern, replacement, text)
    return "\n".join(
        line.rstrip()
        for line in re.sub(r"(TIME)[ \t]+|[ \t]+(?=TIME)", r" \1", text).split("\n")
    )


def output(command):
    """What a command prints and writes, run in a folder of its own."""
    path = os.environ.get("PYTHONPATH", str(HERE))
    with tempfile.TemporaryDirectory() as folder:
        for name, text in INPUTS.items():
            Path(folder, name).write_text(text)
        words = [sys.executable, "-c", BOOT, *shlex.split(command)]
        environment = os.environ | SETTINGS | {"PYTHONPATH": os.path.abspath(path)}
        run = subprocess.run(
            words,
            cwd=folder,
            capture_output=True,
            env=environment,
            stdin=subprocess.DEVNULL,
            timeout=300,
        )
        parts = [f"$ lcp {command}", f"exit code {run.returncode}"]
        parts += [
            "-- standard output",
            run.stdout.decode(),
            "-- standard error",
            run.stderr.decode(),
        ]
        for written in sorted(
            path
            for path in Path(folder).rglob("*")
            if path.is_file() and path.name not in INPUTS
        ):
            content = written.read_bytes()
            parts.append(f"-- {written.relative_to(folder)}")
            is_text = written.suffix not in (".npz", ".npy", ".mat")
            parts.append(content.decode() if is_text else f"{len(content)} bytes")
        return masked("\n".join(parts), folder)


def file_name(command):
    """The name of the file for a command."""
    return re.sub(r"[^\w.=,+-]+", "_", command) + ".txt"


def compare(old, new):
    """Print a short diff of each command that differs, and how many do."""
    names = [{path.name for path in folder.glob("*.txt")} for folder in (old, new)]
    if not names[0] & names[1]:
        sys.exit("golden.py: the folders have no command in common")
    different = 0
    for name in sorted(names[0] | names[1]):
        if not all(name in side for side in names):
            print(f"only in {old if name in names[0] else new}: {name}")
            different += 1
            continue
        texts = [(folder / name).read_text().split("\n") for folder in (old, new)]
        if texts[0] != texts[1]:
            different += 1
            lines = list(difflib.unified_diff(*texts, n=0, lineterm=""))[2:]
            print(
                texts[0][0],
                *(f"    {line[:160]}" for line in lines[:DIFFERENT_LINES]),
                sep="\n",
            )
            if len(lines) > DIFFERENT_LINES:
                print(f"    and {len(lines) - DIFFERENT_LINES} more lines")
    print(f"{len(names[0] | names[1])} commands, {different} differ")
    return int(different > 0)


def main():
    """Run the commands, or compare two folders."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FOLDER",
        help="write the outputs to this folder",
    )
    parser.add_argument(
        "--compare",
        nargs=2,
        type=Path,
        metavar=("OLD", "NEW"),
        help="compare two folders",
    )
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="NAME",
        help="commands that begin with one of these",
    )
    parser.add_argument(
        "--jobs", type=int, default=2, help="commands that run at once (default 2)"
    )
    arguments = parser.parse_args()
    if arguments.compare:
        return compare(*arguments.compare)
    if not arguments.output:
        parser.error("either -o or --compare is required")
    chosen = [
        each
        for each in dict.fromkeys(commands())
        if each.startswith(tuple(arguments.only or [""]))
    ]
    arguments.output.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for command, text in zip(chosen, pool.map(output, chosen), strict=True):
            (arguments.output / file_name(command)).write_text(text)
    print(f"{len(chosen)} commands")
    return 0


if __name__ == "__main__":
    sys.exit(main())
