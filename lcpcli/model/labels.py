"""Data frames and series, put into a common order by their labels. pandas is not imported."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError

UNLABELLED = "give them the same labels, or arrays, as by to_numpy()"


def by_label(table: Any, /, of: str = "the columns of M", axis: str = "index", **fields: Any) -> list[Any]:
    """Return the values of fields with their rows, or columns, in the order of the columns, or the rows, of a table, if
    both have labels; else return the values unchanged."""
    labels = list(table.index if of.startswith("the rows") else table.columns) if _is_table(table) else []
    return [_in_order(field, values, labels, of, axis) for field, values in fields.items()]


def by_names(names: Callable[[], Sequence[str]], **fields: Any) -> list[Any]:
    """Return the values of fields with their entries in the order of the names of the unknowns, if both have labels;
    else return the values unchanged. names : returns the names, and is called only if a value has labels."""
    labels = list(names()) if any(map(_has_index, fields.values())) else []
    labels = labels if all(labels) else []
    return [_in_order(field, values, labels, "the names of the unknowns") for field, values in fields.items()]


def payoffs_by_label(A: Any, B: Any) -> Any:
    """Return B with its strategies in the order of those of A, where both have labels."""
    if not (_is_table(A) and _is_table(B)):
        return B
    columns = _places("B", list(B.columns), list(A.columns), "the columns of A")
    rows = _in_order("B", B, list(A.index), "the rows of A")
    return rows if columns is None else (rows.to_numpy() if rows is B else rows)[:, columns]


def texts(labels: Any) -> tuple[str, ...]:
    """Return the labels if all of them are texts and all are different; else an empty tuple."""
    own = list(labels)
    return tuple(own) if all(isinstance(label, str) for label in own) and len(set(own)) == len(own) else ()


def _in_order(field: str, values: Any, labels: list[Any], of: str, axis: str = "index") -> Any:
    """Return values with rows, or columns, in the order of these labels, if there are any, as `_places` finds it."""
    has_axis = bool(labels) and _has_index(values) and hasattr(values, axis)
    places = _places(field, list(getattr(values, axis)), labels, of) if has_axis else None
    return values if places is None else np.take(values.to_numpy(), places, axis=("index", "columns").index(axis))


def _places(field: str, own: list[Any], labels: list[Any], of: str) -> list[int] | None:
    """Return the places of labels among a field's own labels if these are the same in another order; None, so that
    positions count, if the order is the same or one of the two only counts from 0; else raise ProblemError."""
    if own == labels:
        return None
    if len(own) == len(labels) == len(set(own)) and set(own) == set(labels):
        places = {label: i for i, label in enumerate(own)}
        return [places[label] for label in labels]
    counted = list(range(len(own)))
    if len(own) != len(labels) or counted in (own, labels):
        return None
    raise ProblemError(field, f"has an index with labels other than {of}", UNLABELLED)


def _has_index(values: Any) -> bool:
    return hasattr(values, "to_numpy") and hasattr(values, "index")


def _is_table(values: Any) -> bool:
    return hasattr(values, "columns") and _has_index(values)
