"""Each file is opened once and parsed once, whatever its kind and whatever is made of
it; a second time only where its decimals are asked for, which doubles do not keep."""

from collections import Counter
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy import io

from lcpcli import read, read_nl
from lcpcli.files import contents

from .nl_writing import model

M, Q = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])
# What parses a file of each kind; of .efg and .mps, all is done by one function.
PARSERS = {
    "csv": "files.csv_format.grid_of",
    "json": "files.json_format.load",
    "npy": "files.npy_format.parse",
    "npz": "files.npz_format.parse",
    "mat": "files.mat_format.parse",
    "mtx": "files.matrix_market_format.parse",
    "mps": "formulations.quadratic_program.mps_format.fields",
    "nl": "formulations.nonlinear_model.nl_format.segments_in",
    "efg": "formulations.game_tree.efg_format.fields",
}
EFG = """EFG 2 R "tree" { "Ann" "Bob" }
p "" 1 1 "" { "l" "r" } 0
t "" 1 "" { 1 2 }
t "" 2 "" { 3 0 }
"""
MPS = "NAME\nROWS\n N o\n G r\nCOLUMNS\n x o 1 r 1\nRHS\n R r 1\nENDATA\n"
LINEAR = ((5, 1, 1), {0: 2}, -4)
CURVED = ((5, 1, 1), {0: 2}, ("-", ("exp", "v0"), 4))


@pytest.fixture
def folder(in_folder):
    np.savetxt("M.csv", M, delimiter=",")
    np.savetxt("q.csv", Q)
    np.savetxt("whole.csv", np.column_stack([M, Q]), delimiter=",")
    np.save("M.npy", M)
    np.savez("whole.npz", M=M, q=Q)
    io.savemat("whole.mat", {"M": M, "q": Q})
    io.mmwrite("q.mtx", Q[:, np.newaxis])
    texts = {
        "whole.json": '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}',
        "digits.json": '{"M": [[0.12345678901234567891]], "q": [-1]}',
        "game.json": '{"A": [[3, 0.1], [0, 2]], "B": [[2, 0], [0, 3]]}',
        "lower.csv": "-1,none\n",
        "tree.efg": EFG,
        "A.csv": "1,0\n0,1\n1,1\n",
        "b.csv": "1\n2\n4\n",
        "program.mps": MPS,
        "three.jsonl": 3 * '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}\n',
    }
    for name, text in texts.items():
        Path(name).write_text(text)
    Path("linear.nl").write_bytes(model(1, [LINEAR], [(2, 0)]))
    Path("curved.nl").write_bytes(model(1, [CURVED], [(2, 0)]))
    program = model(1, [((2, 1), {0: 1}, 0)], [(2, 0)], objective="v0")
    Path("program.nl").write_bytes(program)
    return in_folder


@pytest.fixture
def counted(monkeypatch):
    """How often a file of each kind has been parsed, and files have been opened."""
    counts = Counter[str]()

    def count(name, place):
        module, _, function = place.rpartition(".")
        path = f"lcpcli.{module}"
        real = getattr(import_module(path), function)

        def counting(*given, **named):
            counts[name] += 1
            return real(*given, **named)

        monkeypatch.setattr(f"{path}.{function}", counting)

    for name, place in PARSERS.items():
        count(name, place)
    opened = contents.open_file

    def opening(path):
        counts["opened"] += 1
        return opened(path)

    monkeypatch.setattr("lcpcli.files.contents.open_file", opening)
    return counts


COMMANDS = {
    "solve whole.csv": {"csv": 1},
    "solve M.csv q.csv": {"csv": 2},
    "solve --game M.csv M.csv": {"csv": 2, "json": 1, "opened": 2},
    "solve whole.json": {"json": 1},
    "solve three.jsonl": {"json": 3, "opened": 1},
    "solve tree.efg": {"efg": 1},
    "solve --lsq A.csv b.csv": {"csv": 2, "json": 1, "opened": 2},
    "solve whole.npz": {"npz": 1},
    "solve whole.mat": {"mat": 1},
    "solve program.mps": {"mps": 1},
    "solve program.nl": {"nl": 1},
    "check linear.nl 2": {"nl": 1, "csv": 1, "opened": 1},
    "solve M.npy q.mtx": {"npy": 1, "mtx": 1},
    "why M.csv q.csv": {"csv": 4, "opened": 2},
    "convert M.csv q.csv -o whole.mtx": {"csv": 2},
    "solve whole.json --lower lower.csv": {"json": 1, "csv": 1},
    # and where the decimals are asked for
    "solve M.csv q.csv --exact": {"csv": 4, "opened": 2},
    "solve whole.json --exact": {"json": 2, "opened": 1},
    "convert digits.json -o digits.csv": {"json": 1},
    "solve program.mps --exact": {"mps": 2, "opened": 1},
}


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("command", COMMANDS)
def test_each_file_is_opened_and_parsed_once(command, lcp, counted):
    expected = COMMANDS[command]
    outcome = lcp(command)
    assert outcome.code in (0, 1), outcome.err
    assert counted == {"opened": expected.get("opened", sum(expected.values()))} | (
        expected
    )


@pytest.mark.usefixtures("folder")
def test_the_library_parses_each_file_once(counted):
    read("M.csv", "q.csv")
    read("game.json")
    read_nl("curved.nl")
    assert counted == {"csv": 2, "json": 1, "nl": 1, "opened": 4}
