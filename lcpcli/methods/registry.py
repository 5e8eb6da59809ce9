"""The methods, each declared once, for the command line, the library, help, completion
and diagnosis.

To add one, write a file with its function, and a line in METHODS. A method is a
function (problem, x0, *, options) that sets itself up and returns a generator. This
yields `Iterate(x, F, step, evaluations)`s with x = (z - w) / 2 and returns one of the
endings in `stages`; x0 is the starting x, of shape (n,). Its options have the meaning
that is declared here, and have been checked. It is imported on request.

A variant is a method with values for its options, written shi:p=10,k-star=5; a sweep
makes one for each value. Nothing heavy is imported, so that a mistake in a variant is
reported at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from lcpcli import options
from lcpcli.clock import imports
from lcpcli.errors import (
    LEAVE_ONE_OUT,
    LEAVE_OUT,
    OptionError,
    ParameterError,
    likely,
    listed,
    meant,
    quoted,
    raised,
    shortened,
    unknown,
)
from lcpcli.methods import quantities as of
from lcpcli.methods.quantities import Quantity
from lcpcli.options import AUTO, Option

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem

ADDITIONS = {  # options of every method that iterates
    "scale": "Work on the equilibrated problem.",
    "finish": "Stop once the active set yields the solution.",
}
SWITCHES = {  # options of auto that are on unless they are switched off
    "presolve": (
        "First remove free variables of a mixed problem that a single equation "
        "determines, and rewrite its equations in the best way."
    )
}
OF_AUTO = dict.fromkeys(SWITCHES, True)  # options in force of auto, if none is chosen
START_OPTIONS = ("x0", "z0", "basis")  # of which at most one may be set
ANY = "any matrix"  # instead of a class

P = Option(
    "p",
    float,
    None,
    "0 < p < infinity",
    lambda p: 0 < p < math.inf,
    "Smoothing parameter; by default so large that the smoothing error is below "
    "rounding, so that nothing is smoothed.",
    derived="default_p",
)
K_STAR = Option(
    "k_star", int, 100, *options.POSITIVE, "Steepest descent every k* iterates."
)
RHO = Option(
    "rho",
    float,
    1e-4,
    "0 < rho < 1/2",
    lambda rho: 0 < rho < 0.5,
    "Line search: sufficient decrease.",
)
SIGMA = Option(
    "sigma",
    float,
    0.9,
    "rho < sigma < 1",
    lambda sigma: 0 < sigma < 1,
    "Line search: curvature.",
    above="rho",
)
OMEGA = Option(
    "omega",
    float,
    1.0,
    "0 < omega < infinity, or auto",
    lambda omega: 0 < omega < math.inf,
    "Modulus parameter; 1 is the published method, auto estimates it from the "
    "spectrum of M.",
    words=(AUTO,),
)
ANDERSON = Option(
    "anderson",
    int,
    0,
    *options.NATURAL,
    "Anderson acceleration with this many previous steps; 0 is the published method.",
)
START_SLACK = Option(
    "start_slack",
    float,
    1.0,
    "0 < slack < infinity",
    lambda slack: 0 < slack < math.inf,
    "Least slack and multiplier at the start, in the scaled problem; later attempts "
    "use multiples of it.",
)
REGULARIZATION = Option(
    "regularization",
    float,
    1e-8,
    "0 < rho <= 1",
    lambda rho: 0 < rho <= 1,
    "Initially added to the diagonal of the factors, then adapted.",
)
BETA = Option(
    "beta",
    float,
    0.7,
    "0 < beta < 2",
    lambda beta: 0 < beta < 2,
    "Relaxation: the fraction of each step that is taken; 1 is the method of "
    "Douglas and Rachford.",
)
WALKERS = Option(
    "walkers",
    int,
    16,
    *options.up_to(10**6),
    "Number of iterations that share the matrix products.",
)
SEED = Option("seed", int, 0, *options.NATURAL, "Seed of the random starts.")
ONES = "ones"
LARGEST = "largest"
LEXICOGRAPHIC = "lexicographic"
COVER = Option(
    "cover",
    int,
    0,
    "integer >= 0, or ones",
    lambda seed: seed >= 0,
    "Covering vector: ones, or the seed of a random one that keeps rows from "
    "blocking simultaneously.",
    words=(ONES,),
)
TIES = Option(
    "ties",
    int,
    LARGEST,
    f"{LARGEST} or {LEXICOGRAPHIC}",
    lambda _: False,
    "Which of the rows that block simultaneously leaves: the one with the "
    "largest pivot, or the lexicographic minimum.",
    words=(LARGEST, LEXICOGRAPHIC),
)
RESTARTS = Option(
    "restarts",
    int,
    12,
    *options.NATURAL,
    "Other starts, where the first one leads to no solution.",
)


class Method(NamedTuple):
    """The declaration of one method.

    meaning : one line of help, with the source.
    options : its numeric options, keyword-only parameters of its function; two methods
        may share an option.
    switches : its options that are on by default, with their help.
    vectors : its parameters that are vectors and are written like a start, with their
        help.
    iterates : whether it is an iteration on x, to which ADDITIONS apply. uses_start :
        whether the start matters.
    takes_bounds : whether it accepts mixed problems; else it gets their standard form,
        an LCP.
    excludes_exactly : whether it excludes complementary sets only by exact arithmetic,
        so that it is believed if it has excluded all of them.
    max_unknowns : the largest n for which it is begun; None for no limit.
    guaranteed : the classes of M, keys of `inspection.verdict.CLASSES` or ANY, for
        which, in exact arithmetic, it terminates at a solution or with a proof that
        there is none, each with what it does; the first class that contains M applies.
    quantities : the quantities that its iterates have for columns; two methods may
        share one.
    location : the module, in lcpcli.methods or by its full name, and the function, if
        they are not named after the method.
    package : the name and version of the other package that provides it, set when the
        method is loaded.
    """

    meaning: str
    options: tuple[Option, ...] = ()
    switches: Mapping[str, str] = {}
    vectors: Mapping[str, str] = {}
    iterates: bool = False
    uses_start: bool = False
    takes_bounds: bool = False
    excludes_exactly: bool = False
    max_unknowns: int | None = None
    guaranteed: Mapping[str, str] = {}
    quantities: tuple[Quantity, ...] = ()
    location: tuple[str, str] | None = None
    package: str | None = None


METHODS = {
    "auto": Method(
        "the first method that solves the problem, or proves that it has no solution",
        switches=SWITCHES,
        uses_start=True,
        takes_bounds=True,
        excludes_exactly=True,
        guaranteed={
            ANY: (
                "it falls back on milp, which needs no property of M; exponential "
                "in n at worst"
            )
        },
        quantities=(of.X, of.INFEASIBILITIES, of.MU, of.LENGTH, of.RHO),
        location=("lcpcli.auto.policy", "auto"),
    ),
    "shi": Method(
        "smoothed vector divisions (El foutayeni and Khaladi 2012, after Shi 2008)",
        options=(P, K_STAR, RHO, SIGMA),
        vectors={
            "x1": (
                "Second point of shi.  [default: the problem's, else a "
                "steepest-descent step]"
            )
        },
        iterates=True,
        uses_start=True,
        takes_bounds=True,
        guaranteed={
            "p_matrix": "steepest descent finds the solution, unless rounding stalls it"
        },
        quantities=(
            of.X,
            of.MERIT,
            of.SIZE,
            of.DESCENT,
            of.XI1,
            of.XI2,
            of.U,
            of.V,
            of.ALPHA,
            of.DIRECTION,
            of.SLOPE,
            of.LENGTH,
            of.TRIALS,
        ),
    ),
    "fixed-point": Method(
        "modulus iteration (Schäfer 2004)",
        options=(OMEGA, ANDERSON),
        iterates=True,
        uses_start=True,
        takes_bounds=True,
        guaranteed={
            "positive_definite": "each step reduces the error, for every omega",
            "h_plus": "",
        },
        quantities=(of.X, of.SIZE, of.FACTOR, of.OMEGA),
    ),
    "newton": Method(
        "generalized Newton, safeguarded block principal pivoting (Kostreva "
        "1978; Júdice and Pires 1994)",
        uses_start=True,
        takes_bounds=True,
        guaranteed={"p_matrix": "it finds the solution, usually in a handful of steps"},
        quantities=(of.X, of.INFEASIBILITIES),
    ),
    "interior": Method(
        "interior point method (Mehrotra 1992; Gondzio 1996)",
        options=(START_SLACK, REGULARIZATION),
        takes_bounds=True,
        guaranteed={
            "positive_definite": (
                "it follows the central path to the solution, unless rounding stalls it"
            )
        },
        quantities=(of.MU, of.LENGTH, of.RHO),
    ),
    "lemke": Method(
        "complementary pivoting (Lemke 1965; Sargent 1978)",
        options=(COVER, TIES),
        takes_bounds=True,
        max_unknowns=5000,  # since the tableau is dense
        guaranteed={
            "p_matrix": "it finds the solution",
            "strictly_copositive": "it finds a solution",
            "copositive_plus": (
                "it finds a solution, or a ray that proves that there is none"
            ),
            "row_sufficient": (
                "it finds a solution, or a ray that proves that there is none"
            ),
        },
        quantities=(of.X, of.ENTERING, of.LEAVING, of.Z0),
    ),
    "reflections": Method(
        "relaxed reflections of random points (Elser, Rankenburg and Thibault "
        "2007); it proves nothing",
        options=(BETA, WALKERS, SEED),
        takes_bounds=True,
        max_unknowns=2000,  # since a matrix of order 2n then takes 64 MB
        quantities=(of.X,),
    ),
    "milp": Method(
        "mixed-integer program (Pardalos and Rosen 1988)",
        takes_bounds=True,
        excludes_exactly=True,
        guaranteed={ANY: "it needs no property of M; exponential in n at worst"},
        quantities=(of.X,),
    ),
}

# Methods for nonlinear problems, which `METHODS` for linear ones does not list.
NONLINEAR = {
    "josephy-newton": Method(
        "Newton's method (Josephy 1979; Dirkse and Ferris 1995)",
        (RESTARTS,),
        uses_start=True,
    )
}


# Names of other methods, which `meant` does not recognize, with the method of the same
# kind here.
OTHER_NAMES = {
    **dict.fromkeys(
        ("schafer", "psor", "sor", "jacobi", "gauss-seidel", "projection"),
        "fixed-point",
    ),
    **dict.fromkeys(("simplex", "pivoting"), "lemke"),
    **dict.fromkeys(("ipm", "barrier"), "interior"),
    **dict.fromkeys(("semismooth", "active-set"), "newton"),
    **dict.fromkeys(("mip", "branch-and-bound"), "milp"),
    "path": AUTO,
}


def suggestion(name: str, valid_names: Iterable[str], otherwise: str = "") -> str:
    """Return the hint for an unknown word: the method that it may mean, one that
    resembles it, or `otherwise`."""
    other = OTHER_NAMES.get(name.casefold().replace("_", "-"))
    return (
        f"did you mean {other}?"
        if other
        else meant(name, meanings()) or likely(name, valid_names, otherwise)
    )


def options_of(methods: Mapping[str, Method]) -> dict[str, Option]:
    """Return the options of some methods by name; raise ValueError if a name belongs to
    two of them."""
    options: dict[str, Option] = {}
    for name, method in methods.items():
        for option in method.options:
            if options.setdefault(option.name, option) is not option:
                owner = next(
                    other
                    for other in methods
                    if options[option.name] in methods[other].options
                )
                raise ValueError(
                    f"{owner} and {name} have two options {option.name}: share "
                    "it, or rename one"
                )
    return options


OPTIONS = options_of({**METHODS, **NONLINEAR})
ALL = "all"  # instead of the names of quantities
# By name, in the order in which tables have them.
_DECLARED = [each for each in vars(of).values() if isinstance(each, Quantity)]
QUANTITIES = {quantity.name: quantity for quantity in _DECLARED}


def meanings() -> dict[str, str]:
    return {name: method.meaning for name, method in METHODS.items()}


def declared(name: str) -> Method:
    """Return the declaration of the method of that name, also of another package; an
    OptionError suggests a name."""
    if name not in METHODS and name not in NONLINEAR:
        with imports:
            from lcpcli.additions import addition, names, package
        if method := addition("methods", str(name)):
            if not isinstance(method, Method) or method.location is None:
                reason = f"{name} of another package is no Method with a location"
                raise ParameterError("method", reason, "see lcp help development")
            METHODS[name] = method._replace(package=package("methods", name))
            OPTIONS.update(
                {
                    option.name: option
                    for option in method.options
                    if option.name not in OPTIONS
                }
            )
            QUANTITIES.update(
                {
                    quantity.name: QUANTITIES.get(quantity.name, quantity)
                    for quantity in method.quantities
                }
            )
            return METHODS[name]
        raise ParameterError(
            "method",
            unknown(name),
            suggestion(str(name), [*METHODS, *names("methods")]),
        )
    return METHODS.get(name) or NONLINEAR[name]


def quantities_of(methods: Iterable[str]) -> dict[str, Quantity]:
    """Return the quantities that some of these methods have, by name."""
    return {
        quantity.name: quantity
        for name in methods
        for quantity in declared(name).quantities
    }


def owners_of(quantity: str) -> list[str]:
    """Return the names of the methods that have a quantity."""
    return [
        name
        for name, method in METHODS.items()
        if quantity
        in (declared_quantity.name for declared_quantity in method.quantities)
    ]


def require_quantities(names: Iterable[str], methods: Sequence[str]) -> None:
    """Raise ParameterError for the name of a quantity that none of the methods has."""
    valid_names, asked = quantities_of(methods), list(dict.fromkeys(methods))
    for name in names:
        if name in QUANTITIES and name not in valid_names:
            verb = "have" if len(asked) > 1 else "has"
            owners = listed(owners_of(name))
            raise ParameterError(
                "columns",
                f"{listed(asked)} {verb} no {name}",
                f"it belongs to {owners}",
            )


def load(name: str) -> Any:
    """Return the function of the method of that name, from (problem, x0, **options) to
    a `Stage`."""
    module, function = declared(name).location or 2 * (name.replace("-", "_"),)
    import_path = module if "." in module else f"lcpcli.methods.{module}"
    with imports:
        try:
            return getattr(import_module(import_path), function)
        except Exception as error:
            if import_path.startswith("lcpcli."):
                raise
            reason = (
                f"{name} of another package cannot be loaded from {import_path}: "
                f"{raised(error)}"
            )
            raise ParameterError(
                "method", reason, "correct its location, or install that package again"
            ) from None


def parameters_of(name: str) -> list[str]:
    """Return all parameters of a method's function besides the problem and the
    start."""
    method = declared(name)
    return [
        *method.vectors,
        *(option.name for option in method.options),
        *method.switches,
    ]


def known_options(name: str) -> set[str]:
    """Return all options of the command line that have an effect on a method: those
    that it declares, the additions and the starts."""
    method = declared(name)
    return {
        *parameters_of(name),
        *(START_OPTIONS if method.uses_start else ()),
        *(ADDITIONS if method.iterates else ()),
    }


def check(name: str, chosen: Mapping[str, Any]) -> None:
    """Raise OptionError for a chosen option that has no effect on the method, or is out
    of its range."""
    valid_options, method = parameters_of(name), declared(name)
    for option, value in chosen.items():
        if option not in {*OPTIONS, *SWITCHES, *valid_options}:
            raise OptionError(
                option,
                "is not an option of any method",
                f"the options are {', '.join(valid_options)}",
            )
        if option not in valid_options:
            raise ParameterError(
                option, f"has no effect with the method {name}", LEAVE_OUT
            )
        if option in method.switches and not isinstance(value, bool):
            raise ParameterError(
                option, f"{value!r} is neither True nor False", "give one of them"
            )
    options.check(method.options, chosen)


def options_in_force(
    name: str, problem: Problem, chosen: Mapping[str, Any]
) -> dict[str, Any]:
    """Return all of a method's parameters with their values: chosen, default, or
    derived from the problem.

    Raises OptionError as `check` does, whether or not the method will have anything to
    do.
    """
    method = declared(name)
    if chosen:
        check(name, chosen)
    values: dict[str, Any] = {vector: chosen.get(vector) for vector in method.vectors}
    for option in method.options:
        value = chosen.get(option.name, option.default)
        if value is None and option.derived:
            with imports:
                module = import_module(load(name).__module__)
            value = getattr(module, option.derived)(problem)
        values[option.name] = value
    for switch in method.switches:
        values[switch] = chosen.get(switch, True)
    return values


TRUTHS = {"true": True, "false": False}
FLAGS = (*ADDITIONS, *SWITCHES)  # options that need no value, which means true


class Variant(NamedTuple):
    """A method with the options that are set for a run of it, as texts: ("shi", (("p",
    "10"), ("k_star", "5")))."""

    method: str
    settings: tuple[tuple[str, str], ...] = ()

    @property
    def options(self) -> dict[str, Any]:
        return {name: _value(name, text) for name, text in self.settings}

    def __str__(self) -> str:
        """Return the variant as it is written: shi:p=10,k-star=5."""
        alone = {(name, "true") for name in FLAGS}
        parts = [
            _dashed(each[0]) + ("" if each in alone else f"={each[1]}")
            for each in self.settings
        ]
        return f"{self.method}:{','.join(parts)}" if parts else self.method


def parse(text: str) -> Variant:
    """Return the variant written METHOD or METHOD:OPTION=VALUE,...; an addition such as
    scale needs no value.

    Raises OptionError for an unknown method, for an option that it does not have, and
    for a value out of range.
    """
    method, _, rest = text.partition(":")
    return _checked(
        Variant(method, tuple(_setting(part) for part in rest.split(",") if rest)),
        "method",
    )


def sweep(variants: Sequence[Variant], axes: Sequence[str]) -> list[Variant]:
    """Return each variant once for every value, written OPTION=VALUE,VALUE,...; several
    options make a grid.

    A variant of a method without the option remains as it is. Raises OptionError for an
    option that no variant has, and for one that a variant sets already.
    """
    where = "sweep"
    for axis in axes:
        name, _, text = axis.partition("=")
        name = name.strip().replace("-", "_")
        values = [value.strip() for value in text.split(",")]
        if not all(values):
            hint = "write OPTION=VALUE,VALUE,..., as in p=1,10,100"
            raise ParameterError(where, f"{quoted(axis)} lacks a value", hint)
        if not any(name in _declared_options(variant.method) for variant in variants):
            if owners := owning(name):
                reason = (
                    f"{_dashed(name)} has no effect with "
                    f"{' and '.join(dict.fromkeys(v.method for v in variants))}"
                )
                raise ParameterError(where, reason, f"add --method {owners[0]}")
            reason = f"{quoted(_dashed(name))} is not an option of any method"
            option_names = map(_dashed, (*OPTIONS, *FLAGS))
            raise ParameterError(where, reason, likely(_dashed(name), [*option_names]))
        swept = list[Variant]()
        for variant in variants:
            if name in dict(variant.settings):
                raise ParameterError(
                    where,
                    f"{_dashed(name)} is also set by {variant}",
                    LEAVE_ONE_OUT,
                )
            more = (
                [((name, value),) for value in values]
                if name in _declared_options(variant.method)
                else [()]
            )
            swept += [
                Variant(variant.method, variant.settings + setting) for setting in more
            ]
        variants = [_checked(variant, where) for variant in swept]
    return list(dict.fromkeys(variants))


def labels(variants: Sequence[Variant]) -> list[str]:
    """Return a name for each variant: its method, with the settings in which the
    variants of that method differ."""
    names = []
    for variant in variants:
        alike = [
            set(each.settings) for each in variants if each.method == variant.method
        ]
        shared = set.intersection(*alike) if len(alike) > 1 else set()
        settings = tuple(
            setting for setting in variant.settings if setting not in shared
        )
        names.append(str(Variant(variant.method, settings)))
    return names


def _dashed(name: str) -> str:
    return name.replace("_", "-")


def _setting(setting: str) -> tuple[str, str]:
    """Return the name of an option as in Python, and the text after it; an addition
    such as scale needs no value."""
    name, equals, value = (item.strip() for item in setting.partition("="))
    name = name.replace("-", "_")
    if not equals and name in FLAGS:
        return name, "true"
    if not value:
        raise ParameterError(
            "method",
            f"{quoted(setting)} has no value",
            "write METHOD:OPTION=VALUE, as in shi:p=10",
        )
    return name, value


def _declared_options(method: str) -> list[str]:
    """Return the options that a variant of the method may set."""
    declaration = declared(method)
    return [
        *(option.name for option in declaration.options),
        *declaration.switches,
        *(ADDITIONS if declaration.iterates else ()),
    ]


def _checked(variant: Variant, where: str) -> Variant:
    """Return the variant if its options are known, set once and in their ranges; else
    raise OptionError.

    where : the option of the command that has set them.
    """
    valid_options = _declared_options(variant.method)
    for i, (name, _) in enumerate(variant.settings):
        if name not in valid_options:
            option_names = [_dashed(one) for one in valid_options]
            hint = (
                likely(_dashed(name), option_names, f"it has {', '.join(option_names)}")
                if option_names
                else "it has none"
            )
            if owners := owning(name):
                hint = f"it belongs to {listed(owners)}"
            reason = f"{variant.method} has no option {shortened(_dashed(name))}"
            raise ParameterError("method", reason, hint)
        if name in dict(variant.settings[:i]):
            raise ParameterError(
                "method", f"{_dashed(name)} is set twice in {variant}", LEAVE_ONE_OUT
            )
    try:
        options.check(declared(variant.method).options, variant.options)
    except ParameterError as error:
        raise ParameterError(
            where, f"{_dashed(error.where)}: {error.fault}", error.hint
        ) from None
    return variant


def _value(name: str, text: str) -> Any:
    """Return the value of an option from its text: a number, one of its words, or true
    or false for one of FLAGS."""
    if name in FLAGS:
        if text not in TRUTHS:
            raise ParameterError(
                name, f"{quoted(text)} is neither true nor false", "write true or false"
            )
        return TRUTHS[text]
    return OPTIONS[name].value_of(text)


def in_variant(name: str, value: str, chosen: str) -> str:
    """Return the variant METHOD:OPTION=VALUE that has the effect of an option of the
    command line with this name, such as "no-scale", and value; "" if no method has it.
    chosen : the variant to which it is added, if its method has the option."""
    option = name.removeprefix("no-").replace("-", "_")
    if not (owners := owning(option)):
        return ""
    variant = chosen if chosen.partition(":")[0] in owners else owners[0]
    setting = f"{_dashed(option)}={value or 'VALUE'}"
    if option in FLAGS:
        setting = _dashed(option)
        if name.startswith("no-"):
            setting += "=false"
    return f"{variant}{',' if ':' in variant else ':'}{setting}"


def owning(name: str) -> list[str]:
    """Return the names of the methods that have an option."""
    return [
        method for method in (*METHODS, *NONLINEAR) if name in _declared_options(method)
    ]
