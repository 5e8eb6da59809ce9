"""Linear and quadratic programs: their first-order conditions, and what a solution of
these, or the absence of one, says about the program."""
