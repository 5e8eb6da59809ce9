"""The seeds of random problems: a few in every run of the tests, the others in slow
ones."""

import pytest


def few_of(seeds, number):
    """Return the parameters of a test, of which all but a number are marked slow; a
    tuple is the values of several."""
    every = [seed if isinstance(seed, tuple) else (seed,) for seed in seeds]
    further = pytest.mark.slow("further seeds")
    return [
        pytest.param(*seed, marks=further if i >= number else ())
        for i, seed in enumerate(every)
    ]


def parts(number, end):
    """Return ranges of seeds as parameters: the first ones, and the slow others."""
    return few_of((range(number), range(number, end)), 1)
