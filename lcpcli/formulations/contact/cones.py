"""Contact with Coulomb friction as M and q, in two forms.

A tangential force or impulse x_i lies between -mu x_f and mu x_f, where x_f is the
normal one of its contact; w = A x + b are velocities. Coulomb's law requires w_i >= 0
at the lower bound, w_i <= 0 at the upper one, and w_i = 0 between them.

The compact form has two unknowns for each tangential one, beta and lambda, with x_i =
beta - mu x_f:

    beta >= 0,    w_i + lambda >= 0,     their product 0,
    lambda >= 0,  2 mu x_f - beta >= 0,  their product 0.

Its solutions are those of the problem itself, but its matrix need not be copositive: A
= [1 1.2; 1.2 2] and mu = 1 have the diagonal entry 1 - 1.2.

The form of D. E. Stewart, J. C. Trinkle, Int. J. Numer. Methods Eng. 39 (1996)
2673-2691, has a beta >= 0 for each of several directions d in the tangent line or
plane, whose combination is the tangential impulse, and lambda complementary to mu x_f -
sum beta. Its matrix is copositive if A is positive semidefinite. In a plane these
directions are the vertices of a regular polygon inside the friction circle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.formulation import Conditions
from lcpcli.rational.exact_problem import bounds_of, rows_of
from lcpcli.typing import Indices, Matrix, Vector

ONE = Fraction(1)


class Friction(NamedTuple):
    """The friction of k pairs of a normal and a tangential unknown, or of triples with
    two tangential ones.

    normals, coefficients : shape (k,), the indices of the normal unknowns, and mu.
    tangents : shape (k, 1) or (k, 2), the indices of the tangential ones.
    """

    normals: Indices
    tangents: Indices
    coefficients: Vector


class Form(NamedTuple):
    """A problem in z with x = T z.

    conditions : M, q and the bounds of z. T : shape (n, number of unknowns in z); None
    in the compact form. P : shape (k, n) in that form, where x = z - P z for the
    tangential unknowns and x = z for the others; else None.
    """

    conditions: Conditions
    T: Any
    P: Any = None


def compact(
    A: Matrix,
    b: Vector,
    lower: Vector,
    upper: Vector,
    friction: Friction,
    before: Form | None = None,
) -> Form:
    """Return the compact form, z = (x with beta instead of the tangential unknowns,
    lambda).

    friction : with one tangential unknown each. before : that of contacts with dense A
    which differ in A and b alone.
    """
    n, k = b.size, friction.normals.size
    tangents, mu = friction.tangents[:, 0], friction.coefficients
    if before is not None:
        M = before.conditions.M.copy()
        np.subtract(A, A[:, tangents] @ before.P, out=M[:n, :n])
        q = np.concatenate((b, before.conditions.q[n:]))
        for array in (M, q):
            array.setflags(write=False)
        return before._replace(conditions=before.conditions._replace(M=M, q=q))
    rows, normals = np.arange(k), friction.normals
    P = _matrix(A, (k, n), (rows, normals, mu))
    from_normals = A[:, tangents] @ P
    low, high = lower.copy(), upper.copy()
    low[tangents], high[tangents] = 0.0, math.inf
    if not is_sparse(A):
        M = np.zeros((n + k, n + k))
        np.subtract(A, from_normals, out=M[:n, :n])
        M[tangents, n + rows], M[n + rows, tangents] = 1.0, -1.0
        M[n + rows, normals] = 2 * mu
        return _with_slips(M, b, (low, high), None)._replace(P=P)
    first = _matrix(A, (n, n + k), (np.arange(n), np.arange(n)))
    C = _matrix(A, (k, n + k), (rows, tangents), (rows, normals, 2 * mu), values=-1.0)
    E = _matrix(A, (n, n + k), (tangents, n + rows))
    return _form((A - from_normals) @ first + E, b, C, (low, high), None)


def stewart_trinkle(
    A: Matrix,
    b: Vector,
    lower: Vector,
    upper: Vector,
    friction: Friction,
    directions: Vector,
) -> Form:
    """Return the form of Stewart and Trinkle, z = (the unknowns that are not
    tangential, beta by pairs and directions, lambda).

    directions : shape (m, 1) or (m, 2), of length 1.
    """
    n = b.size
    k = friction.normals.size
    m = len(directions)
    is_other = np.ones(n, dtype=np.bool_)
    is_other[friction.tangents] = False
    others = np.flatnonzero(is_other)
    first, last = others.size, others.size + k * m
    size = last + k
    betas = np.arange(first, last).reshape(k, m)
    parts = [
        (np.repeat(tangent, m), betas.ravel(), np.tile(along, k))
        for tangent, along in zip(friction.tangents.T, directions.T, strict=True)
    ]
    T = _matrix(A, (n, size), (others, np.arange(first)), *parts)
    rows, positions = np.arange(k), np.empty(n, dtype=np.intp)
    positions[others] = np.arange(first)
    of_betas = np.repeat(rows, m), betas.ravel(), np.full(k * m, -1.0)
    of_normals = rows, positions[friction.normals], friction.coefficients
    C = _matrix(A, (k, size), of_betas, of_normals)
    E = _matrix(A, (last, size), (betas.ravel(), last + np.repeat(rows, m)))
    S = T[:, :last].T
    free = np.full(k * m, math.inf)
    low = np.concatenate((lower[others], np.zeros(k * m)))
    high = np.concatenate((upper[others], free))
    return _form(S @ (A @ T) + E, S @ b, C, (low, high), T)


def polygon(facets: int) -> Vector:
    """Return the vertices of a regular polygon in the unit circle, shape (facets, 2),
    each with its exact opposite; for 2 facets the endpoints of a segment, shape (2, 1).
    """
    if facets == 2:
        return np.array([[1.0], [-1.0]])
    angles = 2 * np.pi * np.arange(facets // 2) / facets
    half = np.column_stack((np.cos(angles), np.sin(angles)))
    half[abs(half) < 1e-15] = 0.0  # for example the cosine of a right angle
    return np.concatenate((half, -half))


def exact_compact(
    A: Matrix,
    b: list[Fraction],
    bounds: tuple[Vector, Vector],
    friction: Friction,
    number: Callable[[float], Fraction],
) -> tuple[Any, ...]:
    """Return the compact form in exact numbers: the rows of M, q and the bounds, as
    fractions. number : returns the exact number of a float.
    """
    n, normals = len(b), friction.normals.tolist()
    tangents = friction.tangents[:, 0].tolist()
    mus = [number(mu) for mu in friction.coefficients.tolist()]
    rows = rows_of(A, number)
    for row in rows:
        for f, t, mu in zip(normals, tangents, mus, strict=True):
            if entry := row.get(t):
                row[f] = row.get(f, Fraction(0)) - mu * entry
    for k, (f, t, mu) in enumerate(zip(normals, tangents, mus, strict=True)):
        rows[t][n + k] = ONE
        rows.append({f: 2 * mu, t: -ONE})
    q = [*b, *[Fraction(0)] * len(mus)]
    low, high = (bounds_of(bound, number) for bound in bounds)
    for t in tangents:
        low[t], high[t] = Fraction(0), None
    low += [Fraction(0)] * len(mus)
    high += [None] * len(mus)
    return rows, q, low, high


def _form(
    upper_rows: Matrix,
    b: Vector,
    C: Matrix,
    bounds: tuple[Vector, Vector],
    T: Matrix | None,
) -> Form:
    """Return the problem whose last rows are C z >= 0, complementary to lambda."""
    if is_sparse(C):
        with imports:
            from scipy.sparse import vstack
        M: Matrix = vstack((upper_rows, C)).tocsr()
    else:
        M = np.concatenate((upper_rows, C))
    return _with_slips(M, b, bounds, T)


def _with_slips(M: Matrix, b: Vector, bounds: tuple[Vector, Vector], T: Any) -> Form:
    """Return the problem of an M whose last unknowns are lambda >= 0, where q is 0."""
    k = M.shape[0] - b.size
    q = np.concatenate((b, np.zeros(k)))
    low = np.concatenate((bounds[0], np.zeros(k)))
    high = np.concatenate((bounds[1], np.full(k, math.inf)))
    return Form(Conditions(M, q, low, high), T)


def _matrix(
    like: Matrix, shape: tuple[int, int], *parts: tuple[Any, ...], values: float = 1.0
) -> Matrix:
    """Return a matrix, dense or sparse as `like`, with entries at these rows and
    columns.

    parts : rows, columns and values; if there are no values, they are `values`.
    """
    if not is_sparse(like):
        M = np.zeros(shape)
        for rows, columns, *block_values in parts:
            M[rows, columns] = block_values[0] if block_values else values
        return M
    with imports:
        from scipy.sparse import csr_array
    rows = np.concatenate([part[0] for part in parts])
    columns = np.concatenate([part[1] for part in parts])
    entries = np.concatenate(
        [part[2] if part[2:] else np.full(len(part[0]), values) for part in parts]
    )
    return csr_array((entries, (rows, columns)), shape=shape)
