"""Processes that are killed (SIGKILL) at random moments while they write files, logs,
records of a bench and compiled kernels; after each kill it is examined that nothing is
lost and nothing stays broken.

    python tests/benchmarks/kills.py --kills 200

A file is the old one or the new one. A log goes on from what it has, and in the end
has each problem once. A record of a bench is whole and can be resumed. Kernels load,
without a word about damage.
"""

import argparse
import json
import os
import random
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from lcpcli.bench import record

MAIN = "from lcpcli.cli.main import main; main()"
GOOD = '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}\n'
PROBLEMS = 2000  # of a log
LOAD = "from lcpcli.kernels.loading import load; load('measure_kernels')"
PATIENCE = 300.0  # seconds until something that must happen has not


class Kills:
    """Commands that are killed at moments between their start and their usual end."""

    def __init__(self, folder, seed):
        self.folder, self.random = folder, random.Random(seed)
        self._usual = {}  # seconds of a command, by its first words
        self.killed = 0  # the others had ended

    def run(self, name, program, *words, **environment):
        """Kill a process at a random moment; return whether it had ended."""
        longest = self._usual.get(name, 2.0)
        begun = time.monotonic()
        with self._started(program, words, environment) as process:
            try:
                process.wait(self.random.uniform(0, longest))
            except subprocess.TimeoutExpired:
                process.kill()
                self.killed += 1
                self._usual[name] = 1.05 * longest
                return False
        self._usual[name] = 1.1 * (time.monotonic() - begun)
        return True

    def whole(self, program, *words, **environment):
        """Run a process to its end; return its exit code and what it printed."""
        process = self._started(program, words, environment)
        out, err = process.communicate(timeout=PATIENCE)
        return process.returncode, out, err

    def _started(self, program, words, environment):
        return subprocess.Popen(
            [sys.executable, "-c", program, *words],
            cwd=self.folder,
            env=os.environ | environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )


def file(kills):
    """A file that is replaced is the old one, or the new one."""
    path = kills.folder / "out.json"
    old = '{"old": true}'
    path.write_text(old)
    kills.run("file", MAIN, "make", "obstacle", "-n", "40000", "-o", str(path))
    text = path.read_text()
    assert text == old or len(json.loads(text)["q"]) > 10_000


def log(kills):
    """A log goes on from what it has, and has each problem once in the end."""
    inputs, path = kills.folder / "many.jsonl", kills.folder / "log.jsonl"
    if not inputs.exists():
        inputs.write_text(GOOD * PROBLEMS)
        # Else the runs would be killed while they compile, and hardly ever write.
        kills.whole(MAIN, "kernels")
    words = "solve", str(inputs), "--jobs", "2", "-q", "--resume", str(path)
    before = path.read_text().count("\n") if path.exists() else 0
    has_ended = kills.run("log", MAIN, *words)
    assert not path.exists() or path.read_text().count("\n") >= before
    if has_ended or kills.random.random() < 0.1:
        code, _, err = kills.whole(MAIN, *words)
        assert (code, err) == (0, ""), err
        records = [json.loads(line) for line in path.read_text().splitlines()]
        numbers = sorted(each["number"] for each in records)
        assert numbers == list(range(1, PROBLEMS + 1))
        path.unlink()


def bench(kills):
    """The record of a bench is whole, and is resumed."""
    path = kills.folder / "bench.json"
    case = "tridiagonal-100", "paper-example-1", "paper-example-2"
    new = "bench", *case, "--budget", "0", "-q", "-o", str(path)
    words = ("bench", "--resume", str(path), "-q") if path.exists() else new
    before = measured(path)
    has_ended = kills.run("bench", MAIN, *words)
    assert measured(path) >= before
    if path.exists() and (has_ended or kills.random.random() < 0.1):
        code, _, err = kills.whole(MAIN, "bench", "--resume", str(path), "-q")
        assert (code, err) == (0, ""), err
        path.unlink()


def measured(path):
    """The number of measurements in a record, of which a killed bench leaves each but
    the one that it was writing."""
    return len(record.read(str(path)).measurements) if path.exists() else 0


def kernels(kills):
    """Kernels load after all, with no word but that they are compiled, and those that
    were there are not compiled again."""
    own = {"NUMBA_CACHE_DIR": str(kills.folder / "cache")}
    if not kills.run("kernels", LOAD, **own) and kills.random.random() < 0.7:
        return
    code, _, err = kills.whole(LOAD, **own)
    assert (code, "damaged" in err, len(err.splitlines()) <= 1) == (0, False, True), err
    assert kills.whole(LOAD, **own) == (0, "", "")
    for path in (kills.folder / "cache").rglob("*"):
        if path.is_file():
            path.unlink()


KINDS = {
    "file": (file, 0.4),
    "log": (log, 0.3),
    "bench": (bench, 0.2),
    "kernels": (kernels, 0.1),
}


def run(number, seed, names, tell):
    """Kill so many processes, and examine what they leave; return how many runs were
    killed, as the others had ended before."""
    total = 0
    shares = sum(KINDS[name][1] for name in names)
    for name in names:
        function, share = KINDS[name]
        with TemporaryDirectory() as folder:
            kills, most = Kills(Path(folder), seed), round(number * share / shares)
            while kills.killed < most:
                function(kills)
            left = sorted(
                path.name for path in Path(folder).iterdir() if path.name[0] == "."
            )
            tell(f"{name}: {kills.killed} kills, {len(left)} temporary files left")
            total += kills.killed
    return total


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=200)
    given = parser.parse_args()
    total = run(given.kills, 0, list(KINDS), print)
    print(f"{total} kills: nothing lost, nothing broken")


if __name__ == "__main__":
    main()
