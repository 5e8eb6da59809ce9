"""MAT files with any byte changed are read or refused: scipy's compiled reader sees only what was checked."""

from __future__ import annotations

import io
import random
import struct
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.sparse import csc_array

from lcpcli.errors import ProblemError
from lcpcli.files import mat_format
from lcpcli.files.mat_elements import checked

M, q = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])
NAMES = np.array(["first", "é"], dtype=object)


def mat(**options: Any) -> bytes:
    file = io.BytesIO()
    sparse = options.pop("sparse", False)
    others = {"names": NAMES, "other": {"a": 1.0}, "cell": np.array([[M, "t"]], object)}
    more = {} if options.get("format") == "4" else others
    savemat(file, {"M": csc_array(M) if sparse else M, "q": q, "name": "small", **more}, **options)
    return file.getvalue()


KINDS = [{}, {"sparse": True}, {"do_compression": True}, {"format": "4"}, {"format": "4", "sparse": True}]


def outcome(content: bytes) -> str:
    try:
        mat_format.fields(content)
    except ProblemError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("options", KINDS)
def test_whole_files_are_read(options: dict[str, Any]) -> None:
    fields = mat_format.fields(mat(**options))
    assert np.array_equal(fields["M"].toarray() if options.get("sparse") else fields["M"], M)
    assert np.array_equal(fields["q"], q)
    if "format" not in options:
        assert list(fields["names"]) == ["first", "é"]


@pytest.mark.parametrize("options", KINDS)
def test_any_changed_byte_leaves_a_file_that_is_read_or_refused(options: dict[str, Any]) -> None:
    content, source = mat(**options), random.Random(0)
    refused = 0
    for at in range(len(content)):
        for value in (255 * (at % 2), source.randrange(256)):
            refused += bool(outcome(content[:at] + bytes([value]) + content[at + 1 :]))
    assert refused > len(content) / 6


@pytest.mark.parametrize("size", [2**31 - 1, 2**32 - 1, 2**30])
def test_dimensions_that_are_not_those_of_the_values_are_refused(size: int) -> None:
    content = mat()
    at = content.index(struct.pack("<II", 5, 8)) + 8  # the dimensions of the first array
    for place in (at, at + 4):
        damaged = content[:place] + struct.pack("<I", size) + content[place + 4 :]
        assert "other values than it declares" in outcome(damaged) or "dimensions" in outcome(damaged)


def test_what_cannot_be_read_is_left_out() -> None:
    assert {name for name in loadmat(io.BytesIO(checked(mat()))) if name[0] != "_"} == {
        "M", "q", "name", "names", "cell",
    }  # fmt: skip
