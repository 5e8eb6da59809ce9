"""Linear and quadratic programs: their first-order conditions, and what a solution of
these conditions, or a proof that there is none, says about the program.
"""
