"""Newton's method of Josephy for nonlinear complementarity problems: each step solves the linearization at z.

N. H. Josephy, Newton's method for generalized equations, MRC Technical Report 1965, University of Wisconsin (1979);
globally by S. P. Dirkse and M. C. Ferris, The PATH solver, Optimization Methods and Software 5 (1995) 123-156, and by
T. S. Munson, F. Facchinei, M. C. Ferris, A. Fischer and C. Kanzow, The semismooth algorithm for large scale
complementarity problems, INFORMS Journal on Computing 13 (2001) 294-311.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.doubles import generator, is_finite, size
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import dense, plus_diagonal, product, row_maxima
from lcpcli.methods.merit import newton_direction, phi, slopes
from lcpcli.methods.stages import Ending, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import Box
from lcpcli.model.evaluations import Evaluations
from lcpcli.typing import Matrix, States, Vector

MEMORY = 5  # merits of which the largest is what a step must get below
DECREASE = 1e-4  # of the merit, relative to the length of a step
SHORTEST = 2.0**-12  # of a step to the solution of a linearization; of other steps its square
PERTURBATIONS = 1e-4, 1e-2, 1.0  # of the diagonal of J, relative to its rows, where its linearization has no solution
WATCHED = 4  # steps above the least merit, from which the way back is taken
MOST_FRUITLESS = 4  # linearizations that are tried longer and have no solution, after which none is tried longer
FALL, RISE = 10.0, 100.0  # by which a perturbation is divided after a step, and multiplied where there is none
NEAR = 1e-4  # of the natural residual at the start, from which on the active set may be that of a solution
MOST_ACTIVE, DEPENDENT = 1000, 1e-9  # unknowns for which its equations are solved, up to relative singular values
MOST_CRASHED, CRASH_DECREASE = 20, 0.5  # steps before the first linearization, and how fast the merit falls
SHORTEST_CRASH, MOST_DAMPED = 2.0**-4, 4  # of these steps: the shortest, and how many are cut back, but the last
PERTURBED, WATCHED_ATTEMPT = 1, 2  # attempts at the first start: with the largest perturbation; with the watchdog
MOST_HALVINGS = 20  # of the way to another start, for it to be in the domain of F
PATIENCE, PROGRESS = 24, 0.9  # so many steps must leave at most this of the merit
NEARLY_SOLVED = 1e-8  # of the natural residual at the start: what is not left for another start
FINE = 1e-12  # a natural residual that no further step need reduce
SOLVE = "full", "damped", "proximal"
STATIONARY = "z is nearly a stationary point of the merit function, but no solution"
SLOW = "the merit function decreases too slowly"

Linear = Callable[[Matrix, Vector, Box, "States | None", bool], "tuple[Vector, States] | None"]
"""What solves a linearization: called with M, q, the bounds, the states to try first, and whether to try longer than
before, it returns the solution and its states, or None."""


class _Place(NamedTuple):
    """An admissible z with F, Phi, half the square of Phi, and the natural residual, signed for each row."""

    z: Vector
    F: Vector
    phi: Vector
    merit: float
    gaps: Vector


def josephy_newton(evaluations: Evaluations, start: Vector, linear: Linear, *, restarts: int = 4) -> Stage:
    """Solve a nonlinear problem by the solutions of its linearizations F(z) + J(z) d, for d with z + d in the bounds.

    evaluations : of F and J. start : an admissible z, where F is finite. linear : solves the linearizations.
    restarts : other attempts where the method gets stuck: two from the same start, others at random from fixed seeds.

    The steps, as the trace names them: "crash" solves the linearization for the variables that are not held at their
    bounds, from the start and for as long as that decreases the merit function (see `merit`) fast; "full" leads to the
    solution of the linearization, "damped" a part of the way there, to where the merit function is below the largest of
    the last MEMORY steps. Where there is none, or it leads nowhere, "proximal" is such a step by J + mu I, in the units
    of its rows, with mu that falls from step to step. Where this fails, "semismooth" is a step of Newton's method for
    the merit function, and "gradient" one down its gradient; near a solution "active" is the shortest step that solves
    the equations of its active set, as a singular J asks for. All steps are cut back to where F and J are finite.
    "restart" begins another attempt: the first one with proximal steps that all decrease the merit function, then one
    with a "watchdog", which goes back to where that was least, and then from other starts.

    Finished : the natural residual is 0, or all but that and no step decreases it. Stalled : all starts are stuck,
    which proves nothing.
    """
    search = _Search(evaluations, linear)
    ending: Ending = Stalled(STATIONARY)
    for attempt in range(restarts + 1):
        place = search.at(search.start_of(attempt, start))
        if place is None:
            continue
        search.reference = search.reference or size(place.gaps)
        if attempt:
            yield search.iterate(place, "restart")
        for crashed in search.crash(place) if attempt != PERTURBED else ():
            place = crashed
            yield search.iterate(place, "crash")
        ending = yield from search.descent(place)
        if isinstance(ending, Finished):
            break
    return ending


class _Search:
    """The steps of a run. reference : the natural residual at its start."""

    def __init__(self, evaluations: Evaluations, linear: Linear) -> None:
        self.evaluations, self._linear, self._box = evaluations, linear, evaluations.problem.box
        self.reference = self.share = 0.0
        self._basis: States | None = None
        self._last_size, self._fruitless = np.inf, 0
        self._undefined: int | None = None

    @np.errstate(all="ignore")
    def at(self, z: Vector) -> _Place | None:
        """Return the place of z; None if F, or the merit function, is not finite there."""
        F = self.evaluations.values(z)
        if not is_finite(F):
            self._undefined = int(np.argmax(~np.isfinite(F)))
            return None
        values = phi(self._box, z, F)
        merit = 0.5 * float(values @ values)
        return _Place(z, F, values, merit, self._box.gaps(z, F)) if np.isfinite(merit) else None

    def iterate(self, place: _Place, step: str) -> Iterate:
        """Return the iterate for the loop; it is final if its residual is tiny, or did not decrease much."""
        now, before = size(place.gaps), self._last_size
        self._last_size = now
        is_final = now <= FINE or now > 0.1 * before
        return Iterate(place.z / 2, place.gaps, step, self.evaluations.functions, signs_final=is_final)

    def start_of(self, attempt: int, first: Vector) -> Vector:
        """Return the start of an attempt, the first start or one further from it each time."""
        self._basis, self._last_size = None, np.inf
        self.memory = 1 if attempt == PERTURBED else MEMORY
        self.share, self.is_watched = PERTURBATIONS[-1] if attempt == PERTURBED else 0.0, attempt == WATCHED_ATTEMPT
        if attempt <= WATCHED_ATTEMPT:
            return first
        moves = 2.0 ** (attempt - 3) * generator(attempt).uniform(-1.0, 1.0, first.size)
        moves *= np.maximum(1.0, np.abs(first))
        starts = (self._box.project(first + 0.5**halvings * moves) for halvings in range(MOST_HALVINGS))
        return next((start for start in starts if is_finite(self.evaluations.values(start))), first)

    def crash(self, place: _Place) -> Iterator[_Place]:
        """Yield where projected Newton steps lead, in the variables that are not held at a bound by the sign of F."""
        left = MOST_DAMPED
        for _ in range(MOST_CRASHED):
            t, place = self._crashed(place)
            left -= t < 1.0
            if not t or not left:
                return
            yield place

    @np.errstate(all="ignore")
    def _crashed(self, place: _Place) -> tuple[float, _Place]:
        """Return the length of such a step, 0 if there is none, and where it leads."""
        J, box = self.evaluations.finite_jacobian(place.z), self._box
        held = ((place.z <= box.lower) & (place.F >= 0)) | ((place.z >= box.upper) & (place.F <= 0))
        moving, d = (~(held | box.fixed)).nonzero()[0], np.zeros(place.z.size)
        if J is None or not moving.size or not place.merit:
            return 0.0, place
        try:
            d[moving] = PrincipalSolver(J).solve(moving, -place.F[moving])
        except SingularMatrix:
            return 0.0, place
        ways = self._along(place.z, d, SHORTEST_CRASH)
        fits = ((t, own) for t, own in ways if own.merit <= (1 - CRASH_DECREASE * t) * place.merit)
        return next(fits, (0.0, place))

    def descent(self, place: _Place) -> Stage:
        """Take steps from a place until none decreases the merit function, or too slowly. After WATCHED steps that do
        not, go back to the place where it was least, and take one from there that does."""
        recent, lowest, best, since = deque([place.merit], self.memory), [place.merit], place, 0
        while place.merit:
            J = self.evaluations.finite_jacobian(place.z)
            found = None if J is None else self._step(place, J, max(recent))
            is_slow = len(lowest) > PATIENCE and lowest[-1] > PROGRESS**2 * lowest[-1 - PATIENCE]
            if found is None and place is not best and self.is_watched:
                since = WATCHED
            elif found is None or is_slow:
                if size(best.gaps) <= NEARLY_SOLVED * self.reference:
                    return Finished("no step decreases the residual further")
                return Stalled(self._where(STATIONARY if found is None else SLOW))
            else:
                step, place = found
                best, since = (place, 0) if place.merit < best.merit else (best, since + 1)
                recent.append(place.merit)
                lowest.append(best.merit)
                yield self.iterate(place, step)
            if since >= WATCHED and self.is_watched:
                place, since, recent = best, 0, deque([best.merit], self.memory)
                self._basis = None
                yield self.iterate(place, "watchdog")
        return Finished()

    def _where(self, reason: str) -> str:
        """Return the reason, with the row in which steps have left the domain of F."""
        if self._undefined is None:
            return reason
        i = self._undefined
        name = self.evaluations.problem.names[i] or str(i + 1)
        return f"{reason}; steps to where F is undefined, in row {name}, were cut back"

    @np.errstate(all="ignore")
    def _step(self, place: _Place, J: Matrix, most: float) -> tuple[str, _Place] | None:
        """Return the step from a place and where it leads; None if there is none."""
        near = size(place.gaps) <= NEAR * self.reference
        for share, is_longer in self._kinds():
            if found := self._solved(place, J, most, share, is_longer):
                return found
            if near and (reached := self._active_step(place, J)):
                return "active", reached
            near = False
        self._basis = None
        return self._descent_step(place, J)

    def _kinds(self) -> Iterator[tuple[float, bool]]:
        """Yield the linearizations to try in turn, each by its share of the perturbation and whether it is tried
        longer."""
        own = self.share
        for share in (own, *((RISE * own, RISE**2 * own) if own else PERTURBATIONS)):
            if share <= PERTURBATIONS[-1]:
                yield share, False
        if self._fruitless < MOST_FRUITLESS:
            yield own, True

    def _solved(
        self, place: _Place, J: Matrix, most: float, share: float, is_longer: bool
    ) -> tuple[str, _Place] | None:
        """Return the step to the solution of the linearization with a share of the perturbation, or a part of it."""
        sizes = row_maxima(J)
        M = plus_diagonal(J, share * np.where(sizes > 0, sizes, 1.0)) if share else J
        answer = self._linear(M, place.F, self._box.moved_by(place.z), self._basis, is_longer)
        self._fruitless += is_longer and answer is None
        if answer is None:
            return None
        d, self._basis = answer
        for t, reached in self._along(place.z, d, SHORTEST):
            if reached.merit <= most * (1 - DECREASE * t) and self._is_differentiable(reached):
                fallen = share / (FALL if t < 1 else FALL**2)
                self.share = fallen if fallen >= PERTURBATIONS[0] / RISE**2 else 0.0
                return SOLVE[2 if share else int(t < 1)], reached
        return None

    def _active_step(self, place: _Place, J: Matrix) -> _Place | None:
        """Return where the shortest step leads that solves the equations of the active set at a place near a solution,
        as well as they can be solved: J may be singular there, if multipliers are not unique."""
        if place.z.size > MOST_ACTIVE:
            return None
        lower, upper = self._box.moved_by(place.z).vectors(place.z.size)
        low, high = lower >= -place.F, upper <= -place.F
        d, moving = np.where(low, lower, np.where(high, upper, 0.0)), (~(low | high)).nonzero()[0]
        with suppress(SingularMatrix):
            rows = dense(J[moving])
            d[moving] = np.linalg.lstsq(rows[:, moving], -(place.F[moving] + rows @ d), rcond=DEPENDENT)[0]
            ways = self._along(place.z, d, SHORTEST_CRASH)
            return next((own for t, own in ways if own.merit <= (1 - CRASH_DECREASE * t) * place.merit), None)
        return None

    def _is_differentiable(self, place: _Place) -> bool:
        return not place.merit or self.evaluations.finite_jacobian(place.z) is not None

    def _along(self, z: Vector, d: Vector, shortest: float) -> Iterator[tuple[float, _Place]]:
        """Yield the places z + t d, within the bounds, where F is finite, for t = 1, 1/2, 1/4, ..."""
        t, end = 1.0, self._box.moved_back(d, self._box.moved_by(z), z)
        while t >= shortest:
            place = self.at(self._box.project(z + t * d if t < 1.0 else end))
            if place is not None:
                yield t, place
            t /= 2

    def _descent_step(self, place: _Place, J: Matrix) -> tuple[str, _Place] | None:
        """Return a semismooth step, or one down the gradient of the merit function, projected on the bounds."""
        G = slopes(self._box, place.z, place.F, J)
        gradient = product(G.T, place.phi)
        square = float(gradient @ gradient)
        if not 0 < square < np.inf:
            return None
        downhill = -2 * place.merit / square * gradient
        for step, d in (("semismooth", newton_direction(G, place.phi, gradient)), ("gradient", downhill)):
            if d is None:
                continue
            t = 1.0
            while t >= SHORTEST**2:
                y = self._box.project(place.z + t * d)
                reached = self.at(y)
                below = place.merit + DECREASE * min(float(gradient @ (y - place.z)), 0.0)
                is_lower = reached is not None and reached.merit <= below and reached.merit < place.merit
                if reached is not None and is_lower and self._is_differentiable(reached):
                    return step, reached
                t /= 2
        return None
