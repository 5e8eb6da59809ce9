"""What is said of a problem is said of its mirror image, in which -z and -w take the place of z and w."""

from __future__ import annotations

import pytest

import lcpcli


@pytest.mark.parametrize("q", [[-10, -3], [-10, -1], [-1, -3], [0, -1]])
def test_digits_are_those_of_the_mirror_image(q: list[float]) -> None:
    M = [[2, 0.5], [0.5, 2]]
    own = lcpcli.solve(M, q, upper=1)
    image = lcpcli.solve(M, [-value for value in q], lower=-1, upper=0)
    assert image.z.tolist() == (0 - own.z).tolist()
    assert own.digits == image.digits
    assert own.digits is not None
