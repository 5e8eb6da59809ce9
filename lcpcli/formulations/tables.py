"""Tables of CSV from which formulations make the text of a problem in JSON, with the
numbers exactly as they are written."""

from __future__ import annotations

import json
from collections.abc import Sequence
from decimal import Decimal

from lcpcli.files.csv_format import Table, is_number
from lcpcli.files.formats import refuse
from lcpcli.files.input_file import InputFile


def table_in(file: InputFile, expected: str, as_json: str) -> Table:
    """Return the table in a file, whose header, if it has one, names no fields of a
    problem. expected, as_json : hints, for another header and for another format."""
    refuse(not file.kind.is_table, file.source_name, "is not a table in CSV", as_json)
    table: Table = file.within(file.data.table, str)
    reason = f"has columns headed {', '.join(table.column_of)}"
    refuse(table.column_of, file.source_name, reason, expected)
    return table


def names_in(texts: list[str]) -> list[str]:
    """Return the texts if all are names; else an empty list."""
    return texts if all(text and not is_number(text) for text in texts) else []


def listed(values: Sequence[str]) -> str:
    """Return numbers as a list in JSON, in which fractions are strings."""
    texts = (
        json.dumps(value) if "/" in value else str(Decimal(value)) for value in values
    )
    return f"[{', '.join(texts)}]"
