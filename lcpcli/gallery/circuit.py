"""Electrical networks with ideal diodes: V. Acary, O. Bonnefon, B. Brogliato, Nonsmooth Modeling and Simulation for
Switched Circuits, Springer (2011). The network of bridge rectifiers, and its values, are original to lcp.
"""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "positive semidefinite"
SOURCE = "Acary, Bonnefon and Brogliato 2011, nodal analysis with ideal diodes"
NODES, DIODES = 4, ((0, 2), (1, 2), (3, 0), (3, 1))  # of a bridge: two poles of its source, then plus and minus
INNER, LOAD, LEAK, COUPLING = 1.0, 0.25, 0.0625, 0.5  # conductances


def circuit(n: int, _seed: int) -> Problem:
    """A row of k = n / 8 bridge rectifiers, rounded: 4 k free potentials v, then 4 k diode currents i >= 0.

    Kirchhoff's law G v + D i = s at each node is an equation; the voltage -D'v that a diode blocks is not negative, and
    0 where it conducts: M = [G D; -D' 0], q = (-s, 0). Each bridge has a current source with an inner conductance, a
    load, and leaks to the ground; its plus is connected to the next one's.
    """
    from scipy.sparse import coo_array, csr_array

    k = max(1, round(n / 8))
    nodes = NODES * np.arange(k)
    first = np.concatenate((nodes, nodes + 2, nodes[:-1] + 2))
    second = np.concatenate((nodes + 1, nodes + 3, nodes[1:] + 2))
    conductances = np.concatenate((np.full(k, INNER), np.full(k, LOAD), np.full(k - 1, COUPLING)))
    anodes, cathodes = (np.concatenate([nodes + pair[end] for pair in DIODES]) for end in (0, 1))
    ground, diode = np.arange(NODES * k), NODES * k + np.arange(NODES * k)
    one = np.ones(NODES * k)
    parts = [
        (ground, ground, LEAK * one),
        (first, first, conductances),
        (second, second, conductances),
        (first, second, -conductances),
        (second, first, -conductances),
        (anodes, diode, one),
        (cathodes, diode, -one),
        (diode, anodes, -one),
        (diode, cathodes, one),
    ]
    rows, columns, values = (np.concatenate(each) for each in zip(*parts, strict=True))
    M = csr_array(coo_array((values, (rows, columns)), shape=(2 * NODES * k,) * 2))
    source = (7 * np.arange(k) % 11) - 5.5
    q = np.zeros(2 * NODES * k)
    q[nodes], q[nodes + 1] = -source, source
    lower = np.where(np.arange(q.size) < NODES * k, -np.inf, 0.0)
    note = f"{k} bridges: potentials of {NODES * k} nodes, then currents of {NODES * k} diodes."
    return Problem(M, q, name=f"circuit-{q.size}", source=SOURCE, note=note, lower=lower)
