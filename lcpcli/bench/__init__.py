"""Methods and peers on suites of problems: what each solves, in which time, and whether what it claims is so.

A bench is a `record.Record`: the cases of a suite, the solvers, the options, and one `record.Measurement` for each
case and solver that is done. Everything shown is computed from the record alone.
"""
