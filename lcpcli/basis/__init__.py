"""Solutions with given states: systems, exchanges, the tableau of Lemke's method, the
dual simplex method.

It uses `linalg` and `model`.
"""
