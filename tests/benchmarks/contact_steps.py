"""Steps of contact with friction, moving and at rest, by W and by friction indices, and
by QuantEcon on the M of Stewart and Trinkle: contact_steps.py [steps]

Microseconds of the processor for a step in the median, from W and q in memory to
impulses, and the largest violation of the laws of contact relative to the terms of its
row; so many steps of each scene (400). Each step follows from the last one; a scene at
rest has no speed above 1 mm/s.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
from collections.abc import Callable
from math import inf
from statistics import median
from typing import Any

import numpy as np

import lcpcli
from lcpcli.gallery.rigid_bodies import contact_in_time
from lcpcli.peers import registry
from lcpcli.typing import Vector

SCENES = (("stack", "tower", 8), ("heap", "heap", 8), ("slider", "tower", 1))
AT_REST = 1e-3


class Contacts:
    """The data of a step: W and q by contacts, the coefficient mu, names of the
    contacts, and the LCP of Stewart and Trinkle."""

    def __init__(self, scene):
        self.k, self.mu, self.lcp = len(scene.contacts), scene.friction, scene.problem()
        order = np.arange(2 * self.k).reshape(2, self.k).T.ravel()
        M = self.lcp.M
        self.W, self.q = M[order][:, order], self.lcp.q[order]
        pairs = [(each.first, each.second) for each in scene.contacts]
        self.ids = [(*pair, pairs[:i].count(pair)) for i, pair in enumerate(pairs)]
        self.ids_of_unknowns = [(*each, side) for each in self.ids for side in (0, 1)]
        positions = np.arange(2 * self.k)
        self.box = {
            "lower": np.tile([0, -self.mu], self.k),
            "upper": np.tile([inf, self.mu], self.k),
            "findex": np.where(positions % 2, positions - 1, -1),
        }

    def violation(self, x):
        most = self.mu * x[::2]
        lower, upper = np.zeros(x.size), np.full(x.size, inf)
        lower[1::2], upper[1::2] = -most, most
        off = abs(x - np.clip(x - (self.W @ x + self.q), lower, upper))
        terms = abs(self.W) @ abs(x) + abs(self.q)
        return float((off / np.maximum(terms, abs(x).max() or 1.0)).max())


class ByW:
    def __init__(self, compiled):
        self.solver: Any = None
        self.compiled = compiled

    def __call__(self, data):
        if self.solver is None:
            first = lcpcli.from_contact(data.W, data.q, data.mu)
            self.solver = lcpcli.Solver(first, compiled=self.compiled)
        self.solver.update(W=data.W, q=data.q, mu=data.mu, ids=data.ids)
        result = self.solver.solve()
        return result.answer.x if result.solved else None


class ByIndices(ByW):
    def __call__(self, data):
        if self.solver is None:
            first = lcpcli.from_findex(data.W, data.q, **data.box)
            self.solver = lcpcli.Solver(first, compiled=self.compiled)
        ids = data.ids_of_unknowns
        self.solver.update(A=data.W, b=data.q, ids=ids, **data.box)
        result = self.solver.solve()
        return result.answer.x if result.solved else None


def by_quantecon(data):
    z = registry.load("quantecon").solve(data.lcp, 1e-10, 10.0).z
    if z is None:
        return None
    k = data.k
    return np.column_stack((z[:k], z[k : 2 * k] - z[2 * k : 3 * k])).ravel()


def main(steps):
    for name, kind, boxes in SCENES:
        scene = contact_in_time(kind, boxes)
        ways: dict[str, Callable[[Contacts], Vector | None]]
        ways = {"W": ByW(False), "findex": ByIndices(False)}
        if lcpcli.options.has_numba():
            ways |= {"W, kernels": ByW(True), "findex, kernels": ByIndices(True)}
        if registry.load("quantecon").version():
            ways["quantecon"] = by_quantecon
        times = {}
        failed, worst, done = dict.fromkeys(ways, 0), dict.fromkeys(ways, 0.0), 0
        while done < steps:
            if not scene.contacts:
                scene.advance()
                continue
            data, found = Contacts(scene), None
            is_at_rest = bool(abs(scene.velocities).max() < AT_REST)
            # In another order at each step, as the first one fills caches for others.
            names = list(ways)
            for way in names[done % len(names) :] + names[: done % len(names)]:
                began = time.process_time()
                x = ways[way](data)
                taken = time.process_time() - began
                if done > len(SCENES):  # the first ones compile
                    times.setdefault((way, is_at_rest), []).append(taken)
                failed[way] += x is None
                if x is not None:
                    worst[way] = max(worst[way], data.violation(x))
                    found = x if found is None or way == "W" else found
            done += 1
            impulses = None
            if found is not None:
                none = np.zeros(2 * data.k)
                impulses = np.concatenate((found[::2], found[1::2], none))
            scene.advance(impulses)
        for way in ways:
            cells = [
                f"{words} {1e6 * median(own):.3g} us ({len(own)})"
                for words, rest in (("moving", False), ("at rest", True))
                if (own := times.get((way, rest)))
            ]
            ends = f"{failed[way]} not solved, violation {worst[way]:.0e}"
            print(f"{name}, {way}: {', '.join(cells)}; {ends}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 400)
