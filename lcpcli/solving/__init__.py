"""A method on a problem: the one loop, its limits and clock, the result, and what is concluded from it."""
