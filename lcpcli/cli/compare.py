"""lcp compare: several methods side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lcpcli.cli import declarations
from lcpcli.cli.command import EXITS, command
from lcpcli.cli.request import Request
from lcpcli.files import contents
from lcpcli.methods.registry import NONLINEAR, Variant
from lcpcli.report.wording import LEVELS

AS_PUBLISHED = ("fixed-point", "shi")


@command(
    short_help="Run methods side by side.",
    examples=(
        "lcp compare",
        "lcp compare tridiagonal-100 --every 10",
        "lcp compare --method newton --method lemke --method shi",
        "lcp compare --method shi --sweep k-star=1,5,20,100 --plot sweep.svg",
        "lcp compare --method shi --k-star 1 --format csv",
        "lcp compare paper-example-1 --plot errors.svg",
    ),
    lists={"Methods": declarations.METHOD.meanings},
    exits={**EXITS, 0: "every method solved every problem"},
    epilog="An option applies to the methods that have it. Errors refer to a known solution, else to a computed one. "
    "By default auto runs too where neither of the paper's methods solves a problem; the exit code is theirs.",
)
@declarations.files_argument(
    "Problem",
    "files",
    "[FILE [Q_FILE]|FOLDER]...",
    {
        "FILE [Q_FILE]": f"As for lcp solve. {declarations.OTHERS} "
        "A file that contains M alone is followed by the file of q.  "
        "[default: the paper's two examples]"
    },
)
@declarations.with_bounds
@declarations.several_methods("Method", "compare", AS_PUBLISHED)
@declarations.solving
def compare(files: Sequence[str], methods: Sequence[Variant], sweep: Sequence[str], **given: Any) -> int:
    """Run methods side by side on the problem in each FILE."""
    examples = [contents.shipped_path(name) for name in contents.PAPER_EXAMPLES]
    request = Request.of(files, examples, levels=LEVELS, sweep=sweep, **given)
    from lcpcli.cli.session import run

    default = AS_PUBLISHED if methods else _that_apply(request.inputs.files)
    chosen = declarations.chosen_variants(methods, sweep, default, request.own)
    return run(request._replace(variants=chosen, adds_auto=not (methods or sweep or request.own)))


def _that_apply(files: Sequence[str]) -> Sequence[str]:
    """Return the methods that are compared by default: those for nonlinear problems if all files have such models."""
    if not all(file.casefold().endswith(".nl") for file in files):
        return AS_PUBLISHED
    from lcpcli.files.inputs import nonlinear_in

    are_nonlinear = all(nonlinear_in(file, contents.content_of(file, "")) for file in files)
    return tuple(NONLINEAR) if are_nonlinear else AS_PUBLISHED
