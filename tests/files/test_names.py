"""The unknowns of a problem may have names, which files keep and tables show. Rows and
columns of CSV that are labelled by these in another order are refused; a model may have
its q elsewhere."""

import numpy as np
import pytest
from scipy.io import savemat

from lcpcli import Problem, from_qp, read
from lcpcli.errors import ProblemError

from ..conftest import save_json
from ..wordings import NO_SUCH_FILE

NAMES = ["a", "b", "c"]
M = {"M": [[4, -1, 0], [-1, 4, -1], [0, -1, 4]], "names": NAMES}
NAMED = {
    "name": "market",
    "M": [[2, 1], [1, 2]],
    "q": [-5, -6],
    "names": ["north sea", "süd"],
}


@pytest.fixture(autouse=True)
def folder(in_folder):
    save_json(in_folder / "p.json", M | {"q": [-1, 2, -3]})
    return in_folder


def test_a_link_to_nothing_is_a_file_that_is_missing(lcp, folder):
    (folder / "nightly").mkdir()
    (folder / "nightly" / "a.json").symlink_to(folder / "gone.json")
    (folder / "nightly" / "p.json").write_text((folder / "p.json").read_text())
    assert f"nightly/a.json: {NO_SUCH_FILE}; " in lcp("solve", "nightly").err


def test_a_workspace_may_have_other_names_and_a_program_has_its_own():
    savemat("w.mat", {"M": NAMED["M"], "q": NAMED["q"], "names": [1.0, 2.0, 3.0]})
    assert list(read("w.mat").names) == ["", ""]
    program = from_qp(None, [1], columns=["x"])
    with pytest.raises(ProblemError, match="names: cannot be combined with origin"):
        Problem(program.M, program.q, origin=program.origin, names=["z"])


@pytest.mark.parametrize("ending", ["npz", "mat"])
def test_several_q_belong_to_a_file_of_M_with_bounds_and_names(ending, lcp, folder):
    whole = read("p.json")
    given = {"M": whole.M, "names": np.array(NAMES, dtype=object), "upper": [9, 9, 0.5]}
    if ending == "npz":
        np.savez(folder / "alone.npz", **given | {"names": NAMES})
    else:
        savemat(folder / "alone.mat", given)
    (folder / "qs.csv").write_text(",base,tax\na,-1,1\nb,2,2\nc,-3,-3\n")
    records = lcp(f"solve alone.{ending} qs.csv --exact --format json").records
    assert [record["exact"]["z"] for record in records] == [
        ["1/4", "0", "1/2"],
        ["0", "0", "1/2"],
    ]
    assert [record["problem"] for record in records] == ["base", "tax"]
    assert [record["names"] for record in records] == [NAMES, NAMES]
