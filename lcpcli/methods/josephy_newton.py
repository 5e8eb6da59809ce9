"""Newton's method of Josephy for nonlinear complementarity problems: each step solves the linearization at z.

N. H. Josephy, Newton's method for generalized equations, MRC Technical Report 1965, University of Wisconsin (1979);
globally by S. P. Dirkse and M. C. Ferris, The PATH solver, Optimization Methods and Software 5 (1995) 123-156, and by
T. S. Munson, F. Facchinei, M. C. Ferris, A. Fischer and C. Kanzow, The semismooth algorithm for large scale
complementarity problems, INFORMS Journal on Computing 13 (2001) 294-311.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.doubles import EPS, generator, is_finite, size
from lcpcli.linalg.matrices import product
from lcpcli.methods.newton_steps import PERTURBATIONS, Linear, Place, Steps, is_slow
from lcpcli.methods.stages import Ending, Finished, Iterate, Stage, Stalled
from lcpcli.model.evaluations import Evaluations
from lcpcli.typing import Vector

MEMORY = 10  # merits of which the largest is what a step must get below, unless an attempt is monotone
SLACK = 100.0  # times the merit at the start: what the first MEMORY steps must get below, if they are not perturbed
MOST_HALVINGS = 20  # of the way to another start, for it to be in the domain of F
NEARLY_SOLVED = 1e-8  # of the natural residual at the start: what may be all that rounding leaves
FEW_ROUNDINGS, FEW_NOISES = 16, 8  # of the terms of a row, and times the noise of F, by which its F may be off
MOST_TRIED = 3  # times that the noise is asked for in a run
FAR = 1e8  # times the size of the start: z that run off, for which other steps of differences do not help
FRUITLESS = 4  # steps that do not decrease the merit, or only within noise, after which noise may be all that is left
MOST_NOISY = 1e-2  # of that residual: what may be all that the noise of F leaves
MOST_BRIEF = 200  # unknowns of a problem that by default is given up after about a second
MOST_LINEARIZATIONS = 1000  # of a small problem in that time
CUBIC = 130  # unknowns from which on the cubic work of a linearization counts more than all else
FUNCTIONS = 64  # evaluations of F that count as a linearization of a small problem
PIVOTS, QUADRATIC = 32, 150  # pivots that do so, and unknowns from which on passes over the tableau are most of them
FINE = 1e-12  # a natural residual that no further step need reduce
STATIONARY = "z is nearly a stationary point of the merit function, but no solution"
SLOW = "the merit function decreases too slowly"
NO_FURTHER = "no step decreases the residual further"
LONG = "it is given up after the work of about a second; with restarts it goes on"


class _Attempt(NamedTuple):
    """How an attempt begins: with the `Steps` of this name, if any; with the largest perturbation, and steps that all
    decrease the merit; and at another start at random, of the given seed."""

    first: str = ""
    is_perturbed: bool = False
    seed: int = 0


ATTEMPTS = _Attempt("crash"), _Attempt("smoothed"), _Attempt(), _Attempt(is_perturbed=True)  # then those two in turn


def josephy_newton(
    evaluations: Evaluations, start: Vector, linear: Linear, *, restarts: int = 12, is_brief: bool = False
) -> Stage:
    """Solve a nonlinear problem by the solutions of its linearizations F(z) + J(z) d, for d with z + d in the bounds.

    start : an admissible z, where F is finite. linear : solves the linearizations. is_brief : whether, with at most
    MOST_BRIEF unknowns, it is given up after about a second, by the numbers of linearizations, of their pivots, and of
    evaluations of F.

    The steps, as the trace names them: "crash" solves the linearization for the variables that are not held at their
    bounds, from the start and for as long as the merit function (`newton_steps`) falls fast; "full" leads to the
    solution of the linearization, "damped" a part of the way there, to where the merit function is below the largest of
    the last MEMORY merits, at first below SLACK times that of the start. Where there is none, or it leads nowhere,
    "proximal" is such a step by J + mu I, in the units of its rows, with mu that falls from step to step. Where this
    fails, "semismooth" is a step of Newton's method for the merit function, and "gradient" one down its gradient; near
    a solution "active" is the shortest step that solves the equations of its active set, as a singular J asks for. All
    steps are cut back to where F and J are finite. Where they lead no further, "watchdog" goes back to where the merit
    was least, from where all steps must decrease it. "restart" begins another attempt: the first one with "smoothed"
    steps, of Newton's method for smoothed merit functions, the next ones without crash and with perturbed
    linearizations, and then from other starts.

    Finished : the natural residual is 0, or all but that and no step decreases it. Stalled : all starts are stuck,
    which proves nothing.
    """
    search = _Search(evaluations, linear, is_brief and start.size <= MOST_BRIEF)
    ending: Ending = Stalled(STATIONARY)
    for number in range(restarts + 1):
        if search.is_long:
            break
        is_listed = number < len(ATTEMPTS)
        attempt = ATTEMPTS[number] if is_listed else _Attempt(ATTEMPTS[number % 2].first, seed=number)
        place = search.start(attempt, start)
        if place is None:
            continue
        if number:
            yield search.iterate(place, "restart")
        for reached in getattr(search.steps, attempt.first)(place) if attempt.first else ():
            place = reached
            yield search.iterate(place, attempt.first)
        last = yield from search.descent(place, 1 if attempt.is_perturbed else MEMORY)
        if isinstance(last, Finished) and not last.reason:
            return last
        ending = ending if isinstance(ending, Finished) else last
        if search.is_rounding:
            break
    return ending


class _Search:
    """The attempts of a run. is_rounding : whether the last one has ended where the residual is rounding, or noise."""

    def __init__(self, evaluations: Evaluations, linear: Linear, is_brief: bool) -> None:
        self.evaluations, self.steps, self._is_brief = evaluations, Steps(evaluations, linear), is_brief
        self._last_size, self.is_rounding, self._left = np.inf, False, MOST_TRIED
        self._tried: Place | None = None

    @property
    def is_long(self) -> bool:
        n, own = self.evaluations.problem.n, self.evaluations
        work = self.steps.linearizations * (1 + (n / CUBIC) ** 3) + own.pivots / PIVOTS * (1 + (n / QUADRATIC) ** 2)
        return self._is_brief and work + own.functions / FUNCTIONS > MOST_LINEARIZATIONS

    def iterate(self, place: Place, step: str) -> Iterate:
        """Return the iterate for the loop; it is final if its residual is tiny, or did not decrease much."""
        now, before = size(place.gaps), self._last_size
        self._last_size = now
        is_final = now <= FINE or now > 0.5 * before
        return Iterate(place.z / 2, place.gaps, step, self.evaluations.functions, signs_final=is_final)

    def start(self, attempt: _Attempt, first: Vector) -> Place | None:
        """Return the start of an attempt, further from the first one with each seed; None if it has no merit."""
        self._last_size = np.inf
        start, seed = first, attempt.seed
        if seed:
            moves = 2.0 ** (seed - len(ATTEMPTS)) * generator(seed).uniform(-1.0, 1.0, first.size)
            moves *= np.maximum(1.0, np.abs(first))
            starts = (self.steps.box.project(first + 0.5**halvings * moves) for halvings in range(MOST_HALVINGS))
            start = next((start for start in starts if is_finite(self.evaluations.values(start))), first)
        place = self.steps.at(start)
        if place is not None:
            self.steps.begin(PERTURBATIONS[-1] if attempt.is_perturbed else 0.0, place)
        return place

    def descent(self, place: Place, memory: int) -> Stage:
        """Take steps until the merit hardly falls; then, once more, begin at its least value with steps that all do."""
        best, waiting, noisy = place, 0, 0
        while True:
            merits, first = [place.merit], SLACK * place.merit if memory > 1 else 0.0
            while place.merit and not (is_slow(merits) or self.is_long):
                most, J = max(merits[-memory:]), self.evaluations.finite_jacobian(place.z)
                loosely = max(most, first) if len(merits) <= memory else most
                found = None if J is None else self.steps.step(place, J, most, loosely)
                if found is None:
                    break
                step, place = found
                waiting = 0 if place.merit < best.merit else waiting + 1
                noisy += self._is_within_noise(place)
                best = place if place.merit < best.merit else best
                merits.append(place.merit)
                yield self.iterate(place, step)
                if FRUITLESS in (waiting, noisy):
                    if self._is_noise(best):
                        break
                    self.evaluations.adapt(place.z)
            if not place.merit:
                return Finished()
            if self._is_noise(best):
                return Finished(NO_FURTHER)
            if self.is_long:
                return self._ending(best, merits)
            if size(place.z) <= FAR * max(1.0, size(self.evaluations.problem.x0)) and self.evaluations.adapt(place.z):
                continue
            if place is best or memory == 1:
                return self._ending(best, merits)
            place, memory = best, 1
            self.steps.basis = None
            yield self.iterate(place, "watchdog")

    def _ending(self, best: Place, merits: Sequence[float]) -> Ending:
        """Return how a descent ends, at the place where the merit was least; if it is stalled, with the row in which
        steps have left the domain of F."""
        if size(best.gaps) > NEARLY_SOLVED * self.steps.reference:
            reason = LONG if self.is_long else SLOW if is_slow(merits) else STATIONARY
            if (i := self.steps.undefined) is not None:
                name = self.evaluations.problem.names[i] or str(i + 1)
                reason += f"; steps to where F is undefined, in row {name}, were cut back"
            return Stalled(reason)
        terms = product(abs(self.evaluations.jacobian(best.z)), np.abs(best.z)) + np.abs(best.F)
        self.is_rounding = bool((np.abs(best.gaps) <= FEW_ROUNDINGS * EPS * terms).all())
        return Finished(NO_FURTHER)

    def _is_noise(self, best: Place) -> bool:
        """Return whether the noise of F may be all that the residual is."""
        is_small = size(best.gaps) <= MOST_NOISY * self.steps.reference or self._is_within_noise(best)
        if self._tried is not best and self._left and is_small:
            self._tried, self._left = best, self._left - 1
            self.evaluations.noise_at(best.z)
            self.is_rounding = self._is_within_noise(best)
        return self.is_rounding

    def _is_within_noise(self, place: Place) -> bool:
        """Return whether the residual is no more than a few times the noise of F, as far as this is known."""
        return bool((np.abs(place.gaps) <= FEW_NOISES * self.evaluations.noise).all())
