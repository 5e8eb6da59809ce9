"""Populations say the same each time, claim nothing false, and their records show what
differs."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
# The sizes of the samples, each of which takes a few seconds.
SAMPLES = {
    "oracle": 40,
    "verdicts": 40,
    "iterates": 20,
    "nonlinear": 10,
    "games": 40,
    "contact": 10,
    "sequences": 5,
}


def script(name, *arguments):
    command = [sys.executable, HERE / f"{name}.py", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.parametrize("population", SAMPLES)
def test_a_sample_run_twice_differs_in_nothing_and_is_never_false(population, tmp_path):
    number = str(SAMPLES[population])
    records = [str(tmp_path / name) for name in ("before", "after")]
    for record in records:
        done = script(population, "--sample", number, "-o", record)
        assert done.returncode == 0, done.stderr
    compared = script("compare", *records)
    assert compared.returncode == 0, compared.stdout
    assert f"{number} cases in both, 0 in one; nothing differs" in compared.stdout


@pytest.mark.slow
def test_a_false_claim_is_shown_as_what_differs_with_its_worth(tmp_path):
    before, after = tmp_path / "before", tmp_path / "after"
    script("verdicts", "--only", "gallery tridiagonal 3", "-o", str(before))
    header, line = before.read_text().splitlines()
    wrong = json.loads(line)
    wrong["z"][0] += 1.0
    after.write_text(f"{header}\n{json.dumps(wrong)}\n")
    compared = script("compare", str(before), str(after))
    assert compared.returncode == 1
    assert "before: right; after: false: z violates the conditions" in compared.stdout
