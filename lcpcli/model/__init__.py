"""The problem: M and q with what is known about them, the change of variables, and reductions from other problems."""
