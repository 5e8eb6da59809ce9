"""Grids: the runs of one method that differ by two options, as their labels say, such as shi:p=100,k-star=5."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

FEWEST_RUNS = 3  # of a grid: two runs that differ by two options are easier to tell apart by their labels


@dataclass(frozen=True)
class Grid:
    """The runs of one method, in rows by one option and in columns by another.

    options : the names of the two options. values : the values of each, in the order in which they appear.
    places : the row and the column of each run, by its label; a grid need not be full.
    """

    options: tuple[str, str]
    values: tuple[list[str], list[str]]
    places: dict[str, tuple[int, int]]


def grids(entries: Iterable[tuple[str, str]]) -> dict[str, Grid]:
    """Return the grid of each name whose runs make one. entries : names and labels."""
    labels: dict[str, list[str]] = {}
    for name, label in dict.fromkeys(entries):
        labels.setdefault(name, []).append(label)
    made = {name: grid_of(own) for name, own in labels.items()}
    return {name: grid for name, grid in made.items() if grid is not None}


def grid_of(labels: Sequence[str]) -> Grid | None:
    """Return the grid of runs of one method with these labels; None if these do not all set the same two options, or
    if one of the options has the same value in all."""
    settings = [_settings(label) for label in labels]
    names = {tuple(own) for own in settings}
    if len(labels) < FEWEST_RUNS or len(names) > 1 or len(settings[0]) != 2:
        return None
    first, second = settings[0]
    values = [list(dict.fromkeys(own[name] for own in settings)) for name in (first, second)]
    if min(map(len, values)) < 2:
        return None
    places = [(values[0].index(own[first]), values[1].index(own[second])) for own in settings]
    return Grid((first, second), (values[0], values[1]), dict(zip(labels, places, strict=True)))


def _settings(label: str) -> dict[str, str]:
    """Return the values of the options that a label sets, by name; an addition such as scale may stand alone."""
    parts = label.partition(":")[2].split(",")
    pairs = [part.partition("=")[::2] for part in parts if part]
    return {name: value or "true" for name, value in pairs}
