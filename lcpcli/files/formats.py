"""The formats of problem files, by their suffixes. numpy is not loaded, so that shell completion is instant."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Protocol, cast

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from fractions import Fraction

    from lcpcli.model.problem import Problem
    from lcpcli.rational.problem import ExactParts
    from lcpcli.typing import Matrix, Vector

    Number = Callable[[str], float]  # what makes a double of a number in a text
    Exact = Mapping[float, Fraction]  # what doubles stand for, where that is not their shortest decimals

FORMATS = {  # the module that reads and writes it
    ".json": "json",
    ".csv": "csv",
    ".mtx": "matrix_market",
    ".npz": "npz",
    ".npy": "npy",
    ".mat": "mat",
}
READ_ONLY = {".mps": "mps", ".qps": "mps", ".lp": "mps", ".nfg": "nfg"}  # of programs, and of games
OF_PROGRAMS = (".mps", ".qps")  # those of them that are written too, with programs
COMPLETE = (".json", ".npz", ".mat")  # those that keep all that a problem holds, and not only M and q
WITH_BOUNDS = (*COMPLETE, ".csv")  # those that keep the bounds of z
COMPRESSED = tuple(f"{ending}.gz" for ending in (".mtx", *READ_ONLY))  # read as if it were not
PROBLEMS = (*FORMATS, *READ_ONLY, *COMPRESSED)  # all suffixes of files with one problem
TEXTS = (".json", ".csv", ".mtx", *OF_PROGRAMS)  # those that are written in decimals, with any number of digits
WRITTEN = f"{', '.join(FORMATS)}, or {' or '.join(OF_PROGRAMS)} for a program"
TEXT_FORMS = {(FORMATS | READ_ONLY)[ending] for ending in TEXTS}
LINES = (".jsonl", ".ndjson")  # one problem, or one result, in each line


NEAREST: Exact = {}  # every double stands for itself


class Format(Protocol):
    """Interface of a format's module. Errors do not name the file; the caller adds that.

    Those of TEXTS have one parameter more: `parse` and `parse_vector` what makes doubles of their numbers, in place of
    float, and `render` what these doubles stand for.
    """

    def parse(self, content: bytes, /) -> Problem | Matrix:
        """The problem, or M alone if the file has no q."""

    def parse_vector(self, field: str, content: bytes, n: int | None = None, /) -> Vector:
        """A vector of length n, any length if None."""

    def parse_exact(self, content: bytes, /) -> ExactParts:
        """What the file holds with all decimals, from content that `parse` has accepted."""

    def parse_exact_vector(self, field: str, content: bytes, /) -> list[Fraction]:
        """The same for content that `parse_vector` has accepted."""

    def render(self, problem: Problem, /) -> dict[str, bytes]:
        """The files to write: the file itself under "", others beside it under the part inserted before its suffix."""


def load(name: str) -> Format:
    """The module of a format."""
    return cast(Format, import_module(f"lcpcli.files.{name}_format"))
