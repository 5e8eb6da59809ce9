"""The formats of problem files, by their suffixes. No numpy is loaded, so that completing a word is instant."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Protocol, cast

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.model.problem import Problem
    from lcpcli.rational.problem import Rows
    from lcpcli.typing import Matrix, Vector

FORMATS = {".json": "json", ".csv": "csv", ".mtx": "matrix_market", ".npz": "npz"}  # the module that reads it
COMPRESSED = ".mtx.gz"  # read as .mtx


class Format(Protocol):
    """What the module of a format offers. Errors leave the file to be named by the caller."""

    def parse(self, content: bytes, /) -> Problem | Matrix:
        """The problem, or M alone where the file holds no q."""

    def parse_vector(self, field: str, content: bytes, n: int | None = None, /) -> Vector:
        """A vector of length n, any length if None."""

    def parse_exact(self, content: bytes, /) -> tuple[Rows, list[Fraction] | None]:
        """M and, where the file holds it, q with all decimals, from a content that `parse` has accepted."""

    def parse_exact_vector(self, field: str, content: bytes, /) -> list[Fraction]:
        """The same of a content that `parse_vector` has accepted."""

    def render(self, problem: Problem, /) -> dict[str, bytes]:
        """What to write: the file itself under "", files beside it under what parts their names from its ending."""


def load(name: str) -> Format:
    """The module of a format."""
    return cast(Format, import_module(f"lcpcli.files.{name}_format"))
