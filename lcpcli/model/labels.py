"""Tables and series with labels, as of pandas, put into one order by their labels. pandas is not imported."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lcpcli.errors import ProblemError

Labels = list[Any]
UNLABELLED = "give them the same labels, or arrays, as by to_numpy()"


def by_label(M: Any, /, **fields: Any) -> list[Any]:
    """The values of fields with their rows in the order of the columns of M, if these have labels; else as they are."""
    if not (hasattr(M, "columns") and _has_index(M)):
        return list(fields.values())
    return [_in_order(field, values, list(M.columns)) for field, values in fields.items()]


def _in_order(field: str, values: Any, labels: Labels) -> Any:
    """Values with rows in the order of these labels if they have the same; by position if they have others and one of
    the two only counts from 0; else a ProblemError."""
    if not _has_index(values):
        return values
    own = list(values.index)
    if own == labels:
        return values
    if len(own) == len(labels) == len(set(own)) and set(own) == set(labels):
        places = {label: i for i, label in enumerate(own)}
        return values.to_numpy()[[places[label] for label in labels]]
    if len(own) != len(labels) or _only_count(own) or _only_count(labels):
        return values
    raise ProblemError(field, "has an index with other labels than the columns of M", UNLABELLED)


def _has_index(values: Any) -> bool:
    return hasattr(values, "to_numpy") and hasattr(values, "index")


def _only_count(labels: Sequence[Any]) -> bool:
    return list(labels) == list(range(len(labels)))
