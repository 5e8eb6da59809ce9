"""Methods and peers on suites of problems: what each solves, in what time, and whether its claims are true.

A bench is a `record.Record`: the cases of a suite, the solvers, the options, and one `record.Measurement` for each
finished pair of case and solver. Everything shown is computed from the record alone.
"""

FORMATS = {
    "table": "human-readable",
    "json": "the record, to resume from",
    "csv": "one row per measurement, all digits",
    "markdown": "the tables in Markdown",
    "latex": "the tables in LaTeX with booktabs",
}
