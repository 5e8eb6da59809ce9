"""Rules that make a mixed problem smaller, each with its postsolve. It uses `linalg`
and `model`."""
