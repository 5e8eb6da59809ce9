"""A step length that satisfies the two conditions of step 2.7, the weak Wolfe conditions, in finitely many trials.

With f along the direction s from x, d = -grad f(x) and D = <d, s> > 0,

    f(x + gamma s) <= f(x) - gamma rho D        (sufficient decrease)
    <grad f(x + gamma s), s> >= -sigma D        (curvature).

A trial is accepted or becomes an end of the bracket: the upper one if it violates the decrease, the lower one if it
satisfies the decrease but not the curvature. The bracket expands while it has no upper end; from then on each pair of
trials at least halves it. Between the halvings the minimiser of a parabola that interpolates f is tried, which is exact
if f is quadratic (Nocedal and Wright 2006, section 3.5). Gradients are computed only where the decrease holds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lcpcli.methods.smoothing import Point, Smoothed
from lcpcli.typing import Vector

MAX_TRIALS = 200
SHORT_STEP = 1e-6  # relative to the first trial length: for shorter trials, whether x changes at all is checked


@dataclass
class Bracket:
    """Lengths low < high between which both conditions can be satisfied; f and its slope at low, f at high."""

    low: float
    f_low: float
    slope_low: float
    high: float = math.inf
    f_high: float = math.inf
    halve: bool = False

    def raise_low(self, gamma: float, f: float, slope: float) -> None:
        self.halve = gamma - self.low < 0.5 * (self.high - self.low)
        self.low, self.f_low, self.slope_low = gamma, f, slope

    def cut_high(self, gamma: float, f: float) -> None:
        self.halve = gamma - self.low > 0.5 * (self.high - self.low)
        self.high, self.f_high = gamma, f

    def next_trial(self, slope_start: float) -> float:
        if self.high == math.inf:
            flattening = self.slope_low / slope_start
            return self.low * (min(max(1 / (1 - flattening), 2.0), 10.0) if flattening < 1 else 10.0)
        width = self.high - self.low
        bend = self.f_high - self.f_low - self.slope_low * width
        inner = self.low - 0.5 * self.slope_low * width * (width / bend) if 0 < bend < math.inf else self.low
        if self.halve or not self.low < inner < self.high:
            return self.low + 0.5 * width
        return inner


class Step(NamedTuple):
    """The end of a step, the gradient of f there, and the number of lengths tried."""

    point: Point
    gradient: Vector
    trials: int


def search(
    smoothed: Smoothed, start: Point, s: Vector, slope: float, gamma: float, rho: float, sigma: float
) -> Step | int:
    """The step from start along s, where f has the slope <grad f, s> < 0, with first trial length gamma > 0.

    Returns only the number of trials if they become too short to change x: the decrease is below rounding.
    """
    bracket, first = Bracket(0.0, start.f, slope), gamma
    for trial in range(1, MAX_TRIALS + 1):
        x = gamma * s
        x += start.x
        point = smoothed.at(x)
        if not point.f <= start.f + gamma * rho * slope:
            if gamma < SHORT_STEP * first and np.array_equal(x, start.x):
                break
            bracket.cut_high(gamma, point.f)
        else:
            g = smoothed.gradient(point)
            slope_here = float(g @ s)
            if slope_here >= sigma * slope:
                return Step(point, g, trial)
            bracket.raise_low(gamma, point.f, slope_here)
        gamma = bracket.next_trial(slope)
    return trial
