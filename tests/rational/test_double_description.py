"""Extreme rays by the double description method against those by pivoting."""

import numpy as np
import pytest
from numpy.random import default_rng

from lcpcli.interrupts import raise_if_timed_out
from lcpcli.rational.dictionary import Dictionary, generators
from lcpcli.rational.double_description import extreme_rays
from lcpcli.rational.numbers import primitive

ANY = np.zeros((1, 20), dtype=np.float32)


def pivoted(forms):
    """Return the extreme rays as the unbounded edges of the cone at its only vertex."""
    d = len(forms[0])
    rows = {d + i: [0, *form] for i, form in enumerate(forms)}
    dictionary = Dictionary(
        rows, list(range(d)), range(d + len(forms)), raise_if_timed_out
    )
    listed = generators(dictionary, range(d))
    return set(listed[1])


@pytest.mark.parametrize(("largest", "unit"), [(1, 1), (9, 1), (9, 10**30 + 57)])
def test_rays_are_those_that_pivoting_finds_and_a_partner_allows(largest, unit):
    random = default_rng(4)
    degenerate = dropped = 0
    for _ in range(20):
        shape = (random.integers(1, 9), random.integers(1, 6))
        whole, small = random.integers(-largest, largest + 1, (2, *shape)).tolist()
        forms = [
            [a * unit + b * (unit > 1) for a, b in zip(*rows, strict=True)]
            for rows in zip(whole, small, strict=True)
        ]
        rays = extreme_rays(forms, ANY, 1000, raise_if_timed_out)
        assert len(set(map(tuple, rays.values))) == len(rays.values)
        assert set(map(tuple, rays.values)) == pivoted(forms)
        for ray, positive in zip(rays.values, rays.positive, strict=True):
            assert ray == primitive(ray)
            forms_at_ray = [
                sum(a * b for a, b in zip(form, ray, strict=True)) for form in forms
            ]
            assert min(forms_at_ray) >= 0
            values = [*ray, *forms_at_ray]
            assert positive.tolist() == [value > 0 for value in values]
            degenerate += values.count(0) >= len(ray)
        partners = (random.random((2, sum(shape))) < 0.3).astype(np.float32)
        part = extreme_rays(forms, partners, 1000, raise_if_timed_out)
        is_allowed = (rays.positive @ partners.T == 0).any(axis=1)
        allowed = [rays.values[i] for i in np.flatnonzero(is_allowed)]
        assert sorted(map(tuple, part.values)) == sorted(map(tuple, allowed))
        dropped += not is_allowed.all()
    assert (degenerate > 0) == (unit == 1)
    assert dropped > 2


def test_enumeration_ends_beyond_a_number_of_rays():
    """The cone over a cube has eight rays."""
    cube = [[-int(i == j) for j in range(3)] + [1] for i in range(3)]
    rays = extreme_rays(cube, ANY, 8, raise_if_timed_out)
    assert len(rays.values) == 8
    assert extreme_rays(cube, ANY, 7, raise_if_timed_out) is None
