"""Basic solutions: block principal pivoting, the elimination of free variables, the
tableau of Lemke's method, the dual simplex method.

It uses `linalg` and `model`.
"""
