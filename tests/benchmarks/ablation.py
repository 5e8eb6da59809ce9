"""What each special way of solving is worth: it is switched off alone, and the problems
of `tests/seams` whose run uses it are run again.

    # all switches
    python tests/benchmarks/ablation.py --data FOLDER
    # some of them
    python tests/benchmarks/ablation.py --only units presolve

A row of the table has how many of the sampled problems use it, and how many of these
were run again; those whose verdict is lost (solved or proved before), gained, and
otherwise different, and those that are false; of how many anything in the outcome has
changed; the ratio of the iterations and of the processor time, off over on; and the
problem with the largest ratio of time among those that take 3 ms or more, measured in
repeated pairs.
"""

import argparse
import contextlib
import importlib
import inspect
import sys
import textwrap
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parents[2]
sys.path.append(str(HERE / "tests" / "seams"))

import bench_rows  # noqa: E402
import contact  # noqa: E402
import games  # noqa: E402
import nonlinear  # noqa: E402
import numpy as np  # noqa: E402
import oracle  # noqa: E402
import populations  # noqa: E402
import verdicts  # noqa: E402
from record import Case  # noqa: E402

import lcpcli  # noqa: E402
from lcpcli.errors import LCPError  # noqa: E402
from lcpcli.gallery import families  # noqa: E402

PACKAGE = str(Path(lcpcli.__file__).parent)
# Sparse problems that no population has.
LARGE = (
    ("beam", 300),
    ("plate", 400),
    ("frame", 300),
    ("tridiagonal", 3000),
    ("dominant", 2000),
    ("contact", 100),
    ("rigid-boxes", 200),
    ("journal-bearing", 900),
    ("two-obstacles", 900),
    ("spatial-prices", 400),
    ("portfolio", 300),
    ("frontier", 200),
)
POPULATIONS = (verdicts, oracle, games, nonlinear, contact)
# Of each kind of problem of a population, by the first words of its key; and of all.
OF_A_KIND, OF_A_POPULATION = 3, 60
OF_A_SWITCH = 400  # problems that are run again
SLOWEST = 0.5  # seconds of a sampled problem
LIMIT = 30.0  # seconds, after which a run counts as without a verdict
CLEAR_SECONDS = 3e-3  # of a problem whose ratio of time is looked at
REPEATED, PAIRS = 4, 5  # problems of a switch that are timed again, and how often


class Switch(NamedTuple):
    """target : what is replaced, as "module:name", or "module:Class.name". off : makes
    of it what stands there without it. used : the functions, or such names of them,
    whose calls tell that a problem uses it, if not those of the target."""

    name: str
    target: str
    off: Callable[[Any], Any]
    used: tuple[Any, ...] = ()


def never(_):
    """A condition that does not hold."""
    return lambda *_, **__: False


def nothing(_):
    """A function that has no answer."""
    return lambda *_, **__: None


def constant(value):
    return lambda _: value


def lacking(*numbers):
    """A table without rows of these numbers."""
    return lambda table: tuple(row for i, row in enumerate(table) if i not in numbers)


def empty(_):
    """A generator of nothing."""
    return lambda *_, **__: iter(())


def fails(_):
    """A stage that ends at once."""

    def stage(*_, **__):
        from lcpcli.methods.stages import Breakdown

        yield from ()
        return Breakdown("it is switched off")

    return stage


def stalls(_):
    """A stage that leaves the problem to the next one."""

    def stage(*_, **__):
        from lcpcli.methods.stages import Stalled

        yield from ()
        return Stalled("it is switched off")

    return stage


def passes(_):
    """`finish` without what it adds to its stage."""

    def finish(_, __, stage):
        return (yield from stage)

    return finish


def prop(value):
    """A property of this value."""
    return lambda _: property(lambda _: value)


def edited(*changes):
    """The function with other words in its source."""

    def off(function):
        plain = inspect.unwrap(getattr(function, "func", function))
        source = textwrap.dedent(inspect.getsource(plain))
        for before, after in changes:
            assert source.count(before) == 1, f"{before!r} in {plain.__qualname__}"
            source = source.replace(before, after)
        names = {}
        exec("from __future__ import annotations\n" + source, plain.__globals__, names)
        return names[plain.__name__]

    return off


def without(*fields):
    """A table without its row that begins with these words, or has this key."""

    def off(table):
        if isinstance(table, dict):
            return {key: table[key] for key in table if key not in fields}
        left = tuple(row for row in table if row[: len(fields)] != fields)
        assert len(left) == len(table) - 1, fields
        return left

    return off


def _units(M):
    from lcpcli.linalg.units import units

    return units(M)


def _confirmed(z, basis):
    from lcpcli.verify.final_states import VerifiedPoint

    return VerifiedPoint(z, basis)


def _in_range(problem, y):
    from lcpcli.verify import certificate

    return certificate._in_range(problem, y)


def _no_improvement(*_):
    yield from ()
    return False


def begun(row):
    """Return the function that is called where an attempt of auto begins."""
    for cell in row.begin.__closure__ or ():
        if isinstance(cell.cell_contents, str):
            module, _, name = cell.cell_contents.partition(".")
            found = getattr(importlib.import_module(f"lcpcli.methods.{module}"), name)
            return getattr(found, "func", found)
    return row.begin


def rows():
    """A switch for each row of the table of auto, and for each rule of presolve."""
    from lcpcli.auto import attempts
    from lcpcli.presolve import presolve

    for phase in ("FIRST", "BRIEF", "LATER"):
        for i, row in enumerate(getattr(attempts, phase)):
            yield Switch(
                f"auto {phase} {row.method} {row.part}".strip(),
                f"auto.attempts:{phase}",
                lacking(i),
                (begun(row),),
            )
    for rule in presolve.RULES:
        yield Switch(
            f"presolve {rule}",
            "presolve.presolve:RULES",
            without(rule),
            (f"presolve.rules:{presolve.RULES[rule].__name__}",),
        )
    yield Switch(
        "presolve signs of equations",
        "presolve.presolve:signs_of_equations",
        constant(lambda _: ()),
    )
    yield Switch(
        "presolve", "auto.attempts:PRESOLVE", lambda row: row._replace(applies=never(0))
    )


U, P, J = "linalg.units", "verify.point:", "methods.josephy_newton:_JosephyNewton."
SWITCHES = (
    # The units of rows and columns, by six routes.
    Switch(
        "units of a band",
        f"{U}:_sparse",
        edited(
            (
                "counts.max(initial=0.0) <= 2 * BAND + 1 and "
                "(farthest := width(M)) <= BAND",
                "False",
            )
        ),
        (f"{U}:_banded",),
    ),
    Switch(
        "units of symmetric M by gradients",
        f"{U}:_sparse",
        edited(
            (
                "elif n > FEW_AS_DENSE and (n > FEW_SYMMETRIC or M.nnz > THIN * n):",
                "elif False:",
            )
        ),
        (f"{U}:_symmetric",),
    ),
    Switch(
        "units by elimination",
        f"{U}:_sparse",
        edited(
            (
                "elif n > FEW_AS_DENSE and (n > FEW_SYMMETRIC or M.nnz > THIN * n):",
                "else:",
            ),
            ("if not has_converged and n <= LARGEST_ELIMINATED:", "if False:"),
        ),
        (f"{U}:_eliminated",),
    ),
    Switch("units of dense M", f"{U}:_dense", nothing),
    Switch("units of few rows at once", f"{U}:MAX_DENSE", constant(0)),
    # Sparse problems.
    Switch("krylov", "methods.active_set:krylov", fails),
    Switch(
        "multilevel",
        "methods.active_set:multilevel",
        fails,
    ),
    Switch(
        "pivoting near wrong signs",
        "methods.active_set:_pivot_locally",
        constant(
            lambda own, found: own.box.exchanged(found.basis, found.wrong, found.z)
        ),
    ),
    Switch(
        "stencils", "linalg.stencils:_stencil", nothing, ("linalg.stencils:_Stencil",)
    ),
    Switch(
        "thin dense M as sparse",
        "auto.attempts:Structure.thin",
        lambda _: property(lambda self: self.problem),
    ),
    Switch("stiff", "auto.attempts:Structure.is_stiff", prop(False)),
    Switch(
        "definite at the start of interior",
        "methods.interior:definite",
        fails,
    ),
    Switch(
        "friction",
        "auto.attempts:Structure.is_frictional",
        prop(False),
    ),
    Switch(
        "presolve where it may gain",
        "auto.attempts:Structure.may_gain_by_presolve",
        prop(True),
    ),
    Switch("unsure", "auto.attempts:Structure.is_unsure", prop(False)),
    Switch("suspended attempts", "auto.attempts:MAX_HELD", constant(0)),
    Switch("no elimination", "auto.attempts:may_be_eliminated", never),
    # Factors.
    Switch(
        "updated factors",
        "linalg.factors:PrincipalSolver._updated",
        nothing,
    ),
    Switch(
        "ordered factors",
        "linalg.shifted_systems:dense_places",
        constant(lambda _: np.empty(0, dtype=np.intp)),
        ("linalg.shifted_systems:Bordered",),
    ),
    Switch(
        "sides of systems by LDL",
        "linalg.shifted_systems:has_qdldl",
        never,
        ("linalg.shifted_systems:LDL",),
    ),
    Switch("once factorized", "linalg.shifted_systems:MAX_AT_ONCE", constant(0.0)),
    # Newton and pivoting.
    Switch(
        "projected gradient",
        "methods.newton:projected_gradient",
        fails,
    ),
    Switch("finish", "methods.newton:finish", passes),
    Switch(
        "refined basic solutions",
        "basis.exchanges:BasisSolver._accurate_basic_solution",
        edited(("for refines in (True, False):", "for refines in (False,):")),
    ),
    Switch(
        "neighbours in batches",
        "methods.block_pivoting:_neighbours",
        constant(lambda q: (np.arange(len(q)), np.zeros(len(q), dtype=bool))),
    ),
    Switch(
        "gradients in batches",
        "methods.block_pivoting:_start",
        constant(
            lambda frame, _, __: (
                frame.box.basis_of(-0.5 * frame.q),
                np.zeros(frame.q.shape[0], dtype=bool),
            )
        ),
    ),
    Switch(
        "lemke small components",
        "methods.lemke:refine_small_components",
        constant(lambda _, z, __: z),
    ),
    Switch(
        "integer path",
        "methods.lemke:MAX_INTEGER_UNKNOWNS",
        constant(0),
        ("methods.lemke:_integer_path",),
    ),
    # Quick attempts before the loop.
    *(
        Switch(f"quick {i} {word}", "solving.direct_run:QUICK", lacking(*i), used)
        for i, word, used in (
            (
                (0,),
                "proposals of a formulation",
                ("solving.direct_run:proposed_steps",),
            ),
            ((1, 3), "programs by PIQP", ("solving.direct_run:program_steps",)),
            (
                (2,),
                "pivoting",
                (
                    "solving.direct_run:direct_steps",
                    "solving.direct_run:first_steps",
                    "solving.direct_run:_answer",
                ),
            ),
        )
    ),
    *(
        Switch(
            f"in sequence {i} {word}",
            "solving.direct_run:IN_SEQUENCE",
            lacking(i),
            used,
        )
        for i, word, used in (
            (0, "elimination", ("solving.direct_run:elimination_steps",)),
            (1, "proposals", ("solving.direct_run:proposed_steps",)),
            (2, "pivoting", ("solving.direct_run:direct_steps",)),
            (
                3,
                "near",
                (
                    "solving.direct_run:last_basis_steps",
                    "solving.direct_run:_from_last_basis",
                ),
            ),
        )
    ),
    Switch("kernels", "solving.direct_run:compiled", nothing),
    Switch(
        "kernels of entries",
        "solving.direct_run:acceptance_test",
        constant(lambda *_: (None, None)),
    ),
    Switch("basic zeros", "methods.direct:basic_zeros", nothing),
    # The interior point method.
    Switch("interior at a point", "methods.interior:at_point", fails),
    Switch(
        "interior exchanges",
        "methods.interior:Run._exchanged",
        empty,
    ),
    Switch(
        "interior gmres",
        "methods.interior_steps:RefinedShiftedSolver.solve",
        edited(
            (
                "if refined.size > max(10 * goal, DOUBTFUL_RESIDUAL * size):",
                "if False:",
            )
        ),
        ("linalg.krylov:gmres",),
    ),
    Switch(
        "interior Ruiz",
        "methods.interior_steps:_ruiz",
        constant(lambda M, _: np.exp2(np.rint(sum(_units(M)[:2]) / 2))),
    ),
    # What a point is worth.
    Switch("alternatives of a point", P + "Point.alternatives", empty),
    Switch(
        "idle multipliers, noise",
        P + "Point._without_noise",
        empty,
    ),
    Switch(
        "idle multipliers", P + "without_idle_multipliers", constant(lambda _, z, __: z)
    ),
    Switch("small components", P + "with_small_components", empty),
    Switch("small distances", P + "without_small_distances", constant(lambda _, z: z)),
    Switch(
        "negligible q",
        P + "negligible_q",
        constant(lambda _, __, ___, ____, rows: rows[:0]),
    ),
    Switch(
        "rounded rows",
        "model.problem:Problem.rounded_rows",
        prop(None),
        ("model.rounded_rows:RoundedRows",),
    ),
    Switch("decision by bounds", P + "decision", nothing),
    Switch("surely solves", "verify.measure:Measure.surely_solves", never),
    Switch("surely fails", "verify.measure:Measure.surely_fails", never),
    Switch(
        "terms rounded once",
        "verify.measure:Measure.doubtful",
        constant(lambda _, z, *__: np.zeros(z.size, dtype=bool)),
    ),
    Switch(
        "solutions beside",
        "verify.acceptance:_up_to_small_entries",
        nothing,
    ),
    Switch(
        "rounded differences", "verify.nearby_solutions:is_rounded_difference", never
    ),
    Switch("run-offs", "verify.nearby_solutions:is_run_off", never),
    Switch("rounded solutions", "verify.nearby_solutions:is_rounded_solution", never),
    Switch("large solutions", "verify.nearby_solutions:large_solution", nothing),
    Switch(
        "exact confirmation",
        "verify.acceptance:verified_or_exact",
        constant(lambda _, z, basis=None: _confirmed(z, basis)),
    ),
    Switch(
        "bounds on open signs",
        "verify.enclosure:open_signs",
        constant(lambda _, q, *__: np.ones(len(q), dtype=bool)),
    ),
    # Proofs.
    Switch(
        "whole proofs",
        "verify.certificate:_whole",
        lambda _: _in_range,
    ),
    Switch("simple proofs", "verify.farkas:_simple", empty),
    Switch("proofs with room", "verify.alternative:with_margin", empty),
    Switch(
        "proofs up to rounding",
        "verify.farkas:cancellation",
        constant(lambda *_: 0.0),
    ),
    Switch(
        "proofs near a point",
        "verify.certificate:proof_near",
        nothing,
    ),
    Switch("proofs by dictionaries", "verify.alternative:dictionaries", empty),
    Switch("proofs of interior", "methods.interior_steps:proof_of", nothing),
    # Auto around its table.
    Switch(
        "far sides",
        "model.problem:Problem.has_far_sides",
        prop(False),
        ("model.changes:relaxed",),
    ),
    Switch("exact arithmetic", "auto.policy:exactly", stalls),
    Switch(
        "without doubt",
        "auto.policy:_with_doubtful_points_exact",
        edited(("step.signs_final and is_doubtful(problem, z)", "False")),
    ),
    Switch("improved points", "auto.policy:_improved", constant(_no_improvement)),
    # Nonlinear problems.
    *(
        Switch(f"nonlinear {name}", J + name, off)
        for name, off in (
            ("crash", empty),
            ("smoothed", empty),
            ("_active_step", nothing),
            ("downhill", nothing),
            ("_farther", constant(lambda _, __, ___, reached: reached)),
        )
    ),
)


def place(target):
    """Return the module or class that has the target, and its name there."""
    module, _, names = target.partition(":")
    *outer, name = names.split(".")
    found = importlib.import_module(f"lcpcli.{module}")
    for each in outer:
        found = getattr(found, each)
    return found, name


@contextlib.contextmanager
def switched(target, off):
    """Replace the target in all modules of the package that have imported it."""
    owner, name = place(target)
    before = inspect.getattr_static(owner, name)
    after = off(before)
    owners = [owner]
    if inspect.ismodule(owner):
        owners = [
            module
            for key, module in list(sys.modules.items())
            if key.startswith("lcpcli") and vars(module).get(name) is before
        ]
    for each in owners:
        setattr(each, name, after)
    try:
        yield
    finally:
        for each in owners:
            setattr(each, name, before)


class Sampled:
    """A problem of the sample: how its outcome is computed, and what it was at first.

    calls : the functions of the package that its run calls, as (file, first line).
    """

    def __init__(self, population, case):
        self.key = f"{population.__name__} {case.key}"
        self._population, self._case = population, case
        self.calls: frozenset[tuple[str, int]] = frozenset()
        self.entry: dict[str, Any] = {}
        self.seconds = np.inf

    def run(self):
        """Return the outcome and the processor time, without that of making the
        problem."""
        made = self._case.make()
        start = time.process_time()
        try:
            entry = self._population.outcome(self._case, made)
        except Exception as error:
            entry = {"status": f"{type(error).__name__}: {error}"}
        return entry, time.process_time() - start

    def begin(self):
        """Run it with a list of the functions called, and again for the time."""
        called = set()

        def note(frame, event, _):
            if event == "call":
                code = frame.f_code
                called.add((code.co_filename, code.co_firstlineno))

        with contextlib.suppress(LCPError):  # of a file that is no problem
            self.entry, seconds = self.run()
        if not self.entry or seconds > SLOWEST:
            return
        sys.setprofile(note)
        try:
            self.run()
        finally:
            sys.setprofile(None)
        self.calls = frozenset(each for each in called if each[0].startswith(PACKAGE))
        self.seconds = min(self.run()[1] for _ in range(2))


class Bench:
    """The rows of `bench_rows` as a population."""

    __name__ = "bench"

    def __init__(self, folder):
        self.rows = bench_rows.rows(folder, [])

    def cases(self, _):
        large = [
            Case(f"large {family} {n}", bench_rows.of_family(family, n))
            for family, n in LARGE
        ]
        return large + [
            Case(name, prepare)
            for name, prepare in self.rows.items()
            if not name.startswith(("start-up", "on request"))
        ]

    def outcome(self, _, call):
        found = call()
        if not hasattr(found, "status"):
            return {"status": "done"}
        return {"status": found.status.word, "iterations": found.iterations}


def sample(folder, data):
    """Return problems of all kinds, each of which takes at most SLOWEST."""
    random, found = np.random.default_rng(0), []
    # Not by one process for each problem.
    populations.gallery = families.make
    bench_rows.made = lambda family, n, *parameters: families.make(
        family, n, **dict(parameter.split("=") for parameter in parameters)
    )
    for population in (*POPULATIONS, Bench(folder)):
        if hasattr(population, "GENEROUS_SECONDS"):
            population.GENEROUS_SECONDS = LIMIT
        arguments = (0, data) if population is verdicts and data else (0,)
        kinds = defaultdict[str, list[Any]](list)
        for case in population.cases(*arguments):
            kinds[kind_of(case.key)].append(case)
        most = max(OF_A_KIND, OF_A_POPULATION // len(kinds))
        for cases in kinds.values():
            picked = random.permutation(len(cases))[:most]
            for k in sorted(picked):
                found.append(Sampled(population, cases[k]))
                found[-1].begin()
    return [each for each in found if each.calls]


def kind_of(key):
    """Return the kind of a case: the folder of a file, or two words of the key."""
    if key.startswith("file "):
        return key.rpartition("/")[0]
    return " ".join([word for word in key.split() if not word.isdigit()][:2])


def is_verdict(entry):
    return entry["status"] == "solved" or bool(entry.get("proof"))


def used_by(switch, sampled):
    """Return the problems whose run uses what the switch turns off; all of them if
    that cannot be told from the functions that it calls."""
    codes = set()
    for each in switch.used or (switch.target,):
        found = each if callable(each) else inspect.getattr_static(*place(each))
        function = getattr(found, "func", getattr(found, "fget", found))
        function = inspect.unwrap(function) if callable(function) else function
        if inspect.isclass(found):
            function = vars(found).get("__init__")
        if hasattr(function, "__code__"):
            code = function.__code__
            codes.add((code.co_filename, code.co_firstlineno))
    return [each for each in sampled if not codes or each.calls & codes]


def ratio(each, switch):
    """Return the ratio of time, off over on, the median of pairs."""
    ratios = []
    for _ in range(PAIRS):
        seconds = []
        for off in (lambda on: on, switch.off):
            with switched(switch.target, off):
                seconds.append(min(each.run()[1] for _ in range(2)))
        ratios.append(seconds[1] / seconds[0])
    return median(ratios)


def row(switch, sampled):
    """Return the row of the table for a switch."""
    used = used_by(switch, sampled)
    chosen = used
    if len(used) > OF_A_SWITCH:
        picked = np.random.default_rng(1).permutation(len(used))[:OF_A_SWITCH]
        chosen = [used[k] for k in sorted(picked)]
    lost, gained, other, false = ([] for _ in range(4))
    counts, seconds, slow = np.zeros(2), np.zeros(2), []
    changed = 0
    with switched(switch.target, switch.off):
        for each in chosen:
            entry, took = each.run()
            if is_verdict(each.entry) and not is_verdict(entry):
                lost.append(f"{each.key}: {entry['status'][:60]}")
            elif is_verdict(entry) and not is_verdict(each.entry):
                gained.append(each.key)
            elif entry["status"] != each.entry["status"]:
                other.append(each.key)
            if entry.get("false") and not each.entry.get("false"):
                false.append(each.key)
            work = (each.entry.get("iterations", 0), entry.get("iterations", 0))
            counts += work
            changed += entry != each.entry
            seconds += each.seconds, took
            if max(took, each.seconds) > CLEAR_SECONDS:
                slow.append((took / each.seconds, each))
    slow.sort(key=lambda pair: -pair[0])
    timed = [(ratio(each, switch), each.key) for _, each in slow[:REPEATED]]
    worst, key = max(timed, default=(1.0, "-"))
    numbers = [len(used), len(chosen), *map(len, (lost, gained, other, false))]
    numbers.append(changed)
    words = "; ".join((*lost[:3], *(f"FALSE {each}" for each in false[:3])))
    iterations = counts[1] / max(counts[0], 1)
    times = f"{iterations:.2f} | {seconds[1] / max(seconds[0], 1e-9):.2f}"
    cells = " | ".join(map(str, numbers))
    return f"| {switch.name} | {cells} | {times} | {worst:.2f} {key} | {words} |"


def tried(switch, sampled):
    """Return its row, or why it cannot be switched off."""
    try:
        return row(switch, sampled)
    except (AssertionError, AttributeError, ImportError) as error:
        return f"| {switch.name} | {type(error).__name__}: {error} |"


HEAD = (
    "| switched off | use it | run | lost | gained | other | false | changed "
    "| iterations | time | slowest | which |\n|" + " --- |" * 12
)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, help="a folder of problem files")
    parser.add_argument("--only", nargs="+", default=[""], help="beginnings of names")
    asked = parser.parse_args()
    with TemporaryDirectory() as folder:
        sampled = sample(Path(folder), asked.data)
        total = sum(each.seconds for each in sampled)
        print(f"{len(sampled)} problems, {total:.0f} s of processor time\n\n{HEAD}")
        for switch in [*SWITCHES, *rows()]:
            if switch.name.startswith(tuple(asked.only)):
                print(tried(switch, sampled), flush=True)


if __name__ == "__main__":
    main()
