"""Running a method on a problem: the one loop, its limits and clock, the result, and the conclusions from it."""
