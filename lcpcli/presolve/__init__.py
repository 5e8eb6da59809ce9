"""Rules that make a mixed problem smaller, each with the way back. It uses `linalg` and
`model`."""
