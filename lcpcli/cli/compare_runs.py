"""lcp compare-runs: earlier runs compared with those of today."""

from __future__ import annotations

import math

from lcpcli import options
from lcpcli.cli.command import argument, command
from lcpcli.cli.declarations import FILES, format_option, numeric, output_file, quiet_option
from lcpcli.cli.main import NOT_SOLVED, SOLVED
from lcpcli.cli.output import Destination
from lcpcli.cli.problems import Inputs
from lcpcli.options import Option
from lcpcli.report.document import MEANINGS

FORMATS = {**MEANINGS, "json": "an object for each run, for scripts", "csv": "a row for each run, all digits"}
SLOWER = Option(
    "slower",
    float,
    None,
    "ratio > 1",
    lambda ratio: 1 < ratio < math.inf,
    "Also fail if a run takes at least this many times as long, beyond its spread; by default times never fail.",
)


@command(
    short_help="Compare the runs in two files.",
    examples=(
        "lcp bench dense -o last-week.json",
        "lcp bench dense -o today.json",
        "lcp compare-runs last-week.json today.json",
        "lcp compare-runs last-week.json today.json --slower 1.5 --quiet",
    ),
    exits={
        0: "no run is worse",
        1: "a run is worse, contradicts the earlier one, or is slower than --slower allows",
        2: "usage or input error",
    },
    epilog="Unchanged runs appear only in JSON and CSV. lcp help measuring says when a time counts as different.",
)
@argument(
    "Runs",
    "old",
    {"OLD": "Earlier runs: a file of lcp bench -o FILE.json, or results of lcp solve or compare in JSON."},
    shell_complete=FILES,
)
@argument("Runs", "new", {"NEW": "Current runs, of the same methods on the same problems."}, shell_complete=FILES)
@numeric("Comparison", SLOWER)
@format_option(FORMATS)
@output_file()
@quiet_option()
def compare_runs(old: str, new: str, slower: float | None, form: str | None, output: str | None, quiet: bool) -> int:
    """Compare how the runs in OLD and in NEW ended: status, iterations and time."""
    options.check((SLOWER,), {"slower": slower})
    destination = Destination.of(form, output, quiet)
    Inputs((old, new), quiet=quiet).prepare({"--output": output})
    from lcpcli.bench.comparison import Comparison

    comparison = Comparison((old, new), math.inf if slower is None else slower)
    destination.show(comparison.render)
    return NOT_SOLVED if comparison.failures else SOLVED
