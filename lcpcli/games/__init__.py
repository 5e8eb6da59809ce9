"""Games of two players as problems, and what strategies gain in them. It uses `linalg`
and `model`."""
