"""What a dictionary remembers of its polyhedron while that becomes smaller."""

from __future__ import annotations

from lcpcli.rational.dictionary import Dictionary


def nothing() -> None:
    """Check nothing."""


def test_a_form_that_was_positive_somewhere_may_vanish_on_a_smaller_polyhedron() -> None:
    """Form 2 is y_0, form 3 is -y_0, in the quadrant of y_0 and y_1."""
    for smaller in ("vanish", "require"):
        here = Dictionary({2: [0, 1, 0], 3: [0, -1, 0]}, [0, 1], range(3), nothing)
        assert here.can_have_sign(2, 1)
        assert not here.is_zero(2)
        assert here.vanish(0) if smaller == "vanish" else here.require(3)
        assert here.is_zero(2)
        assert not here.is_zero(1)
