"""A fit in two CSV files: A, whose columns may have names, and b."""

from __future__ import annotations

import json
from collections.abc import Sequence

from lcpcli.errors import MAKE_AGREE, ParameterError, ProblemError, count
from lcpcli.files.input_file import InputFile
from lcpcli.files.inputs import Input
from lcpcli.formulations.tables import listed, names_in, table_in

HINT = "give the model A, a column for each coefficient, and the measurements b"


def input_of(paths: Sequence[str]) -> Input:
    """Return the fit as an input in JSON, with the numbers exactly as they are written.
    A header of A names the coefficients; b may be a column or a row.
    """
    if len(paths) != 2:
        raise ParameterError("lsq", f"takes two files, not {len(paths)}", HINT)
    A, names = _table(InputFile.read(paths[0], HINT))
    file = InputFile.read(paths[1], HINT)
    b, _ = _table(file)
    values = [row[0] for row in b] if len(b[0]) == 1 else b[0]
    if len(values) * max(len(values), 1) != len(values) * sum(map(len, b)):
        reason = f"has {count(len(b), 'row')} and {count(len(b[0]), 'column')}"
        raise ProblemError(file.source_name, reason, "give a single column, b")
    if len(values) != len(A):
        reason = f"has {count(len(values), 'number')} for {count(len(A), 'row')} of A"
        raise ProblemError(file.source_name, reason, MAKE_AGREE)
    rows = ", ".join(map(listed, A))
    parts = [f'"lsq": true, "A": [{rows}], "b": {listed(values)}']
    if names:
        parts.append(f'"columns": {json.dumps(names)}')
    text = f"{{{', '.join(parts)}}}"
    return Input((InputFile(paths[0], text.encode()),))


def _table(file: InputFile) -> tuple[list[list[str]], list[str]]:
    """Return the numbers of a CSV file, as written, and the names of its columns."""
    table = table_in(file, HINT, "write the fit as JSON, with the keys A, b and lsq")
    return table.rows, names_in(table.header)
