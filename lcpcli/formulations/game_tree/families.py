"""Families of game trees, as in `gallery.families`."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import count as count_from
from itertools import product

import numpy as np

from lcpcli.formulations.game_tree.game import from_efg
from lcpcli.model.problem import Problem

GRID = 1000  # perturbations of payoffs are multiples of 1 / GRID


def poker(n: int, seed: int, *, perturbation: float = 0.25) -> Problem:
    """Pose poker with one card each of r >= 2 ranks, about n = 12 r + 4 unknowns:
    Kuhn's game for r = 3.

    Both players ante 1. The first player bets 1 or checks; after a bet the second one
    calls or folds, after a check it may bet, and then the first one calls or folds. The
    higher card wins.

    H. W. Kuhn, A simplified two-person poker, Contributions to the Theory of Games I
    (1950) 97-103.

    perturbation : the largest random change of each payoff of each player at each
        terminal node; 0 is the zero-sum game.
    """
    ranks = max(2, round((n - 4) / 12))
    pairs = [(i, j) for i, j in product(range(1, ranks + 1), repeat=2) if i != j]
    max_change = int(perturbation * GRID)
    noise = (
        np.random.default_rng([seed, ranks])
        .integers(-max_change, max_change + 1, (5 * len(pairs), 2))
        .tolist()
    )
    deals = " ".join(f'"{i} against {j}" 1/{len(pairs)}' for i, j in pairs)
    lines = [
        f'EFG 2 R "poker-{12 * ranks + 4}" {{ "first" "second" }}',
        f'c "" 1 "deal" {{ {deals} }} 0',
    ]
    of_end = iter(enumerate(noise, 1))
    for i, j in pairs:
        sign = 1 if i > j else -1

        def terminal_node(won: int) -> str:
            number, (one, other) = next(of_end)
            return (
                f't "" {number} "" {{ {Fraction(won * GRID + one, GRID)} '
                f"{Fraction(other - won * GRID, GRID)} }}"
            )

        lines += [
            f'p "" 1 {i} "{i}" {{ "bet" "check" }} 0',
            f'p "" 2 {j} "{j} bet" {{ "call" "fold" }} 0',
            *map(terminal_node, (2 * sign, 1)),
            f'p "" 2 {ranks + j} "{j} checked" {{ "bet" "check" }} 0',
            f'p "" 1 {ranks + i} "{i} checked, bet" {{ "call" "fold" }} 0',
            *map(terminal_node, (2 * sign, -1, sign)),
        ]
    return from_efg(
        "\n".join(lines),
        note=f"{ranks} ranks, payoffs perturbed by up to {perturbation:g}.",
    )


def bargaining(n: int, _seed: int, *, discount: float = 0.75) -> Problem:
    """Pose bargaining over a good with k costs, k values and k prices, about n = 4 k^3
    + 3 k^2 + k + 4 unknowns.

    The seller knows its cost i - 1, the buyer its value i, for i from 1 to k, each with
    the same probability. The seller demands one of the prices 1 to k; the buyer
    accepts, or offers one of them, which the seller accepts or rejects, and then gains
    count for less, by the factor discount.
    K. Chatterjee, W. Samuelson, Operations Research 31 (1983) 835-851, for offers at
    the same time; A. Rubinstein, Econometrica 50 (1982) 97-109, for alternating ones.
    """
    k = next(k for k in range(1, n + 2) if unknowns_of(k + 1) > n)
    types = " ".join(
        f'"cost {i - 1}, value {j}" 1/{k * k}'
        for i, j in product(range(1, k + 1), repeat=2)
    )
    lines = [
        f'EFG 2 R "bargaining-{unknowns_of(k)}" {{ "seller" "buyer" }}',
        f'c "" 1 "types" {{ {types} }} 0',
    ]
    for i, j in product(range(1, k + 1), repeat=2):
        lines += _offers(k, i, j, Fraction(str(discount)))
    return from_efg(
        "\n".join(lines), note=f"{k} costs, values and prices, discount {discount:g}."
    )


def unknowns_of(k: int) -> int:
    return 4 * k**3 + 3 * k**2 + k + 4


def _offers(k: int, i: int, j: int, discount: Fraction) -> Iterator[str]:
    prices = range(1, k + 1)
    asked, offered = (
        " ".join(f'"{verb} {price}"' for price in prices) for verb in ("ask", "offer")
    )
    # The numbers of outcomes are larger than all earlier ones.
    numbers = count_from(2 * k * k * k * (k * (i - 1) + j - 1) + 1)

    def end(price: int, factor: Fraction) -> str:
        return (
            f't "" {next(numbers)} "" {{ {factor * (price - i + 1)} '
            f"{factor * (j - price)} }}"
        )

    yield f'p "" 1 {i} "cost {i - 1}" {{ {asked} }} 0'
    for ask in prices:
        yield (
            f'p "" 2 {k * (j - 1) + ask} "value {j}, asked {ask}" {{ "accept" '
            f"{offered} }} 0"
        )
        yield end(ask, Fraction(1))
        for offer in prices:
            number = k + k * k * (i - 1) + k * (ask - 1) + offer
            yield (
                f'p "" 1 {number} "cost {i - 1}, asked {ask}, offered {offer}" {{ '
                f'"accept" "reject" }} 0'
            )
            yield end(offer, discount)
            yield 't "" 0'
