"""Games in extensive form, as Gambit's .efg files have them."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import product

import numpy as np

from lcpcli.gallery.families import require
from lcpcli.model.games import from_efg
from lcpcli.model.problem import Problem

GRID = 1000  # perturbations of payoffs are multiples of 1 / GRID
PLAYERS = '{ "first" "second" }'


def poker(n: int, seed: int, *, perturbation: float = 0.25) -> Problem:
    """Pose poker with one card each of r >= 2 ranks, about n = 12 r + 4 unknowns: Kuhn's game for r = 3.

    Both ante 1. The first player bets 1 or checks; after a bet the second one calls or folds, after a check it may bet,
    and then the first one calls or folds. The higher card wins.
    H. W. Kuhn, A simplified two-person poker, Contributions to the Theory of Games I (1950) 97-103.

    perturbation : 0 <= perturbation <= 1, of each payoff of each player at each end, at random; 0 is the zero-sum game.
    """
    require("perturbation", perturbation, 0 <= perturbation <= 1, "0 <= perturbation <= 1")
    ranks = max(2, round((n - 4) / 12))
    pairs = [(i, j) for i, j in product(range(1, ranks + 1), repeat=2) if i != j]
    ends = 5 * len(pairs)
    most = int(perturbation * GRID)
    noise = np.random.default_rng([seed, ranks]).integers(-most, most + 1, (ends, 2)).tolist()
    deals = " ".join(f'"{i} against {j}" 1/{len(pairs)}' for i, j in pairs)
    lines = [f'EFG 2 R "poker-{12 * ranks + 4}" {PLAYERS}', f'c "" 1 "deal" {{ {deals} }} 0']
    of_end = iter(enumerate(noise, 1))
    for i, j in pairs:
        sign = 1 if i > j else -1

        def end(won: int) -> str:
            number, (one, other) = next(of_end)
            return f't "" {number} "" {{ {Fraction(won * GRID + one, GRID)} {Fraction(other - won * GRID, GRID)} }}'

        lines += [
            f'p "" 1 {i} "{i}" {{ "bet" "check" }} 0',
            f'p "" 2 {j} "{j} bet" {{ "call" "fold" }} 0',
            end(2 * sign),
            end(1),
            f'p "" 2 {ranks + j} "{j} checked" {{ "bet" "check" }} 0',
            f'p "" 1 {ranks + i} "{i} checked, bet" {{ "call" "fold" }} 0',
            end(2 * sign),
            end(-1),
            end(sign),
        ]
    note = f"{ranks} ranks, payoffs perturbed by up to {perturbation:g}."
    return from_efg("\n".join(lines), source="after Kuhn 1950", note=note)


def bargaining(n: int, _seed: int, *, discount: float = 0.75) -> Problem:
    """Pose bargaining over a good with k costs, k values and k prices, about n = 4 k^3 + 3 k^2 + k + 4 unknowns.

    The seller knows its cost i - 1, the buyer its value i, for i from 1 to k, each with the same probability. The
    seller asks for one of the prices 1 to k; the buyer accepts, or offers one of them, which the seller accepts or
    rejects, and then gains count for less.
    K. Chatterjee, W. Samuelson, Bargaining under incomplete information, Operations Research 31 (1983) 835-851, for
    offers at the same time; A. Rubinstein, Econometrica 50 (1982) 97-109, for alternating ones.

    discount : 0 < discount <= 1, the factor of gains from the second offer.
    """
    require("discount", discount, 0 < discount <= 1, "0 < discount <= 1")
    k = next(k for k in range(1, n + 2) if unknowns_of(k + 1) > n)
    title = f"bargaining-{unknowns_of(k)}"
    types = " ".join(f'"cost {i - 1}, value {j}" 1/{k * k}' for i, j in product(range(1, k + 1), repeat=2))
    lines = [f'EFG 2 R "{title}" {{ "seller" "buyer" }}', f'c "" 1 "types" {{ {types} }} 0']
    for i, j in product(range(1, k + 1), repeat=2):
        lines += _offers(k, i, j, Fraction(str(discount)))
    note = f"{k} costs, values and prices, discount {discount:g}."
    return from_efg("\n".join(lines), source="after Chatterjee and Samuelson 1983", note=note)


def unknowns_of(k: int) -> int:
    """Return the number of unknowns of `bargaining` with k prices."""
    return 4 * k**3 + 3 * k**2 + k + 4


def _offers(k: int, i: int, j: int, discount: Fraction) -> Iterator[str]:
    """Yield the nodes after a chance move."""
    prices = range(1, k + 1)
    asked = " ".join(f'"ask {price}"' for price in prices)
    offered = " ".join(f'"offer {price}"' for price in prices)
    number = 2 * k * k * k * (k * (i - 1) + j - 1)  # of outcomes before: fewer than this

    def end(price: int, factor: Fraction) -> str:
        nonlocal number
        number += 1
        return f't "" {number} "" {{ {factor * (price - i + 1)} {factor * (j - price)} }}'

    yield f'p "" 1 {i} "cost {i - 1}" {{ {asked} }} 0'
    for ask in prices:
        yield f'p "" 2 {k * (j - 1) + ask} "value {j}, asked {ask}" {{ "accept" {offered} }} 0'
        yield end(ask, Fraction(1))
        for offer in prices:
            own = k + k * k * (i - 1) + k * (ask - 1) + offer
            yield f'p "" 1 {own} "cost {i - 1}, asked {ask}, offered {offer}" {{ "accept" "reject" }} 0'
            yield end(offer, discount)
            yield 't "" 0'
