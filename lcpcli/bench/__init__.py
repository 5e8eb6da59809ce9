"""Methods and peers on suites of problems: what each solves, in what time, and whether
its claims are true; all that is shown is computed from a `record.BenchRecord`."""
