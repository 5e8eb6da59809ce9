"""Other solvers by name, one a module, imported when they are asked for.

A peer's module opens with what it is and what the tolerance means to it, and has

    version() -> str | None : the installed version, None if it is not installed.
    excludes(problem) -> str : why it does not take such a problem, as a clause; "" if it does.
    solve(problem, tol, time_limit) -> Claim : what it makes of the problem, at its own tolerance tol and in time_limit
        seconds, where it has such a thing. OptionError if it is not installed.
"""
