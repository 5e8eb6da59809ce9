"""Methods and peers on suites of problems: what each solves, in what time, and whether its claims are true.

A bench is a `record.Record`: the cases of a suite, the solvers, the options, and one `record.Measurement` for each
finished pair of case and solver. Everything shown is computed from the record alone.
"""
