"""The columns of the iterates: the step of each method in numbers, which lead from each
iterate to the next by the formulas of the paper, written here anew; --columns in every
format, and what it refuses; nothing is computed unless it is asked for."""

import csv
import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lcpcli import Problem, Trace, read, run
from lcpcli.cli.help import PAGES
from lcpcli.files import contents
from lcpcli.methods import fixed_point, shi
from lcpcli.methods.registry import METHODS, QUANTITIES
from lcpcli.report import columns
from lcpcli.report.wording import components, halves

EXAMPLES = [f"paper-example-{number}" for number in (1, 2)]
EPS = 2.0**-52
ACCURACY = 1e-12  # relative


def problem_of(name):
    return read(contents.shipped_path(f"{name}.json"))


class Paper:
    """F~, J and what follows from them, as the paper defines them in section 4."""

    def __init__(self, problem, p):
        self.M, self.q, self.p = np.array(problem.M), np.array(problem.q), p
        self.I = np.eye(self.q.size)

    def phi(self, x):
        px = self.p * x
        return np.asarray(np.logaddexp.reduce([np.zeros_like(px), px, -px]) / self.p)

    def F(self, x):
        linear = (self.M + self.I) @ x
        return np.asarray(linear + (self.M - self.I) @ self.phi(x) + self.q)

    def d(self, x):
        a = np.exp(-np.abs(self.p * x))
        E = np.diag(np.sign(x) * (1 - a * a) / (1 + a + a * a))
        J = self.M + self.I + (self.M - self.I) @ E
        return np.asarray(-J.T @ self.F(x))

    def terms(self, x):
        """The size of the terms of F~, whose rounding no formula for F~ escapes."""
        sizes = (np.abs(self.M) + self.I) @ (np.abs(x) + self.phi(x)) + np.abs(self.q)
        return float(np.linalg.norm(sizes))

    def direction(self, row, x, before):
        """s of steps 2.1 to 2.6 at x, by the numbers of the row."""
        if row["step"] in ("1", "2.2", "2.6"):
            return self.d(x)
        u, v = row["xi1"] * self.F(x), row["xi2"] * (x - before)
        if row["step"] == "2.5":
            return np.asarray((u + v) / 2)
        if row["alpha"] is None:
            return np.asarray(np.sign((u - v) @ self.d(x)) * (u - v))
        return np.asarray(row["alpha"] * u + (1 - row["alpha"]) * v)


STEPS = {
    "by default": "",
    "smoothed": "--p 50",
    "steepest descent": "--k-star 3",
    "other line searches": "--rho 0.1 --sigma 0.5 --x1 1,-1,1,-1",
}


@pytest.mark.parametrize("options", STEPS.values(), ids=STEPS)
@pytest.mark.parametrize("name", EXAMPLES)
def test_each_row_of_shi_leads_to_its_x_by_the_formulas_of_the_paper(
    name, options, lcp
):
    found = lcp(f"solve {name} --method shi --columns all -f json {options}").record
    paper = Paper(problem_of(name), found["options"]["p"])
    rho, sigma = found["options"]["rho"], found["options"]["sigma"]
    rows = found["trace"]
    xs = [np.array(row["x"]) for row in rows]
    for k, (row, x) in enumerate(zip(rows, xs, strict=True)):
        assert row["z"] == (np.abs(x) + x).tolist()
        F = paper.F(x)
        size, rounding = float(np.linalg.norm(F)), EPS * paper.terms(x)
        assert row["F"] == pytest.approx(size, rel=ACCURACY, abs=rounding)
        assert row["f"] == pytest.approx(
            F @ F / 2, rel=ACCURACY, abs=(size + rounding) * rounding
        )
        if row["length"] is None:
            assert k == 0 or (k == 1 and "--x1" in options)
            continue
        s = paper.direction(row, xs[k - 1], xs[k - 2])
        assert x == pytest.approx(xs[k - 1] + row["length"] * s, rel=ACCURACY)
        last, d = rows[k - 1], paper.d(xs[k - 1])
        if last["F"] > 1e-3:
            assert row["d"] == pytest.approx(d, rel=1e-10)
            assert row["s"] == pytest.approx(s, rel=1e-10)
            assert row["slope"] == pytest.approx(-d @ s, rel=1e-11)
            decrease = row["length"] * rho * row["slope"]
            assert row["f"] <= last["f"] + decrease
            assert -paper.d(x) @ s >= sigma * row["slope"]
    spent = 1 + sum(row["trials"] or 0 for row in rows) + ("--x1" in options)
    assert spent == found["evaluations"]
    assert len({row["step"] for row in rows} - {None}) >= 2


@st.composite
def small_problems(draw):
    """In integers, so that vectors are often parallel or at right angles."""
    n = draw(st.integers(1, 3))
    vectors = arrays(float, n, elements=st.integers(-3, 3))
    M = draw(arrays(float, (n, n), elements=st.integers(-3, 3)))
    if draw(st.booleans()):
        M = M @ M.T + np.eye(n)
    return Problem(M, draw(vectors)), draw(vectors), draw(vectors)


def size_of(v):
    """|v|, without overflow."""
    largest = float(np.abs(v).max())
    return largest * float(np.linalg.norm(v / largest)) if largest > 0 else largest


def sine(F, v):
    F, v = F / size_of(F), v / size_of(v)
    return size_of(F - (F @ v) * v)


def assert_steps_lead_on(problem, x0, x1, p=1e12):
    """Check that the quantities of each row lead to its x, up to the rounding of x,
    which the plane of F~ and the last step enlarges by |x| over the length of that
    step, unless they are parallel. Return the row after x1, if there is one."""
    trace = Trace(columns=("all",))
    how = {"p": p, "max_iterations": 12}
    run(problem, "shi", x0=x0, x1=x1, trace=trace, **how)
    paper, rows = Paper(problem, p), trace.rows
    for first, second, row in zip(rows, rows[1:], rows[2:], strict=False):
        own = {**row.quantities, "step": row.step}
        x, before = second.x, first.x
        assert x is not None
        assert before is not None
        F, step = paper.F(x), x - before
        is_plane = row.step in ("2.4", "2.5")
        # F~, or the last step, is rounding.
        if size_of(F) <= 100 * EPS * paper.terms(x) or (
            is_plane and size_of(step) <= 1e-6 * size_of(x)
        ):
            continue
        enlarged = 1 + paper.terms(x) / size_of(F)
        has_u = own["u"] is not None
        is_parallel = is_plane and has_u and sine(F, step) ** 2 <= 16 * EPS
        if not (is_plane and has_u) or is_parallel:
            s, parts = own["s"], size_of(own["s"])
            if is_parallel:
                parts += size_of(own["u"]) + size_of(own["v"])
                enlarged += size_of(x) / size_of(step)
        else:
            s, alpha = paper.direction(own, x, before), own["alpha"]
            # On which side of d it lies is rounding if they are at right angles.
            s = s if s @ own["s"] > 0 else -s
            share = 1.0 if alpha is None else max(1.0, abs(alpha))
            parts = share * (size_of(own["u"]) + size_of(own["v"]))
            enlarged += size_of(x) / size_of(step)
        bound = 64 * EPS * (size_of(x) + own["length"] * parts * enlarged)
        assert np.abs(x + own["length"] * s - row.x).max() <= bound
    return rows[2] if len(rows) > 2 else None


@settings(max_examples=30)
@given(small_problems())
def test_steps_lead_to_the_next_x(drawn):
    assert_steps_lead_on(*drawn)


# M, q, x0 and x1, and of the step from x1 its number, and which of xi_1 and alpha it
# has.
KINDS = {
    "alpha infinite": ([[-1, 0], [1, 0]], [1, -2], [0, -1], [1, -1], "2.4", "xi1"),
    "xi_1 infinite": ([[1, -2], [-2, 0]], [0, -1], [0, 0], [0, 1], "2.4", ""),
    "u best": ([[0, 0], [0, 0]], [0, -1], [-1, 3], [0, -1], "2.4", "xi1 alpha"),
    "v best": ([[0, -2], [2, 0]], [1, -2], [2, 0], [-1, 0], "2.4", "xi1 alpha"),
    "u = v": ([[0]], [-1], [-1], [0], "2.5", "xi1"),
    "both ascend": ([[-2]], [-1], [-1], [0], "2.6", "xi1"),
    "no last step": ([[0]], [-1], [0], [0], "2.6", ""),
    "F does not change": ([[-1]], [-1], [-1], [1], "2.6", ""),
}


@pytest.mark.parametrize("kind", KINDS)
def test_steps_lead_on_where_the_paper_leaves_them_undefined(kind):
    M, q, x0, x1, step, defined = KINDS[kind]
    problem = Problem(np.array(M, float), np.array(q, float))
    points = np.array(x0, float), np.array(x1, float)
    row = assert_steps_lead_on(problem, *points, p=1e300)
    assert row.step == step
    own = row.quantities
    assert [n for n in ("xi1", "alpha") if own[n] is not None] == defined.split()
    if kind in ("u best", "v best"):
        assert abs(own["alpha"]) == float(kind == "u best")


@pytest.mark.parametrize("options", ["", ":omega=2", ":anderson=3"])
@pytest.mark.parametrize("name", EXAMPLES)
def test_each_row_of_fixed_point_is_an_iterate_of_Schäfer(name, options, lcp):
    asked = f"solve {name} -m fixed-point{options} --columns all"
    rows = lcp(f"{asked} -f json").record["trace"]
    problem = problem_of(name)
    M, q, omega = np.array(problem.M), np.array(problem.q), rows[1]["omega"]
    identity, last = omega * np.eye(4), None
    for k, row in enumerate(rows):
        x = np.array(row["x"])
        F = (identity + M) @ x - (identity - M) @ np.abs(x) + q
        terms = float(np.linalg.norm((identity + np.abs(M)) @ np.abs(2 * x)))
        rounding = EPS * (terms + float(np.linalg.norm(q)))
        assert row["F"] == pytest.approx(
            np.linalg.norm(F), rel=ACCURACY, abs=4 * rounding
        )
        if last is None:
            assert row["factor"] is None
        else:
            assert row["factor"] == row["F"] / rows[k - 1]["F"]
        if last is not None and "anderson" not in options:
            right = (identity - M) @ np.abs(last) - q
            assert (identity + M) @ x == pytest.approx(right, rel=ACCURACY)
        last = x


@given(
    st.floats(-1e9, 1e9).map(lambda v: v * 10.0 ** -(abs(v) % 9)),
    st.sampled_from([0.0, 1e-5, 1.0, 1e7]),
)
def test_printed_x_has_the_printed_z_as_its_double(v, largest):
    """Also w for x < 0. The digits are compared, as doubles would round them again."""
    for own in (v, abs(v), -abs(v)):
        (x,), (z,) = halves([own], largest), components([2 * abs(own)], largest)
        unit = Fraction(10) ** (int(z.partition("e")[2] or "0"))
        unit *= Fraction(10) ** -len(z.partition("e")[0].partition(".")[2])
        twice = 2 * abs(Fraction(x))
        assert abs(twice - Fraction(z)) <= unit / 2


@pytest.mark.parametrize("method", [*METHODS])
def test_iterates_are_the_same_bit_for_bit_with_all_columns(method):
    problem = problem_of("paper-example-2")
    plain, asked = Trace(keeps_x=True), Trace(keeps_x=True, columns="all")
    for trace in (plain, asked):
        run(problem, method, trace=trace)
    assert [row.x.tobytes() for row in plain.rows if row.x is not None] == [
        row.x.tobytes() for row in asked.rows if row.x is not None
    ]
    assert all(not row.quantities for row in plain.rows)
    named = {own.name for own in METHODS[method].quantities} - {"x"}
    assert set().union(*(row.quantities for row in asked.rows)) <= {*QUANTITIES}
    assert {*asked.rows[0].quantities} == named


def test_nothing_is_computed_unless_it_is_asked_for(monkeypatch):
    def fails(_):
        raise AssertionError("not asked for")

    for owner, name in ((shi.Step, "u"), (shi.Selected, "f")):
        monkeypatch.setattr(owner, name, property(fails))
    monkeypatch.setattr(fixed_point.Residual, "factor", property(fails))
    monkeypatch.setattr(fixed_point.Start, "F", property(fails))
    problem = problem_of("paper-example-1")
    for method, names in (("shi", ("x", "alpha")), ("fixed-point", ("omega",))):
        for trace in (True, Trace(keeps_x=True), Trace(columns=names)):
            assert run(problem, method, trace=trace).solved
    with pytest.raises(AssertionError, match="not asked for"):
        run(problem, "shi", trace=Trace(columns=("f",)))


def test_a_trace_keeps_the_columns_of_the_rows_and_components_that_it_keeps():
    problem = problem_of("paper-example-1")
    whole = Trace(columns=("x", "u", "f"))
    part = Trace(10, None, np.array([1, 3]), columns=("x", "u", "f"))
    for trace in (whole, part):
        run(problem, "shi", trace=trace)
    kept = {row.k: row for row in whole.rows}
    chosen = whole.selected(10, None, np.array([1, 3]))
    assert [row.k for row in chosen.rows] == [row.k for row in part.rows]
    for own in (*part.rows, *chosen.rows):
        row = kept[own.k]
        assert own.x.tolist() == row.x[[1, 3]].tolist()
        assert own.quantities["f"] == row.quantities["f"]
        u, shown = row.quantities["u"], own.quantities["u"]
        assert (u is None) == (shown is None)
        assert u is None or shown.tolist() == u[[1, 3]].tolist()


def test_a_callback_reads_the_quantities_of_the_step():
    seen = []

    def callback(row):
        seen.append(row.quantities["f"])
        return len(seen) == 3

    trace = Trace(columns=("f",))
    run(problem_of("paper-example-1"), "shi", callback=callback, trace=trace)
    assert [row.quantities["f"] for row in trace.rows[1:]] == seen


def table(out):
    """The words of the table of iterates."""
    lines = [line.split() for line in out.splitlines()]
    first = next(i for i, words in enumerate(lines) if words[:1] == ["method"])
    return lines[first : first + 5]


def test_columns_are_the_same_numbers_in_every_format(lcp):
    asked = "solve paper-example-2 --method shi --columns k,x,alpha,u"
    rows = lcp(f"{asked} -f json").record["trace"]
    text = lcp(f"{asked} -f csv").out
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    listed = list(csv.DictReader(lines))
    assert [*listed[0]][2:-1] == ["k", "x1", "x2", "x3", "x4", "alpha"] + [
        f"u{i}" for i in range(1, 5)
    ]
    for row, own in zip(rows, listed, strict=True):
        assert [float(own[f"x{i}"]) for i in range(1, 5)] == row["x"]
        assert own["alpha"] == ("" if row["alpha"] is None else repr(row["alpha"]))
        u = row["u"] or [""] * 4
        assert [own[f"u{i}"] for i in range(1, 5)] == [str(value) for value in u]


def test_help_lists_the_columns_of_a_method(lcp):
    for method, declared in METHODS.items():
        out = lcp(f"help {method}").out.partition("Columns of the iterates")[2]
        names = re.findall(r"^  (\w+)  ", out, re.MULTILINE)
        own = [quantity.name for quantity in declared.quantities]
        assert {*own, *columns.OF_EVERY_METHOD} == {*names}, method


def numbers(text):
    return [Fraction(word) for word in re.findall(r"-?\d+(?:/\d+)?", text)]


def section(name):
    return PAGES["methods"].partition(f"\n## {name}\n")[2].partition("\n## ")[0]


def vector(text, before):
    """The numbers in parentheses after some words of a page, where a factor may
    follow."""
    found = re.search(
        rf"{re.escape(before)}\s*(\([^()]*\))(?:\s*/\s*(\d+))?", " ".join(text.split())
    )
    assert found, before
    return [own / int(found[2] or 1) for own in numbers(found[1])]


def test_the_step_of_shi_on_its_page_is_that_of_its_command(lcp):
    """Whose rows are tested above by the formulas of the paper."""
    page = section("shi")
    x0, x1 = vector(page, "from x_0 ="), vector(page, "and x_1 =")
    start = [",".join(str(float(t)) for t in each) for each in (x0, x1)]
    asked = f"--method shi --x0 {start[0]} --x1 {start[1]}"
    how = "--max-iterations 2 --columns all -f json"
    row = lcp(f"solve paper-example-1 {asked} {how}").record["trace"][2]
    step = page.partition("**One step")[2]
    for words, name in (
        (" u =", "u"),
        (" v =", "v"),
        (" s =", "s"),
        ("d = -J'F~ =", "d"),
        ("x_1 + s/17 =", "x"),
    ):
        assert floats(vector(step, words)) == pytest.approx(row[name]), name
    text = " ".join(page.split())
    for pattern, name in (
        (r"= (\S+) and xi_2 =", "xi1"),
        (r"= (\S+), so that u", "xi2"),
        (r"alpha = (\S+), beyond", "alpha"),
        (r"= (\S+)\. The first trial gamma", "slope"),
        (r"= (\S+), and x_2", "length"),
        (r"f = 336/2601 = ([\d.]+)", "f"),
    ):
        found = re.search(pattern, text)
        assert found, pattern
        assert float(Fraction(found[1])) == pytest.approx(row[name], abs=1e-7), name


def test_the_step_of_fixed_point_on_its_page_is_that_of_its_command(lcp):
    page = section("fixed-point")
    x0, x1 = (floats(vector(page, words)) for words in ("from x_0 =", "this for x_1 ="))
    how = "--max-iterations 1 --columns all -f json"
    asked = f"--method fixed-point --x0 {','.join(map(str, x0))}"
    row = lcp(f"solve paper-example-1 {asked} {how}").record["trace"][1]
    assert row["x"] == pytest.approx(x1, rel=ACCURACY)
    assert f"= {row['factor']:.7f}" in " ".join(page.split())


def floats(values):
    return np.array([float(value) for value in values])
