"""The problem: M and q with what is known about them, changes of variables, and
reductions from other problems."""
